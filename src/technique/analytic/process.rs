//! A reconstruction at work: block after block of views is made by the host and added to the grid by the device.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::deconvolve::{Deblurred, Planes};
use super::rows::Rows;
use super::{BackprojectionPass, BackprojectionView, Method, Reconstruction};
use crate::device::{Buffer, Device, SliceLength, grid};
use crate::error::Result;
use crate::technique::{Look, Process, Progress, Step};
use crate::tomography::{DataCheck, Moments};

/// The most views of a block: each voxel is read and written once a block.
const VIEWS: usize = 64;
/// The most bins of a block.
const BINS: usize = 1 << 22;
/// The rays, times shapes, that the host projects at a time: some ms.
const RAYS: usize = 1 << 18;

pub(super) struct Run {
    of: Arc<Reconstruction>,
    rows: Rows,
    grid: Buffer,
    pass_buffer: Buffer,
    /// The views that the grid has.
    done: usize,
    block: Block,
    /// The moments of each view.
    moments: Vec<Moments>,
    deblurred: Deblurred,
    slice_length: SliceLength,
    device_time: Duration,
}

/// The views that are added next.
struct Block {
    views: usize,
    /// Their rows that are made.
    made: Vec<f32>,
    rows_made: usize,
    /// The rows and the views on the device, once all are made.
    on_device: Option<[Buffer; 2]>,
    /// The first row of voxels that has not got them.
    next_row: usize,
}

/// Voxels along x of a work-item: `LANES` times `PACKETS` of `kernels/shared/backproject.h`.
fn voxels_of_item(lanes: usize) -> usize {
    if lanes == 1 { 1 } else { 4 * lanes }
}

impl Run {
    pub fn new(device: &Device, of: Arc<Reconstruction>) -> Result<Self> {
        let zeros = vec![0; size_of::<f32>() * of.computed().iter().product::<usize>()];
        let run = Self {
            rows: Rows::new(&of),
            grid: device.upload(&zeros, grid::PADDING)?,
            pass_buffer: device.allocate(size_of::<BackprojectionPass>())?,
            done: 0,
            block: Block::of(&of, 0),
            moments: Vec::new(),
            deblurred: Deblurred::default(),
            slice_length: SliceLength::new(device.info(), 1.0, None),
            device_time: Duration::ZERO,
            of,
        };
        Ok(run)
    }

    /// Makes some rows of the block; sends them all to the device once they are there.
    fn make(&mut self, device: &Device) -> Result<()> {
        let [bins, rows] = self.of.geometry.count();
        let (all, first) = (self.block.views * rows, self.done * rows);
        let some = (RAYS / (bins * self.of.data.work())).max(1).min(all - self.block.rows_made);
        let from = first + self.block.rows_made;
        let (made, moments) = self.rows.make(&self.of, from..from + some)?;
        for (row, of_row) in (from..).zip(moments) {
            self.moments.resize(row / rows + 1, Moments::default());
            self.moments[row / rows].add(&of_row);
        }
        self.block.made.extend(made);
        self.block.rows_made += some;
        if self.block.rows_made == all {
            let views: Vec<u8> = (self.done..self.done + self.block.views)
                .flat_map(|view| bytemuck::bytes_of(&self.view(view)).to_vec())
                .collect();
            let rows = device.upload(bytemuck::cast_slice(&self.block.made), grid::PADDING)?;
            self.block.on_device = Some([rows, device.upload(&views, 0)?]);
        }
        Ok(())
    }

    /// A view as the kernel sees it.
    fn view(&self, view: usize) -> BackprojectionView {
        let (sin, cos) = self.of.geometry.angles()[view].sin_cos();
        let spacing = self.of.geometry.spacing_mm()[0];
        let first = self.of.first_mm(0) * cos + self.of.first_mm(1) * sin;
        BackprojectionView {
            first: self.of.geometry.bin(0, first) as f32,
            along_x: (self.of.spacing_mm[0] * cos / spacing) as f32,
            along_y: (self.of.spacing_mm[1] * sin / spacing) as f32,
        }
    }

    /// Adds the block to as many rows of voxels as fit in `slice`. Returns the time on the device.
    fn add(&mut self, device: &mut Device, slice: Duration) -> Result<Duration> {
        let Some([rows, views]) = &self.block.on_device else { return Ok(Duration::ZERO) };
        let [wide, high, deep] = self.of.computed();
        let work = wide * self.block.views;
        let some = self.slice_length.items(device.info(), slice, work).clamp(1, high * deep - self.block.next_row);
        let end = self.block.next_row + some;
        let v_first = self.of.bin_of_plane(0);
        let pass = BackprojectionPass {
            dims: self.of.computed().map(|n| n as i32),
            first_row: self.block.next_row as i32,
            end_row: end as i32,
            views: self.block.views as i32,
            bins: self.of.geometry.count().map(|n| n as i32),
            stride: Rows::stride(&self.of) as i32,
            v_first: v_first as f32,
            v_step: (self.of.spacing_mm[2] / self.of.geometry.spacing_mm()[1]) as f32,
        };
        device.write(&mut self.pass_buffer, 0, bytemuck::bytes_of(&pass))?;
        let arguments = [("pass", &self.pass_buffer), ("views", views), ("rows", rows), ("grid", &self.grid)];
        let across = wide.div_ceil(voxels_of_item(device.info().lanes as usize));
        let took = device.run(&self.of.variant(), &arguments, [across, some])?;
        self.slice_length.learn(some, work, took);
        self.block.next_row = end;
        if end == high * deep {
            self.done += self.block.views;
            self.block = Block::of(&self.of, self.done);
        }
        Ok(took)
    }

    /// The voxels that are computed.
    fn computed(&self, device: &Device) -> Result<Vec<f32>> {
        let mut values = vec![0.0f32; self.of.computed().iter().product()];
        device.read(&self.grid, 0, &mut values)?;
        Ok(values)
    }

    fn planes(&self) -> Planes {
        let ([wide, high, _], [x, y, _]) = (self.of.computed(), self.of.spacing_mm);
        Planes { size: [wide, high], spacing_mm: [x, y], margin: self.of.margin() }
    }

    /// The result of a grid of so many views.
    fn result(&self, done: usize) -> Value {
        let ([u, v], views) = (self.of.geometry.count(), self.of.geometry.views());
        let angles = &self.of.geometry.angles()[..self.moments.len()];
        let check = DataCheck::of(angles, &self.moments);
        let mut warnings: Vec<Value> = Vec::new();
        let mut warn = |code: &str, message: String| warnings.push(json!({"code": code, "message": message}));
        for note in self.of.data.notes() {
            warn("readings", note.clone());
        }
        if let Some(check) = &check {
            for (code, message) in check.warnings(self.of.geometry.spacing_mm()[0]) {
                warn(code, message);
            }
        }
        if self.rows.missing > 0.0 {
            let missing = self.rows.missing.to_degrees();
            warn(
                "missing_wedge",
                format!("no view looks along a wedge of {missing:.1}°: what is flat along it cannot be seen"),
            );
        }
        // Crowther, DeRosier & Klug (Proc. R. Soc. A 317, 1970): π/2 views per bin resolve what the bins do.
        let needed = (std::f64::consts::FRAC_PI_2 * u as f64).ceil() as usize;
        if views < needed / 2 {
            warn(
                "few_views",
                format!(
                    "{views} views are fewer than half of the {needed} that resolve what {u} bins do: expect streaks"
                ),
            );
        }
        let unseen = self.of.dims[2] - self.of.planes_seen();
        if unseen > 0 {
            warn(
                "planes_unseen",
                format!("{unseen} of {} planes are beyond the detector's rows and are 0", self.of.dims[2]),
            );
        }
        let device_ms = 1e3 * self.device_time.as_secs_f64();
        json!({"views": done, "bins": [u, v], "unit": "per_mm", "device_ms": device_ms, "data_check": check, "warnings": warnings})
    }
}

impl Block {
    /// The block of views from `first` on.
    fn of(of: &Reconstruction, first: usize) -> Self {
        let [u, v] = of.geometry.count();
        let fit = (BINS / (u * v)).clamp(1, VIEWS);
        let views = fit.min(of.geometry.views() - first);
        Self { views, made: Vec::new(), rows_made: 0, on_device: None, next_row: 0 }
    }
}

impl Process for Run {
    type Look = Look;

    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step> {
        let (begun, before) = (Instant::now(), self.done);
        let mut took = Duration::ZERO;
        while begun.elapsed() < slice && self.done < self.of.geometry.views() {
            if self.block.on_device.is_none() {
                self.make(device)?;
            } else {
                took += self.add(device, slice.saturating_sub(begun.elapsed()))?;
            }
        }
        self.device_time += took;
        let total = self.of.geometry.views();
        let is_more = before.checked_ilog2() != self.done.checked_ilog2();
        let mut step = Step {
            progress: Progress { of: "views", done: self.done as u64, total: total as u64 },
            device_time: took,
            is_whole: self.block.next_row == 0,
            is_look_due: is_more,
        };
        if self.of.method == Method::Deconvolved {
            let is_all = self.done == total;
            step.is_look_due = self.deblurred.take(is_all && took.is_zero())?;
            let newest = self.deblurred.newest().map_or(0, |(views, _)| views);
            if !self.deblurred.is_under_way() && step.is_whole && newest < self.done && (is_more || is_all) {
                self.deblurred.begin(self.done, self.computed(device)?, self.planes());
            }
            // The last view counts once it is in a deblurred grid.
            step.progress.done = self.done.min(if newest < total { total - 1 } else { total }) as u64;
        }
        Ok(step)
    }

    fn stop(&mut self, _: &mut Device) -> Result<()> {
        Ok(())
    }

    fn look(&mut self, device: &mut Device) -> Result<Look> {
        if self.of.method != Method::Deconvolved {
            let voxels = grid::copy(device, &self.grid, self.of.computed().iter().product())?;
            return Ok(Look { voxels, result: self.result(self.done) });
        }
        let upload = |voxels: &[f32]| device.upload(bytemuck::cast_slice(voxels), grid::PADDING);
        if let Some((views, voxels)) = self.deblurred.newest() {
            return Ok(Look { voxels: upload(voxels)?, result: self.result(views) });
        }
        // It was stopped before there was any.
        let voxels = self.planes().deblurred(self.computed(device)?);
        Ok(Look { voxels: upload(&voxels)?, result: self.result(self.done) })
    }
}
