//! A view on the device: its buffers and the order of its passes.
//!
//! If somebody watches and it takes long, a preview comes first: every eighth pixel, or more of a small picture, at twice the step. The main passes
//! follow. After 1, 2, 4, 8, … of them the probe follows, which tells their error.

mod launch;
mod passes;

use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::context::DeviceContext;
use super::device_volume::{DeviceVolume, upload_table};
use super::distances::distances;
use super::gathered::{Gathered, Pass};
use super::layer::packets_of_beam;
use super::motion::{Motion, Moving};
use super::places::Places;
use super::probe::Steps;
use super::warnings::warnings;
use crate::device::structs::View as DeviceView;
use crate::device::{Buffer, Device, Resume, SliceLength};
use crate::error::Result;
use crate::render::Scene;
use crate::scene::bounds::Bounds;
use crate::scene::camera::flat_squared;
use crate::technique::{PreparedView, Random, ViewPlan};

/// The shortest step that `max_error` leads to, in voxels: the shortest that a request may ask for.
const LEAST_STEP_VOXELS: f64 = 0.05;
/// A picture is not shown before its first pass if that is likely to take less than this, ms.
const QUICK_MS: f64 = 50.0;

/// A view at work.
pub(super) struct ViewRun {
    scene: Scene,
    prepared: Arc<dyn PreparedView>,
    /// The box that it looks at, with its grid.
    bounds: Bounds,
    /// The volume that it reads, if it reads one.
    volume: Option<Rc<DeviceVolume>>,
    /// Its plan, with the present step.
    plan: ViewPlan,
    /// The distances of the macro-cells, if the kernel does not read their ranges.
    distances: Option<Rc<Buffer>>,
    parameters: Buffer,
    /// The probe's own parameters, if its rays alone go to their end.
    to_the_end: Option<Buffer>,
    view_buffer: Buffer,
    /// The camera and image, alone and with the pass under way.
    view: DeviceView,
    pass_view: DeviceView,
    pub gathered: Gathered,
    /// The time of a ray at the requested step, as last measured in motion, ms.
    ray_ms: Option<f64>,
    pass: Option<Pass>,
    cursor: usize,
    /// The work that launches leave undone, if they are bounded in steps.
    resume: Resume,
    /// The launch that has left work undone: its work-items, and its time so far.
    undone: Option<(usize, Duration)>,
    slice_length: SliceLength,
    /// True if the first pass is likely to be over before a preview could be seen.
    quick: bool,
    /// True if somebody watches.
    pub is_followed: bool,
    places: Places,
    pass_time: Duration,
    /// The shortest slice of the pass under way.
    shortest_slice: Duration,
    /// The longest way through the volume, world units.
    longest: f64,
    least_step: f32,
    random: Option<Random>,
    /// The device time since the start.
    pub device_time: Duration,
}

impl ViewRun {
    /// Begins a view whose kernels are built, in the memory of the samples `before`.
    pub fn new(
        context: &mut DeviceContext,
        scene: Scene,
        prepared: Arc<dyn PreparedView>,
        before: Option<Gathered>,
    ) -> Result<Self> {
        let mut plan = prepared.plan().clone();
        let (volume, distances) = match prepared.volume() {
            Some(volume) => {
                let on_device = context.volume(volume)?;
                let distances = distances(context, &on_device, volume, &mut plan)?;
                (Some(on_device), distances)
            }
            None => (None, None),
        };
        let bounds = prepared.volume().map_or(*scene.subject().bounds(), |volume| Bounds::from(&**volume));
        let places = Places::of_seed(scene.places());
        let view = device_view(&scene, &*prepared, &bounds, &places);
        let table = |device: &Device, step| table(device, volume.as_deref(), &scene, &*prepared, step);
        let to_the_end = prepared.parameters_to_the_end(scene.camera());
        let smallest = prepared.volume().map_or(bounds.smallest_side(), |volume| volume.smallest_side());
        let steps = Steps {
            step: plan.step,
            stepless: plan.stepless,
            smallest_side: smallest as f32,
            to_the_end: to_the_end.is_some(),
        };
        let gathered = Gathered::new(context, &scene, table, &plan, steps, before)?;
        let device = &context.device;
        let parameters = device.upload(&prepared.parameters(scene.camera()), 0)?;
        let to_the_end = to_the_end.map(|own| device.upload(&own, 0)).transpose()?;
        let view_buffer = device.allocate(size_of::<DeviceView>())?;
        let packets = if scene.view().random().is_some() { 1 } else { packets_of_beam(device.info().lanes as usize) };
        let resume = Resume::new(device, plan.state_words * packets)?;
        let (pass, cursor, device_time) = (None, 0, Duration::ZERO);
        let longest = 2.0 * bounds.radius();
        let speed = context.speed(&plan.variant);
        Ok(Self {
            slice_length: SliceLength::new(context.device.info(), longest / f64::from(plan.step), speed),
            quick: quick(speed, gathered.size),
            is_followed: false,
            places,
            pass_time: Duration::ZERO,
            shortest_slice: Duration::MAX,
            longest,
            least_step: (LEAST_STEP_VOXELS * smallest) as f32,
            random: scene.view().random(),
            plan,
            scene,
            prepared,
            bounds,
            volume,
            distances,
            parameters,
            to_the_end,
            view_buffer,
            view,
            pass_view: view,
            gathered,
            ray_ms: None,
            pass,
            cursor,
            resume,
            undone: None,
            device_time,
        })
    }

    /// Starts over with another camera, since all samples are of the old one.
    pub fn restart(&mut self, context: &mut DeviceContext, scene: &Scene) -> Result<()> {
        self.scene = scene.clone();
        self.places = Places::of_seed(scene.places());
        self.view = device_view(scene, &*self.prepared, &self.bounds, &self.places);
        context.device.write(&mut self.parameters, 0, &self.prepared.parameters(scene.camera()))?;
        if let (Some(buffer), Some(own)) = (&mut self.to_the_end, self.prepared.parameters_to_the_end(scene.camera())) {
            context.device.write(buffer, 0, &own)?;
        }
        let speed = context.speed(&self.plan.variant);
        self.slice_length = SliceLength::new(context.device.info(), self.longest / f64::from(self.plan.step), speed);
        self.quick = quick(speed, self.gathered.size);
        self.gathered.restart(context)?;
        (self.pass, self.cursor, self.undone, self.device_time) = (None, 0, None, Duration::ZERO);
        Ok(())
    }

    /// The samples per pixel of the main passes.
    pub fn samples(&self) -> u32 {
        self.gathered.samples()
    }

    /// True if no pass is under way, so that all pixels have the number of samples that it says.
    pub fn is_between_passes(&self) -> bool {
        self.pass.is_none()
    }

    /// True if a preview is not worth showing.
    pub fn is_quick(&self) -> bool {
        self.quick
    }

    /// True if half the step is still one that a request may ask for.
    pub fn can_halve_step(&self) -> bool {
        self.plan.step >= 2.0 * self.least_step
    }

    /// Starts over with half the step, since the samples have the error of the longer one.
    pub fn halve_step(&mut self, context: &DeviceContext) -> Result<()> {
        self.plan.step *= 0.5;
        let Self { plan, volume, scene, prepared, gathered, .. } = self;
        gathered.moving = None;
        gathered.will_change();
        self.slice_length = SliceLength::new(context.device.info(), self.longest / f64::from(plan.step), None);
        let mut table = |step| table(&context.device, volume.as_deref(), scene, &**prepared, step);
        for (layer, step) in gathered.layers.iter_mut().zip([2.0 * plan.step, plan.step]) {
            (layer.samples, layer.step, layer.table) = (0, step, table(step)?);
        }
        gathered.probe.iter_mut().try_for_each(|probe| probe.set_step(plan.step, &mut table))?;
        gathered.rounds.forget();
        (self.pass, self.cursor, self.undone) = (None, 0, None);
        Ok(())
    }

    pub fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// True if its samples are random.
    pub fn is_random(&self) -> bool {
        self.random.is_some()
    }

    /// The warnings about the volume and the parameters on it.
    pub fn warnings(&self) -> Vec<Value> {
        warnings(&self.scene, &*self.prepared, &self.bounds)
    }

    /// Prepares for a moving camera. If the whole picture would be late, the first frame is reduced where that loses the least.
    pub fn hurry(&mut self, context: &DeviceContext, motion: &mut Motion) -> Result<()> {
        let rays = (self.gathered.size[0] * self.gathered.size[1]) as f64;
        let ray_ms = self.ray_ms.or_else(|| context.speed(&self.plan.variant).map(f64::recip));
        let known = ray_ms.map(|ray_ms| motion.least(rays, ray_ms, self.plan.stepless, self.scene.camera()));
        let (lowered, losses) = known.unwrap_or_default();
        let step = self.plan.step;
        self.gathered.will_change();
        let before = self.gathered.moving.take();
        if !lowered.is_none() {
            let step_now = lowered.step * step;
            let table = table(&context.device, self.volume.as_deref(), &self.scene, &*self.prepared, step_now)?;
            self.gathered.moving = Some(Moving::new(context, &self.scene, table, step, lowered, losses, before)?);
        }
        Ok(())
    }

    /// True if there is a picture that was reduced to be in time.
    pub fn has_hurried(&self) -> bool {
        self.gathered.moving.as_ref().is_some_and(|m| m.layer.samples > 0)
    }
}

/// The part of the device's view that all passes share.
fn device_view(scene: &Scene, prepared: &dyn PreparedView, bounds: &Bounds, places: &Places) -> DeviceView {
    let mut view = scene.camera().device_view(scene.image(), scene.region().left_top, bounds);
    view.full_width = scene.image()[0] as i32;
    view.seed = [scene.seed() as u32, (scene.seed() >> 32) as u32];
    view.flat_squared = prepared.volume().map_or(0.0, |volume| flat_squared(volume));
    scene.clip().apply(bounds, &mut view);
    places.apply(&mut view);
    prepared.set_shared(scene.camera(), &mut view);
    view
}

/// A view's table for a step. The volume keeps it if there is one.
fn table(
    device: &Device,
    volume: Option<&DeviceVolume>,
    scene: &Scene,
    prepared: &dyn PreparedView,
    step: f32,
) -> Result<Rc<Buffer>> {
    match volume {
        Some(volume) => volume.table(device, scene.own(), prepared, step),
        None => upload_table(device, prepared, step),
    }
}

fn quick(speed: Option<f64>, [width, height]: [usize; 2]) -> bool {
    speed.is_some_and(|per_ms| (width * height) as f64 / per_ms < QUICK_MS)
}
