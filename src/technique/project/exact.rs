//! The exact projection of a phantom, on the host, some rows of the sinogram a slice.

use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::file;
use crate::device::Device;
use crate::error::Result;
use crate::technique::{File, Process, Progress, Step};
use crate::tomography::{Geometry, GeometryRequest, Phantom, Sinogram};

/// The rays, times shapes, that are integrated between two looks at the clock: some ms.
const RAYS: usize = 1 << 17;

/// A projection at work.
pub(super) struct Exact {
    phantom: Phantom,
    /// How its geometry is said.
    asked: GeometryRequest,
    geometry: Geometry,
    values: Vec<f32>,
}

impl Exact {
    pub fn new(phantom: Phantom, asked: GeometryRequest, geometry: Geometry) -> Self {
        Self { phantom, asked, geometry, values: Vec::new() }
    }

    fn rays(&self) -> usize {
        self.geometry.count().iter().product::<usize>() * self.geometry.views()
    }
}

impl Process for Exact {
    type Look = File;

    fn step(&mut self, _: &mut Device, slice: Duration) -> Result<Step> {
        let (begun, rays) = (Instant::now(), self.rays());
        let [u, v] = self.geometry.count();
        while begun.elapsed() < slice && self.values.len() < rays {
            let from = self.values.len();
            let to = rays.min(from + (RAYS / self.phantom.shapes().max(1)).max(1));
            let integral = |i: usize| self.phantom.integral(&self.geometry.ray(i / (u * v), [i % u, i / u % v])) as f32;
            let more: Vec<f32> = (from..to).into_par_iter().map(integral).collect();
            self.values.extend(more);
        }
        Ok(Step {
            progress: Progress { of: "rays", done: self.values.len() as u64, total: rays as u64 },
            device_time: Duration::ZERO,
            is_whole: true,
            is_look_due: false,
        })
    }

    fn stop(&mut self, _: &mut Device) -> Result<()> {
        Ok(())
    }

    fn look(&mut self, _: &mut Device) -> Result<File> {
        let values = std::mem::take(&mut self.values);
        let sinogram = Sinogram::computed(self.asked.clone(), self.geometry.clone(), values, "phantom");
        file::of(&sinogram, "exact", "value · mm", Duration::ZERO, Vec::new())
    }
}
