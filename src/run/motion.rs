//! The picture while the camera moves. Its quality is reduced so that frames keep coming.

use std::rc::Rc;

use super::context::DeviceContext;
use super::layer::Layer;
use crate::device::Buffer;
use crate::error::Result;
use crate::film::{FieldError, Film, Lowered, Reduced};
use crate::render::Scene;
use crate::scene::camera::Camera;

/// The time of a frame in a smooth motion, ms: the rate of most screens, with room for delays. It applies if it loses no more than [`MOST_LOSS`].
const SMOOTH_MS: f64 = 16.0;
/// The time of a frame in any other motion, ms: about 30 frames per second.
const STEADY_MS: f64 = 32.0;
/// The device's part of a frame's time, ms: the first value, the least and the greatest.
const SMOOTH_DEVICE_MS: [f64; 3] = [13.0, 2.0, 14.0];
const STEADY_DEVICE_MS: [f64; 3] = [25.0, 5.0, 29.0];
/// The greatest relative loss of a smooth motion.
const MOST_LOSS: f64 = 0.09;
/// The factors by which the device's part may change between frames: it falls at once and rises slowly, so that pictures do not change to and fro.
const CHANGE: [f64; 2] = [0.9, 1.03];
/// The greatest stride of a moving picture: the pixels along a side that a sample stands for.
const MOST_STRIDE: u32 = 16;
/// The steps that are tried, relative to the requested one.
const STEPS: [f32; 3] = [1.0, 2.0, 4.0];

/// The factor by which losses may be larger from a camera that sees something else.
const FAR: f64 = 2.0;

/// The random stream of moving pictures. The passes at rest have others.
const STREAM: u32 = 2;

/// The time of a frame, and the device's part of it. The rest is for the encoder and for other work on the machine.
struct Deadline {
    frame_ms: f64,
    device_ms: f64,
    least: f64,
    most: f64,
}

impl Deadline {
    fn new(frame_ms: f64, [device_ms, least, most]: [f64; 3]) -> Self {
        Self { frame_ms, device_ms, least, most }
    }

    /// Raises the device's part after a frame that did not try this deadline: a busy neighbour may have gone.
    fn forget(&mut self) {
        self.device_ms = (self.device_ms * CHANGE[1]).min(self.most);
    }

    /// Learns from the time of the last frame.
    fn learn(&mut self, took_ms: f64) {
        let change = (self.frame_ms / took_ms.max(1.0)).clamp(CHANGE[0], CHANGE[1]);
        self.device_ms = (self.device_ms * change).clamp(self.least, self.most);
    }
}

/// The deadlines and losses that are known while a camera moves.
pub(super) struct Motion {
    smooth: Deadline,
    steady: Deadline,
    /// True if the last frame was to be smooth.
    is_smooth: bool,
    /// The losses, and the camera that showed them.
    losses: Option<(Losses, Camera)>,
    /// The error that a field causes, as a picture of it has shown.
    pub field_error: Option<FieldError>,
}

impl Motion {
    pub fn new() -> Self {
        Self {
            smooth: Deadline::new(SMOOTH_MS, SMOOTH_DEVICE_MS),
            steady: Deadline::new(STEADY_MS, STEADY_DEVICE_MS),
            is_smooth: true,
            losses: None,
            field_error: None,
        }
    }

    /// Learns from the time of the first frame of the camera before.
    pub fn learn(&mut self, frame_ms: f64) {
        if self.is_smooth {
            self.smooth.learn(frame_ms);
        } else {
            self.steady.learn(frame_ms);
            self.smooth.forget();
        }
    }

    /// Learns the losses from a picture of a single sample per pixel. With more samples, the places within steps would average out the step's loss.
    pub fn see(&mut self, film: &Film, camera: &Camera) {
        self.losses = Losses::of(film).map(|losses| (losses, *camera)).or(self.losses);
    }

    /// The reduction of a picture of `rays` rays that take `ray_ms` each by a camera, and what is known of its error. It loses the least of all reductions
    /// that are in time; nothing is reduced if the whole picture is in time. Unknown losses are taken to be equal, and are not stated. If the losses are
    /// those of a camera that sees something else, they may be larger here.
    pub fn least(&mut self, rays: f64, ray_ms: f64, stepless: bool, camera: &Camera) -> (Lowered, Reduced) {
        let is_far = self.losses.is_some_and(|(_, of)| !of.is_near(camera));
        let lowered = self.lowered(rays, ray_ms, stepless);
        let losses = self.losses.map(|(losses, _)| losses);
        let margin = if is_far { FAR } else { 1.0 };
        let own = if stepless { Some(0.0) } else { losses.and_then(|losses| losses.own) };
        let longer = losses.map_or(0.0, |losses| losses.of_step(lowered.step));
        let noise = losses.and_then(|losses| losses.noise);
        (lowered, Reduced { step: own.map(|own| margin * (own + longer)), noise: noise.map(|noise| margin * noise) })
    }

    /// The reduction of a picture.
    fn lowered(&mut self, rays: f64, ray_ms: f64, stepless: bool) -> Lowered {
        self.is_smooth = true;
        if rays * ray_ms <= self.smooth.device_ms {
            return Lowered::default();
        }
        let unknown = Losses { resolution: 1.0, step: (!stepless).then_some(1.0), own: None, noise: None };
        let losses = self.losses.map_or(unknown, |(losses, _)| losses);
        let lowered = losses.least(rays, ray_ms, self.smooth.device_ms);
        self.is_smooth =
            losses.of_lowered(lowered) <= MOST_LOSS && rays * ray_ms * lowered.cost() <= self.smooth.device_ms;
        if self.is_smooth { lowered } else { losses.least(rays, ray_ms, self.steady.device_ms) }
    }
}

impl Lowered {
    /// The part of the time that is left, as measured on two scans with and without lighting. Rays that are farther apart have less in common, and
    /// a ray with longer steps keeps its fixed cost.
    fn cost(&self) -> f64 {
        f64::from(self.stride).powf(-1.4) * f64::from(self.step).powf(-0.7)
    }
}

/// The relative loss of each reduction, as the last picture at rest shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Losses {
    /// The loss of half the resolution.
    resolution: f64,
    /// The loss of twice the step; `None` if the step plays no part.
    step: Option<f64>,
    /// What the step itself costs, if it is known.
    own: Option<f64>,
    /// The noise of one sample per pixel as a multiple of the deviation within blocks of pixels, if it is known.
    noise: Option<f64>,
}

impl Losses {
    /// The losses that a whole picture of a single sample per pixel shows.
    fn of(film: &Film) -> Option<Self> {
        let is_whole = film.main.count == 1 && film.lowered.is_none();
        let (step, own) = (film.step_loss_seen(), film.error().discretisation);
        let losses = Self { resolution: film.resolution_loss(), step, own, noise: film.noise_in_blocks() };
        is_whole.then_some(losses)
    }

    /// The loss of a reduction. The loss of resolution is taken to come from edges, and grows with the stride.
    fn of_lowered(&self, lowered: Lowered) -> f64 {
        let pixels = self.resolution * f64::from(lowered.stride - 1);
        pixels.hypot(self.of_step(lowered.step))
    }

    /// The loss of a longer step alone: midpoints are of second order.
    fn of_step(&self, step: f32) -> f64 {
        self.step.unwrap_or(0.0) * (f64::from(step * step) - 1.0) / 3.0
    }

    /// The reduction with the least loss of all that are in time, for `rays` rays that take `ray_ms` each. It is none if none is needed.
    fn least(&self, rays: f64, ray_ms: f64, device_ms: f64) -> Lowered {
        let steps = if self.step.is_some() { &STEPS[..] } else { &STEPS[..1] };
        let all = (1..=MOST_STRIDE).flat_map(|stride| steps.iter().map(move |step| Lowered { stride, step: *step }));
        let cost = |l: &Lowered| rays * ray_ms * l.cost();
        let in_time = all.clone().filter(|l| cost(l) <= device_ms);
        let least = in_time.min_by(|a, b| self.of_lowered(*a).total_cmp(&self.of_lowered(*b)));
        least.or_else(|| all.min_by(|a, b| cost(a).total_cmp(&cost(b)))).unwrap_or_default()
    }
}

/// The first picture of a camera, if the whole picture would be late.
pub(super) struct Moving {
    pub layer: Layer,
    pub lowered: Lowered,
    pub losses: Reduced,
}

impl Moving {
    /// Room for it. The layer of the camera `before` is used again if it is the same, or its memory if that has the same size.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device has none.
    pub fn new(
        context: &DeviceContext,
        scene: &Scene,
        table: Rc<Buffer>,
        step: f32,
        lowered: Lowered,
        losses: Reduced,
        before: Option<Self>,
    ) -> Result<Self> {
        let layer = match before {
            Some(Self { mut layer, lowered: same, .. }) if same == lowered && layer.step == lowered.step * step => {
                layer.restart(&context.device)?;
                layer
            }
            _ => {
                let room = before.map(|b| b.layer.buffer);
                let (stride, step) = (lowered.stride as usize, lowered.step * step);
                let mut layer = Layer::new(&context.device, scene, table, stride, step, 1, room)?;
                layer.stream = STREAM;
                layer
            }
        };
        Ok(Self { layer, lowered, losses })
    }

    /// The time of a ray of the whole picture, if that has `rays` rays and a pass of this picture took `pass_ms`.
    pub fn ray_ms(&self, pass_ms: f64, rays: usize) -> f64 {
        pass_ms / rays as f64 / self.lowered.cost()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::request::CameraRequest;
    use crate::scene::bounds::Bounds;

    #[test]
    fn what_matters_least_is_lowered_and_no_more_than_need_be() {
        let losses = Losses { resolution: 0.02, step: Some(0.001), own: Some(0.0), noise: None };
        // 100 rays of 1 ms have 40 ms: a step of four times leaves 38 ms and loses 0.5 %.
        assert_eq!(losses.least(100.0, 1.0, 40.0), Lowered { stride: 1, step: 4.0 });
        assert_eq!(losses.least(100.0, 0.2, 30.0), Lowered { stride: 1, step: 1.0 });
        // Every second pixel loses 2 %, and a longer step 10 % and more.
        let rough = Losses { resolution: 0.02, step: Some(0.1), own: Some(0.0), noise: None };
        assert_eq!(rough.least(100.0, 1.0, 40.0), Lowered { stride: 2, step: 1.0 });
        let stepless = Losses { resolution: 0.02, step: None, own: Some(0.0), noise: None };
        assert_eq!(stepless.least(200.0, 1.0, 30.0), Lowered { stride: 4, step: 1.0 });
        // No reduction is in time, so the cheapest one is taken.
        assert_eq!(losses.least(1e9, 1.0, 30.0), Lowered { stride: MOST_STRIDE, step: 4.0 });
    }

    /// A camera that has turned by some degrees around a box.
    fn from(degrees: f64) -> Camera {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let request = CameraRequest { eye: Some([4.0 * sin, 0.0, 4.0 * cos]), ..CameraRequest::default() };
        let bounds = Bounds::of_corners(DVec3::splat(-1.0), DVec3::ONE);
        Camera::from_request(Some(&request), &bounds).expect("a camera")
    }

    /// A motion that knows its losses.
    fn motion(losses: Losses) -> Motion {
        Motion { losses: Some((losses, from(0.0))), ..Motion::new() }
    }

    #[test]
    fn frames_that_come_late_leave_the_device_less() {
        let mut motion = motion(Losses { resolution: 0.001, step: None, own: Some(0.0), noise: None });
        let first = motion.least(1e6, 1e-4, true, &from(0.0)).0;
        (0..5).for_each(|_| motion.learn(90.0));
        assert!(motion.least(1e6, 1e-4, true, &from(0.0)).0.stride > first.stride);
        (0..100).for_each(|_| motion.learn(5.0));
        assert!(motion.least(1e6, 1e-4, true, &from(0.0)).0.stride <= first.stride);
        assert!(motion.least(1e4, 1e-4, true, &from(0.0)).0.is_none(), "what is in time as it is stays as it is");
    }

    #[test]
    fn a_motion_is_smooth_where_little_is_lost_and_else_steady() {
        // 30 ms of rays have 13 ms: a step of four times is in time.
        let mut gentle = motion(Losses { resolution: 0.5, step: Some(0.01), own: Some(0.0), noise: None });
        let (lowered, losses) = gentle.least(3e5, 1e-4, false, &from(0.0));
        assert_eq!(lowered, Lowered { stride: 1, step: 4.0 });
        assert!((losses.step.unwrap_or(0.0) - 0.05).abs() < 1e-12);
        let far = gentle.least(3e5, 1e-4, false, &from(40.0));
        assert!(far.0 == lowered && far.1.step == losses.step.map(|step| 2.0 * step), "from far away it may be more");
        let nothing = Motion::new().least(3e5, 1e-4, false, &from(0.0));
        assert_eq!(nothing.1, Reduced::default(), "what is not known is not stated");
        assert!(gentle.is_smooth);
        // A step of twice would bring 20 ms of rays in time, but lose 20 %. So the whole picture is rendered, 30 times per second.
        let mut rough = motion(Losses { resolution: 0.5, step: Some(0.2), own: Some(0.0), noise: None });
        assert_eq!(
            rough.least(2e5, 1e-4, false, &from(0.0)),
            (Lowered::default(), Reduced { step: Some(0.0), noise: None })
        );
        assert!(!rough.is_smooth);
        // Unknown losses are not risked either.
        let mut unknown = Motion::new();
        assert_eq!(unknown.least(2e5, 1e-4, false, &from(0.0)).0, Lowered::default());
    }
}
