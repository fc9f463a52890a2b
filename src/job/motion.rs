//! A picture while the camera moves: what is lowered of it, so that frames keep coming.

use std::sync::Arc;

use super::context::DeviceContext;
use super::layer::Layer;
use crate::error::Result;
use crate::film::{ErrorEstimate, Film, Lowered};
use crate::scene::Scene;
use crate::volume::Volume;

/// From a camera to its first frame, for 20 frames a second and what the way to the client and back takes.
const FRAME_MS: f64 = 45.0;
/// What of that the device may have: at first, at least, at most.
const DEVICE_MS: [f64; 3] = [25.0, 5.0, 40.0];
/// How much that may change from one frame to the next.
const CHANGE: f64 = 1.25;
/// Pixels that a sample stands for along a side, at most.
const MOST_APART: u32 = 16;
/// Steps that are tried, of the one asked for.
const STEPS: [f32; 3] = [1.0, 2.0, 4.0];

/// Tells its random numbers from those of the passes at rest.
const STREAM: u32 = 2;

/// What is known while a camera moves.
pub(super) struct Motion {
    /// What a frame may take on the device, ms: what encoding leaves of it, and whoever else works here.
    device_ms: f64,
    /// The newest picture at rest, until what each part of it is worth is asked for.
    at_rest: Option<(Arc<Film>, ErrorEstimate)>,
    losses: Option<Losses>,
}

impl Motion {
    pub fn new() -> Self {
        Self { device_ms: DEVICE_MS[0], at_rest: None, losses: None }
    }

    /// Learns from the newest picture, and from the time until the first frame of the camera before how much there is for the device.
    pub fn learn(&mut self, seen: Option<(Arc<Film>, ErrorEstimate)>, first_frame_ms: Option<f64>) {
        self.at_rest = seen.filter(|(film, _)| film.lowered.is_none()).or(self.at_rest.take());
        if let Some(took) = first_frame_ms {
            let change = (FRAME_MS / took.max(1.0)).clamp(1.0 / CHANGE, CHANGE);
            self.device_ms = (self.device_ms * change).clamp(DEVICE_MS[1], DEVICE_MS[2]);
        }
    }

    /// What is lowered of a picture of so many rays that take `ray_ms` each, and what its longer step loses: what loses the least of all
    /// that is in time; nothing where the whole is. Of unknown losses all are alike.
    pub fn least(&mut self, rays: f64, ray_ms: f64, stepless: bool) -> (Lowered, f64) {
        if rays * ray_ms <= self.device_ms {
            return (Lowered::default(), 0.0);
        }
        self.losses = self.at_rest.take().map(|(film, error)| Losses::of(&film, &error)).or(self.losses);
        let unknown = Losses { resolution: 1.0, step: (!stepless).then_some(1.0) };
        let losses = self.losses.unwrap_or(unknown);
        let lowered = losses.least(rays, ray_ms, self.device_ms);
        (lowered, losses.of_step(lowered.step))
    }
}

/// What less of each would cost the picture, relative, as the last one at rest shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Losses {
    /// Half the resolution.
    resolution: f64,
    /// Twice the step; none where the step plays no part.
    step: Option<f64>,
}

impl Losses {
    /// Of a picture at rest.
    fn of(film: &Film, error: &ErrorEstimate) -> Self {
        Self { resolution: film.resolution_loss(), step: error.discretisation.filter(|_| !film.stepless) }
    }

    /// What is lost; a method of first order is assumed of the step, and edges of the pixels.
    fn of_lowered(&self, lowered: Lowered) -> f64 {
        let pixels = self.resolution * f64::from(lowered.apart - 1);
        pixels.hypot(self.of_step(lowered.step))
    }

    /// What a longer step alone loses.
    fn of_step(&self, step: f32) -> f64 {
        self.step.unwrap_or(0.0) * f64::from(step - 1.0)
    }

    /// What is lowered of a picture of so many rays that take `ray_ms` each: what loses least of all that is in time; nothing where nothing
    /// need be.
    fn least(&self, rays: f64, ray_ms: f64, device_ms: f64) -> Lowered {
        let steps = if self.step.is_some() { &STEPS[..] } else { &STEPS[..1] };
        let all = (1..=MOST_APART).flat_map(|apart| steps.iter().map(move |step| Lowered { apart, step: *step }));
        let cost = |l: &Lowered| rays * ray_ms / (f64::from(l.apart * l.apart) * f64::from(l.step));
        let in_time = all.clone().filter(|l| cost(l) <= device_ms);
        let least = in_time.min_by(|a, b| self.of_lowered(*a).total_cmp(&self.of_lowered(*b)));
        least.or_else(|| all.min_by(|a, b| cost(a).total_cmp(&cost(b)))).unwrap_or_default()
    }
}

/// The first picture of a camera, where all of it would be late.
pub(super) struct Moving {
    pub layer: Layer,
    pub lowered: Lowered,
    /// What its longer step loses, relative.
    pub step_loss: f64,
}

impl Moving {
    /// Room for it; that of the camera `before` where it is as large.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device has none.
    pub fn new(
        context: &DeviceContext,
        scene: &Scene,
        volume: &Volume,
        step: f32,
        lowered: Lowered,
        step_loss: f64,
        before: Option<Self>,
    ) -> Result<Self> {
        let layer = match before {
            Some(Self { mut layer, lowered: same, .. }) if same == lowered && layer.step == lowered.step * step => {
                layer.restart(&context.device)?;
                layer
            }
            _ => {
                let room = before.map(|b| b.layer.buffer);
                Layer::new(&context.device, scene, volume, lowered.apart as usize, STREAM, lowered.step * step, room)?
            }
        };
        Ok(Self { layer, lowered, step_loss })
    }

    /// What a ray of the step asked for takes, as a pass of `pass_ms` showed it.
    pub fn ray_ms(&self, pass_ms: f64) -> f64 {
        pass_ms / (self.layer.width * self.layer.height) as f64 * f64::from(self.lowered.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_matters_least_is_lowered_and_no_more_than_need_be() {
        let losses = Losses { resolution: 0.02, step: Some(0.001) };
        // 100 rays of a millisecond for 30: a step of four times is enough and loses 0.3 %.
        assert_eq!(losses.least(100.0, 1.0, 30.0), Lowered { apart: 1, step: 4.0 });
        assert_eq!(losses.least(100.0, 0.2, 30.0), Lowered { apart: 1, step: 1.0 });
        // 2 % of every second pixel against 10 % and more of a longer step.
        let rough = Losses { resolution: 0.02, step: Some(0.1) };
        assert_eq!(rough.least(100.0, 1.0, 30.0), Lowered { apart: 2, step: 1.0 });
        let stepless = Losses { resolution: 0.02, step: None };
        assert_eq!(stepless.least(2000.0, 1.0, 30.0), Lowered { apart: 9, step: 1.0 });
        // Nothing is in time: the cheapest that there is.
        assert_eq!(losses.least(1e9, 1.0, 30.0), Lowered { apart: MOST_APART, step: 4.0 });
    }

    #[test]
    fn frames_that_come_late_leave_the_device_less() {
        let mut motion = Motion::new();
        let first = motion.least(1e6, 1e-3, true).0;
        (0..5).for_each(|_| motion.learn(None, Some(90.0)));
        assert!(motion.least(1e6, 1e-3, true).0.apart > first.apart);
        (0..20).for_each(|_| motion.learn(None, Some(10.0)));
        assert!(motion.least(1e6, 1e-3, true).0.apart <= first.apart);
        assert!(motion.least(1e4, 1e-3, true).0.is_none(), "what is in time as it is stays as it is");
    }
}
