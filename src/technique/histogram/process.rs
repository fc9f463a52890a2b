//! The histogram on the device. It counts some voxels per slice in whole numbers, so that the table is the same for any number of threads.

use std::fmt::Write;
use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};

use super::{HistogramPass, variant};
use crate::device::{Buffer, Device, SliceLength};
use crate::error::Result;
use crate::technique::{File, Process, Progress, Step};
use crate::volume::Volume;

/// Voxels of a work-item.
pub(super) const PER_ITEM: u32 = 4096;
/// Counts behind those of the bins: below the range, above it, NaN.
const OTHERS: usize = 3;

/// A histogram at work.
pub(super) struct Run {
    volume: Arc<Volume>,
    voxels: Arc<Buffer>,
    bins: usize,
    range: [f64; 2],
    pass: HistogramPass,
    pass_buffer: Buffer,
    counts: Buffer,
    slice_length: SliceLength,
}

impl Run {
    /// Allocates the counts.
    pub fn new(
        device: &Device,
        volume: Arc<Volume>,
        voxels: Arc<Buffer>,
        range: [f64; 2],
        pass: HistogramPass,
    ) -> Result<Self> {
        let bins = pass.bins as usize;
        Ok(Self {
            pass_buffer: device.allocate(size_of::<HistogramPass>())?,
            counts: device.upload(&vec![0; 4 * (bins + OTHERS)], 0)?,
            slice_length: SliceLength::new(device.info(), 1.0, None),
            volume,
            voxels,
            bins,
            range,
            pass,
        })
    }

    /// A warning if bins are narrower than the rounding of single precision, by which voxels are put into them.
    fn warnings(&self) -> Vec<Value> {
        let largest = self.range.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let (width, rounding) = ((self.range[1] - self.range[0]) / self.bins as f64, f64::from(f32::EPSILON) * largest);
        let message = "bins are narrower than the rounding of single precision: a voxel may be in a bin nearby";
        let warning = json!({"code": "narrow_bins", "message": message, "measured": width, "bound": rounding});
        (width < rounding).then_some(warning).into_iter().collect()
    }

    /// The table as CSV.
    fn table(&self, counts: &[u32]) -> String {
        let [low, high] = self.range;
        let edge = |bin: usize| low + (high - low) * bin as f64 / self.bins as f64;
        let (of_bins, others) = counts.split_at(self.bins);
        let finite = of_bins.iter().chain(&others[..2]).map(|n| u64::from(*n)).sum::<u64>().max(1) as f64;
        let mut at_least: u64 = of_bins.iter().map(|n| u64::from(*n)).sum::<u64>() + u64::from(others[1]);
        let mut text = String::from("from,to,voxels,part_at_least\n");
        for (bin, count) in of_bins.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{},{},{count},{}", edge(bin), edge(bin + 1), at_least as f64 / finite);
            at_least -= u64::from(*count);
        }
        text
    }

    fn result(&self, counts: &[u32]) -> Value {
        let [below, above, no_number] = [0, 1, 2].map(|i| counts[self.bins + i]);
        json!({"bins": self.bins, "range": self.range, "voxels": self.pass.end, "below": below, "above": above,
            "not_a_number": no_number, "unit": self.volume.unit(), "warnings": self.warnings()})
    }
}

impl Process for Run {
    type Look = File;

    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step> {
        let left = self.pass.end - self.pass.first;
        let items = self.slice_length.items(device.info(), slice, PER_ITEM as usize);
        let items = items.min(left.div_ceil(PER_ITEM) as usize);
        device.write(&mut self.pass_buffer, 0, bytemuck::bytes_of(&self.pass))?;
        let arguments = [("pass", &self.pass_buffer), ("voxels", &*self.voxels), ("counts", &self.counts)];
        let took = device.run(&variant(self.volume.voxel_type()), &arguments, items)?;
        self.slice_length.learn(items, PER_ITEM as usize, took);
        self.pass.first += left.min((items as u32).saturating_mul(PER_ITEM));
        Ok(Step {
            progress: Progress { of: "voxels", done: self.pass.first.into(), total: self.pass.end.into() },
            device_time: took,
            is_whole: true,
            is_look_due: false,
        })
    }

    fn stop(&mut self, _: &mut Device) -> Result<()> {
        Ok(())
    }

    fn look(&mut self, device: &mut Device) -> Result<File> {
        let mut counts = vec![0u32; self.bins + OTHERS];
        device.read(&self.counts, 0, &mut counts)?;
        let result = self.result(&counts);
        Ok(File { bytes: self.table(&counts).into(), media_type: "text/csv", extension: "csv", result })
    }
}
