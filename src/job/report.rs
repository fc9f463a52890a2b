//! What a job says of itself: state, times, counts, trace, the latest frame.

use std::sync::Arc;

use serde::Serialize;

use crate::film::{ErrorEstimate, Lowered};
use crate::power_law::PowerLaw;
use crate::technique::Progress;

/// Where a render stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// It waits for its first slice.
    Queued,
    /// It takes turns on the device.
    Running,
    /// The final frame is there.
    Done,
    /// It was cancelled.
    Cancelled,
    /// It failed; the resource says why.
    Failed,
}

impl State {
    /// True if nothing more will come, unless a new camera sets a done render running again.
    pub fn is_terminal(self) -> bool {
        matches!(self, Self::Done | Self::Cancelled | Self::Failed)
    }
}

/// One point of the convergence trace.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TracePoint {
    /// Milliseconds since the render or its newest camera was asked for.
    pub elapsed_ms: f64,
    /// Samples per pixel of this frame.
    pub samples: u32,
    /// Its error.
    pub error: f64,
    /// Pixels a sample of this frame stands for, along a side.
    pub stride: u32,
}

/// Times of a render, in milliseconds since it or its newest camera was asked for.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Timings {
    /// Until its first slice.
    pub queued_ms: Option<f64>,
    /// Until its first frame.
    pub first_frame_ms: Option<f64>,
    /// Time the device worked for it.
    pub device_ms: f64,
    /// Until its newest frame.
    pub elapsed_ms: f64,
}

/// Counts of what must never be silent.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Counts {
    /// Samples that were not finite; each was taken as black.
    pub non_finite_samples: u64,
    /// Pixels of which a sample was not finite: their error is not known (`standard_error` of the EXR is no number there).
    pub non_finite_pixels: u64,
    /// Voxels of the volume that are not finite; they are rendered as empty.
    pub non_finite_voxels: u64,
    /// Samples that brought more than twice the light of all that their pixel had before, from its 17th sample on.
    pub fireflies: u64,
    /// Samples that were scaled down to `clamp_luminance`,
    pub clamped_samples: u64,
    /// and the part of the picture's light that this took away.
    pub clamped_energy: f64,
    /// Collisions at which a majorant was below the extinction.
    pub broken_majorants: u64,
    /// Paths that were cut off after a million collisions.
    pub cut_paths: u64,
    /// Channel values above 1 that the newest frame's PNG clips (the EXR has them).
    pub clipped_values: u64,
}

/// What the watchers of a job see: its state and its latest frame.
#[derive(Debug, Clone)]
pub struct Update {
    /// Where it stands.
    pub state: State,
    /// The latest frame, if there is one.
    pub frame: Option<Arc<Frame>>,
    /// How much of an export is done.
    pub work: Option<Progress>,
}

impl Update {
    /// The number of what there is to show, which rises: of the frame, or how much of an export is done.
    pub fn sequence(&self) -> u64 {
        let of_work = self.work.map(|work| work.done);
        self.frame.as_ref().map(|frame| frame.sequence).or(of_work).unwrap_or(0)
    }
}

/// One encoded frame and what it says of itself.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Counts the render's frames from 1; also the id of its event.
    pub sequence: u64,
    /// PNG bytes.
    pub png: bytes::Bytes,
    /// Samples per pixel.
    pub samples: u32,
    /// The error and its parts.
    pub error: ErrorEstimate,
    /// What it has less of than was asked for, so that it came in time.
    pub lowered: Lowered,
    /// Milliseconds since the render (or its newest camera) was asked for.
    pub elapsed_ms: f64,
    /// Milliseconds of device time so far.
    pub device_ms: f64,
    /// True if no better frame will follow.
    pub is_final: bool,
    /// Strong entity tag: the hash of the bytes, which hold nothing that depends on load or time.
    pub etag: String,
}

/// The power of the number of samples with which the error falls: −½ for noise. The least-squares slope of the logarithms over the
/// frames of whole passes with two samples or more; none of fewer than three.
pub(super) fn slope(trace: &[TracePoint]) -> Option<f64> {
    let points: Vec<(f64, f64)> = trace
        .iter()
        .filter(|p| p.stride == 1 && p.samples >= 2 && p.error > 0.0)
        .map(|p| (f64::from(p.samples), p.error))
        .collect();
    PowerLaw::through(&points).map(|l| l.power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_noise_is_a_half() {
        let point = |samples: u32, error: f64, stride: u32| TracePoint { elapsed_ms: 0.0, samples, error, stride };
        let noise: Vec<TracePoint> = [2, 4, 9, 16].map(|n| point(n, 3.0 / f64::from(n).sqrt(), 1)).to_vec();
        assert!((slope(&noise).unwrap_or(0.0) + 0.5).abs() < 1e-12);
        assert_eq!(slope(&noise[..2]), None);
        let previews = [point(1, 5.0, 8), point(2, 1.0, 1), point(3, 1.0, 1)];
        assert_eq!(slope(&previews), None);
    }
}
