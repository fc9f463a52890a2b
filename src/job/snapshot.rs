//! The snapshot of a render that the device thread leaves for the encoder.

use std::sync::Arc;
use std::time::Instant;

use serde_json::Value;

use super::report::Counts;
use crate::film::Film;

/// A snapshot that an executor leaves for the encoder of a job's frames.
pub(crate) struct Snapshot {
    /// The film with its sums, without its pixels.
    pub film: Arc<Film>,
    /// The picture in sRGB bytes.
    pub picture: Vec<u8>,
    pub generation: u64,
    /// True if it is the first snapshot of its camera.
    pub is_first: bool,
    /// The time at which it was made.
    pub made: Instant,
    pub elapsed_ms: f64,
    pub device_ms: f64,
    pub counts: SampleCounts,
    pub result: Option<Value>,
    /// The bound that stopped the render, on the final snapshot.
    pub stopped_by: Option<&'static str>,
}

/// The kernels' counts of a picture's samples, in their order (`kernels/shared/film.h`, `kernels/shared/flight.h`).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SampleCounts {
    pub non_finite: u32,
    pub fireflies: u32,
    pub clamped: u32,
    pub broken: u32,
    /// The sum of luminance that was taken away.
    pub clamped_luminance: f64,
    pub cut: u32,
}

impl SampleCounts {
    /// Puts the counts into a job's report.
    pub fn report(&self, film: &Film, counts: &mut Counts) {
        counts.clipped_values = film.sums.clipped;
        counts.non_finite_samples = self.non_finite.into();
        counts.non_finite_pixels = film.sums.unknown;
        counts.fireflies = self.fireflies.into();
        counts.clamped_samples = self.clamped.into();
        let cut = self.clamped_luminance;
        counts.clamped_energy = if cut > 0.0 { cut / (film.sums.weighted + cut) } else { 0.0 };
        counts.broken_majorants = self.broken.into();
        counts.cut_paths = self.cut.into();
    }
}
