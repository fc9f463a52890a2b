//! The amount of work that fits in a slice. It is learnt per run: the same kernel is fast on one scene and slow on another.

use std::time::Duration;

use super::DeviceInfo;

/// Rays or histories per millisecond at the start of a run: every device here achieves this.
const START_PER_MS: f64 = 50.0;
/// Samples along rays per millisecond and compute unit that a slow kernel achieves. It bounds a slice by its longest rays.
const SAMPLES_PER_MS_PER_UNIT: f64 = 5e4;
/// The approximate most time of a slice if every ray in it is as long as the longest.
const WORST_MS: f64 = 100.0;

/// The factor by which a slice may be longer if the kernel's speed is known.
const KNOWN: f64 = 4.0;

/// The speed of one run.
#[derive(Debug, Clone, Copy)]
pub struct SliceLength {
    per_ms: f64,
    slowest: f64,
    most: usize,
}

impl SliceLength {
    /// A run whose rays have at most `steps` steps each (1 if there are none). `speed` is the kernel's recent speed in rays per millisecond. The run
    /// starts with half of it, since that may have been an easier scene.
    pub fn new(info: &DeviceInfo, steps: f64, speed: Option<f64>) -> Self {
        let slow = WORST_MS * SAMPLES_PER_MS_PER_UNIT * f64::from(info.compute_units) / steps.max(1.0);
        // A kernel that was not slow so far may take more, if its rays are no worse than those of the picture before.
        let shown = speed.map_or(0.0, |per_ms| WORST_MS * per_ms).min(KNOWN * slow);
        let per_ms = (0.5 * speed.unwrap_or(0.0)).max(START_PER_MS);
        Self { per_ms, slowest: f64::INFINITY, most: slow.max(shown) as usize }
    }

    /// Work-items, of `width` rays or histories each, for about `slice`: whole work-groups, so that the next slice starts at the end of this one.
    pub fn items(&self, info: &DeviceInfo, slice: Duration, width: usize) -> usize {
        let wanted = ((self.per_ms * slice.as_secs_f64() * 1e3) as usize).min(self.most);
        (wanted / width).div_ceil(info.local_size).max(1) * info.local_size
    }

    /// Learns from a launch. The speed rises at most fourfold at a time and stays within four times the slowest recent one: the next rows of a
    /// picture may be as dense as the densest before. A slow launch is forgotten by half again each time, since another program may have caused it. A
    /// launch of less than a millisecond measures the launching instead of the work.
    pub fn learn(&mut self, items: usize, width: usize, took: Duration) {
        let now = (items * width) as f64 / (took.as_secs_f64() * 1e3).max(1e-3);
        if took >= Duration::from_millis(1) {
            self.slowest = now.min(1.5 * self.slowest);
        }
        self.per_ms = now.min(4.0 * self.per_ms).min(4.0 * self.slowest);
    }
}
