//! The projection on the device, some rows of the sinogram a slice.

use std::sync::Arc;
use std::time::Duration;

use super::{ProjectPass, ProjectView, file, variant};
use crate::device::{Buffer, Device, SliceLength};
use crate::error::Result;
use crate::technique::{File, Process, Progress, Step};
use crate::tomography::{Geometry, GeometryRequest, Sinogram};
use crate::volume::Volume;

/// A projection at work.
pub(super) struct Run {
    volume: Arc<Volume>,
    voxels: Arc<Buffer>,
    /// How its geometry is said.
    asked: GeometryRequest,
    geometry: Geometry,
    views: Buffer,
    sinogram: Buffer,
    pass_buffer: Buffer,
    next_row: usize,
    slice_length: SliceLength,
    device_time: Duration,
}

impl Run {
    /// Allocates the sinogram.
    pub fn new(
        device: &Device,
        volume: Arc<Volume>,
        voxels: Arc<Buffer>,
        asked: GeometryRequest,
        geometry: Geometry,
        views: &[ProjectView],
    ) -> Result<Self> {
        let [u, v] = geometry.count();
        Ok(Self {
            volume,
            voxels,
            asked,
            views: device.upload(bytemuck::cast_slice(views), 0)?,
            sinogram: device.allocate(size_of::<f32>() * u * v * geometry.views())?,
            pass_buffer: device.allocate(size_of::<ProjectPass>())?,
            geometry,
            next_row: 0,
            slice_length: SliceLength::new(device.info(), 1.0, None),
            device_time: Duration::ZERO,
        })
    }

    fn rows(&self) -> usize {
        self.geometry.count()[1] * self.geometry.views()
    }

    /// Projects as many rows as fit in `slice`. Returns the time on the device.
    fn project(&mut self, device: &mut Device, slice: Duration) -> Result<Duration> {
        let (dims, bins) = (self.volume.dims(), self.geometry.count());
        let work = bins[0] * dims.into_iter().max().unwrap_or(1);
        let left = self.rows() - self.next_row;
        let some = self.slice_length.items(device.info(), slice, work).clamp(1, left);
        let (slope, inter) = (self.volume.slope(), self.volume.inter());
        let pass = ProjectPass {
            dims: dims.map(|n| n as i32),
            bins: bins.map(|n| n as i32),
            first_row: self.next_row as i32,
            end_row: (self.next_row + some) as i32,
            slope: slope as f32,
            inter: inter as f32,
            nothing: (-inter / slope) as f32,
        };
        device.write(&mut self.pass_buffer, 0, bytemuck::bytes_of(&pass))?;
        let arguments = [
            ("pass", &self.pass_buffer),
            ("views", &self.views),
            ("voxels", &*self.voxels),
            ("sinogram", &self.sinogram),
        ];
        let range = [bins[0].div_ceil(device.info().lanes as usize), some];
        let took = device.run(&variant(self.volume.voxel_type()), &arguments, range)?;
        self.slice_length.learn(some, work, took);
        self.next_row += some;
        Ok(took)
    }
}

impl Process for Run {
    type Look = File;

    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step> {
        let took = self.project(device, slice)?;
        self.device_time += took;
        Ok(Step {
            progress: Progress { of: "rows", done: self.next_row as u64, total: self.rows() as u64 },
            device_time: took,
            is_whole: true,
            is_look_due: false,
        })
    }

    fn stop(&mut self, _: &mut Device) -> Result<()> {
        Ok(())
    }

    fn look(&mut self, device: &mut Device) -> Result<File> {
        let mut values = vec![0.0f32; self.rows() * self.geometry.count()[0]];
        device.read(&self.sinogram, 0, &mut values)?;
        let sinogram = Sinogram::computed(self.asked.clone(), self.geometry.clone(), values, self.volume.name());
        let unit = if self.volume.unit() == "mm" { "value · mm" } else { "value · unit" };
        let without = self.volume.non_finite();
        let warning =
            (without > 0).then(|| file::warning("no_value", format!("{without} voxels have no value and count as 0")));
        file::of(&sinogram, "joseph", unit, self.device_time, warning.into_iter().collect())
    }
}
