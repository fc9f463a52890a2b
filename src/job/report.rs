//! The report of a job: state, times, counts, trace, the latest frame.

use std::sync::Arc;

use serde::Serialize;

use crate::film::{ErrorEstimate, LEAST_STATED, Lowered};
use crate::power_law::PowerLaw;
use crate::technique::Progress;

/// The state of a render.
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
    /// It failed; the resource has the reason.
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
    /// The milliseconds since the render or its newest camera was asked for.
    pub elapsed_ms: f64,
    /// The samples per pixel of this frame.
    pub samples: u32,
    /// The error of this frame; null if it is not known yet.
    pub error: Option<f64>,
    /// The pixels along a side that a sample of this frame stands for.
    pub stride: u32,
}

/// The times of a render, in milliseconds since it or its newest camera was asked for.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Timings {
    /// The time until its first slice.
    pub queued_ms: Option<f64>,
    /// The time until its first frame.
    pub first_frame_ms: Option<f64>,
    /// The time that the device worked for it.
    pub device_ms: f64,
    /// The time until its newest frame.
    pub elapsed_ms: f64,
}

/// The counts of faults that must never be silent.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Counts {
    /// The samples that were not finite. Each was taken as black.
    pub non_finite_samples: u64,
    /// The pixels with a sample that was not finite. Their error is not known (`standard_error` of the EXR is NaN there).
    pub non_finite_pixels: u64,
    /// The voxels of the volume that are not finite. They are rendered as empty.
    pub non_finite_voxels: u64,
    /// The samples that brought more than twice the light of all earlier ones of their pixel, from its 17th sample on.
    pub fireflies: u64,
    /// The samples that were scaled down to `clamp_luminance`.
    pub clamped_samples: u64,
    /// The part of the picture's light that clamping took away.
    pub clamped_energy: f64,
    /// The collisions at which a majorant was below the extinction.
    pub broken_majorants: u64,
    /// The paths that were cut off after a million collisions.
    pub cut_paths: u64,
    /// The channel values above 1 that the newest frame's PNG clips. The EXR has them.
    pub clipped_values: u64,
}

/// The state of a job and its latest frame, for its watchers.
#[derive(Debug, Clone)]
pub struct Update {
    /// The present state.
    pub state: State,
    /// The latest frame, if there is one.
    pub frame: Option<Arc<Frame>>,
    /// The progress of an export.
    pub work: Option<Progress>,
    /// True once the file of an export is there to be kept.
    pub is_handed_over: bool,
}

impl Update {
    /// The number of the newest result, which rises: the frame's number, or the amount of an export that is done.
    pub fn sequence(&self) -> u64 {
        let of_work = self.work.map(|work| work.done);
        self.frame.as_ref().map(|frame| frame.sequence).or(of_work).unwrap_or(0)
    }
}

/// One encoded frame with its numbers.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The number of the frame among the render's, from 1. It is also the id of its event.
    pub sequence: u64,
    /// The PNG bytes.
    pub png: bytes::Bytes,
    /// The samples per pixel.
    pub samples: u32,
    /// The error and its parts.
    pub error: ErrorEstimate,
    /// The quality that was reduced so that the frame came in time.
    pub lowered: Lowered,
    /// The milliseconds since the render (or its newest camera) was asked for.
    pub elapsed_ms: f64,
    /// The milliseconds of device time so far.
    pub device_ms: f64,
    /// True if no better frame will follow.
    pub is_final: bool,
    /// The strong entity tag: the hash of the bytes, which hold nothing that depends on load or time.
    pub etag: String,
}

/// The power of the number of samples with which the error falls: −½ for noise. It is the least-squares slope of the logarithms over the frames of
/// whole passes with two samples or more; `None` for fewer than three of them.
pub(super) fn slope(trace: &[TracePoint]) -> Option<f64> {
    let points: Vec<(f64, f64)> = trace
        .iter()
        .filter(|p| p.stride == 1 && p.samples >= 2)
        .filter_map(|p| Some((f64::from(p.samples), p.error.filter(|error| *error > LEAST_STATED)?)))
        .collect();
    PowerLaw::through(&points).map(|l| l.power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_noise_is_a_half() {
        let point =
            |samples: u32, error: f64, stride: u32| TracePoint { elapsed_ms: 0.0, samples, error: Some(error), stride };
        let noise: Vec<TracePoint> = [2, 4, 9, 16].map(|n| point(n, 3.0 / f64::from(n).sqrt(), 1)).to_vec();
        assert!((slope(&noise).unwrap_or(0.0) + 0.5).abs() < 1e-12);
        assert_eq!(slope(&noise[..2]), None);
        let previews = [point(1, 5.0, 8), point(2, 1.0, 1), point(3, 1.0, 1)];
        assert_eq!(slope(&previews), None);
    }
}
