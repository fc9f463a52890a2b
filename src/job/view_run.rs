//! A view on the device: its buffers and the order of its passes.
//!
//! First the control: every eighth pixel, more of a small picture, at twice the step, which is also the first picture. The passes
//! proper follow, and the control gets another sample each time their number has doubled, so that it always costs little and knows
//! enough; where nothing but the step tells the two apart, it gets one for each.

use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use super::SampleCounts;
use super::context::{DeviceContext, DeviceVolume};
use super::distances::distances;
use super::layer::Layer;
use super::motion::{Motion, Moving};
use super::pace::Pace;
use super::places::place_in_pixel;
use super::rounds::Rounds;
use crate::device::Buffer;
use crate::device::structs::View as DeviceView;
use crate::error::Result;
use crate::film::{Film, Lowered};
use crate::scene::{self, Scene};
use crate::technique::{Random, ViewPlan};
use crate::volume::Volume;

/// The shortest step that `max_error` leads to, in voxels: the shortest that a request may ask for.
const LEAST_STEP_VOXELS: f64 = 0.05;
/// A picture is not shown before its first pass where that is likely to take less than this.
const QUICK_MS: f64 = 50.0;
/// Stride of the control by the picture's shorter side: from 400 on, from 200 on, below. A thousand pixels and more tell the error.
const CONTROL: [usize; 3] = [8, 4, 2];

/// Which layer a pass goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    Control,
    Main,
    /// A picture that is in time while the camera moves.
    Moving,
}

/// A view at work.
pub(super) struct ViewRun {
    plan: ViewPlan,
    volume: Rc<DeviceVolume>,
    /// What the kernel is told of the cells, where that is not their ranges.
    distances: Option<Rc<Buffer>>,
    parameters: Buffer,
    view_buffer: Buffer,
    counts: Buffer,
    /// The camera and image, and the same with the pass under way.
    view: DeviceView,
    pass_view: DeviceView,
    size: [usize; 2],
    layers: [Layer; 2],
    moving: Option<Moving>,
    /// What a ray of the step asked for takes, where it was last seen in motion, ms.
    ray_ms: Option<f64>,
    pass: Option<Pass>,
    cursor: usize,
    pace: Pace,
    /// Whether the first pass is likely to be over before a picture of the control could be seen.
    quick: bool,
    pass_time: Duration,
    /// The longest way through the volume, world units.
    longest: f64,
    least_step: f32,
    random: Option<Random>,
    rounds: Rounds,
    /// Device time since the start.
    pub device_time: Duration,
}

impl ViewRun {
    /// Begins what `plan` says, whose kernel is built.
    pub fn new(context: &mut DeviceContext, scene: &Scene, volume: &Arc<Volume>, mut plan: ViewPlan) -> Result<Self> {
        let on_device = context.volume(volume)?;
        let distances = distances(context, &on_device, volume, &mut plan)?;
        let region = scene.region();
        let size = region.size.map(|n| n.div_ceil(region.apart) as usize);
        let device = &context.device;
        let sparse = match size[0].min(size[1]) {
            400.. => CONTROL[0],
            200.. => CONTROL[1],
            _ => CONTROL[2],
        };
        let layers = [
            Layer::new(device, scene, volume, sparse, 1, 2.0 * plan.step)?,
            Layer::new(device, scene, volume, 1, 0, plan.step)?,
        ];
        let parameters = device.upload(&scene.view().parameters(volume, scene.camera())?, 0)?;
        let view = Self::view(scene, volume);
        let view_buffer = device.allocate(size_of::<DeviceView>())?;
        let counts = device.upload(&[0; 32], 0)?;
        let (pass, cursor, device_time) = (None, 0, Duration::ZERO);
        let longest = 2.0 * scene::radius(volume);
        let speed = context.speed(&plan.variant);
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        Ok(Self {
            pace: Pace::new(context.device.info(), longest / f64::from(plan.step), speed),
            quick: quick(speed, size),
            pass_time: Duration::ZERO,
            longest,
            least_step: (LEAST_STEP_VOXELS * smallest) as f32,
            random: scene.view().random(),
            rounds: Rounds::new(scene.is_pilot()),
            plan,
            volume: on_device,
            distances,
            parameters,
            view_buffer,
            counts,
            view,
            pass_view: view,
            size,
            layers,
            moving: None,
            ray_ms: None,
            pass,
            cursor,
            device_time,
        })
    }

    /// What all passes are told.
    fn view(scene: &Scene, volume: &Volume) -> DeviceView {
        let mut view = scene.camera().device_view(scene.image(), scene.region().left_top, volume);
        view.full_width = scene.image()[0] as i32;
        view.seed = [scene.seed() as u32, (scene.seed() >> 32) as u32];
        scene.clip().apply(volume, &mut view);
        scene.view().look(scene.camera(), &mut view);
        view
    }

    /// Another camera: everything gathered so far is of the old one.
    pub fn restart(&mut self, context: &mut DeviceContext, scene: &Scene, volume: &Volume) -> Result<()> {
        self.view = Self::view(scene, volume);
        context.device.write(&mut self.parameters, 0, &scene.view().parameters(volume, scene.camera())?)?;
        context.device.write(&mut self.counts, 0, &[0; 32])?;
        let speed = context.speed(&self.plan.variant);
        self.pace = Pace::new(context.device.info(), self.longest / f64::from(self.plan.step), speed);
        self.quick = quick(speed, self.size);
        for layer in &mut self.layers {
            layer.restart(&context.device)?;
        }
        (self.pass, self.cursor, self.device_time) = (None, 0, Duration::ZERO);
        self.rounds.forget();
        Ok(())
    }

    /// Samples per pixel of the passes proper.
    pub fn samples(&self) -> u32 {
        self.layers[1].samples
    }

    /// Whether a picture of the control is not worth showing.
    pub fn is_quick(&self) -> bool {
        self.quick
    }

    /// Whether the step is still longer than what a request may ask for.
    pub fn can_halve_step(&self) -> bool {
        self.plan.step >= 2.0 * self.least_step
    }

    /// Starts over with half the step: what was gathered has the error of the longer one. The passes proper of the longer step
    /// would make a good control, but for their number; a fresh one costs an eighth of a pass.
    pub fn halve_step(&mut self, context: &DeviceContext, scene: &Scene, volume: &Volume) -> Result<()> {
        self.plan.step *= 0.5;
        self.moving = None;
        self.pace = Pace::new(context.device.info(), self.longest / f64::from(self.plan.step), None);
        for (layer, step) in self.layers.iter_mut().zip([2.0 * self.plan.step, self.plan.step]) {
            (layer.samples, layer.step) = (0, step);
            let table = scene.view().table(volume, step)?;
            context.device.write(&mut layer.table, 0, bytemuck::cast_slice(&table))?;
        }
        (self.pass, self.cursor) = (None, 0);
        self.rounds.forget();
        Ok(())
    }

    pub fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    /// Whether a sample of the control differs from the one of its number in the passes proper by its step alone.
    fn paired(&self) -> bool {
        self.view.jittered == 0
    }

    fn layer(&self, pass: Pass) -> &Layer {
        match (pass, &self.moving) {
            (Pass::Moving, Some(moving)) => &moving.layer,
            (Pass::Control, _) => &self.layers[0],
            _ => &self.layers[1],
        }
    }

    fn layer_mut(&mut self, pass: Pass) -> &mut Layer {
        match (pass, &mut self.moving) {
            (Pass::Moving, Some(moving)) => &mut moving.layer,
            (Pass::Control, _) => &mut self.layers[0],
            _ => &mut self.layers[1],
        }
    }

    /// The camera moves: where all of the picture would be late, what loses the least is lowered in the first frame.
    pub fn hurry(
        &mut self,
        context: &DeviceContext,
        scene: &Scene,
        volume: &Volume,
        motion: &mut Motion,
    ) -> Result<()> {
        let rays = (self.size[0] * self.size[1]) as f64;
        let ray_ms = self.ray_ms.or_else(|| context.speed(&self.plan.variant).map(f64::recip));
        let known = ray_ms.map(|ray_ms| motion.least(rays, ray_ms, self.plan.stepless));
        let (lowered, step_loss) = known.unwrap_or_default();
        let step = self.plan.step;
        let before = self.moving.take();
        if !lowered.is_none() {
            self.moving = Some(Moving::new(context, scene, volume, step, lowered, step_loss, before)?);
        }
        Ok(())
    }

    /// Whether a picture is there that was made to be in time.
    pub fn has_hurried(&self) -> bool {
        self.moving.as_ref().is_some_and(|m| m.layer.samples > 0)
    }

    fn next_pass(&self) -> Pass {
        if self.moving.as_ref().is_some_and(|m| m.layer.samples == 0) && self.samples() == 0 {
            return Pass::Moving;
        }
        let [control, main] = &self.layers;
        let owed = match main.samples {
            // The first picture; there is nothing to control.
            _ if self.plan.stepless => 1,
            // Paired with the passes proper: only so does noise not pass for the step's doing, nor hide it.
            n if self.paired() => n + 1,
            0 | 1 => 1,
            n => 1 + n.ilog2(),
        };
        if control.samples < owed { Pass::Control } else { Pass::Main }
    }

    /// Works for about `slice` and says which pass it finished, if one.
    pub fn slice(&mut self, context: &mut DeviceContext, slice: Duration) -> Result<Option<Pass>> {
        let pass = match self.pass {
            Some(pass) => pass,
            None => self.begin(context)?,
        };
        let layer = self.layer(pass);
        let (beams, rays) = layer.items(context.device.info().lanes as usize);
        let items = self.pace.items(context.device.info(), slice, rays).min(beams - self.cursor);
        self.pass_view.first_beam = self.cursor as i32;
        context.device.write(&mut self.view_buffer, 0, bytemuck::bytes_of(&self.pass_view))?;
        let layer = self.layer(pass);
        let mut arguments = vec![
            &self.view_buffer,
            &self.parameters,
            &self.volume.voxels,
            self.distances.as_deref().unwrap_or(&self.volume.cells.ranges),
            &layer.table,
            &layer.buffer,
            &self.counts,
        ];
        arguments.extend(layer.tiles());
        let took = context.device.run(&self.plan.variant, &arguments, items)?;
        self.pace.learn(items, rays, took);
        self.device_time += took;
        self.pass_time += took;
        self.cursor += items;
        if self.cursor < beams {
            return Ok(None);
        }
        if let (Pass::Moving, Some(moving)) = (pass, &self.moving) {
            self.ray_ms = Some(moving.ray_ms(self.pass_time.as_secs_f64() * 1e3));
        }
        if pass == Pass::Main {
            self.ray_ms = None;
            context.measured(&self.plan.variant, self.size[0] * self.size[1], self.pass_time);
        }
        self.layer_mut(pass).passed();
        (self.pass, self.cursor) = (None, 0);
        // Samples that were put where the error is have no halves.
        if pass == Pass::Main && !self.random.is_some_and(|r| r.adaptive) {
            self.rounds.passed(context, &self.layers[1], self.device_time)?;
        }
        Ok(Some(pass))
    }

    /// Chooses the next pass.
    fn begin(&mut self, context: &DeviceContext) -> Result<Pass> {
        let pass = self.next_pass();
        let adaptive = pass == Pass::Main && self.random.is_some_and(|r| r.adaptive);
        self.layer_mut(pass).choose_tiles(context, adaptive)?;
        if pass == Pass::Main && self.samples() == 0 {
            // What is counted is of the picture, not of its preview.
            context.device.write(&mut self.counts, 0, &[0; 32])?;
        }
        let layer = self.layer(pass);
        let view = DeviceView {
            width: layer.width as i32,
            height: layer.height as i32,
            stride: layer.apart as i32,
            sample: layer.samples as i32,
            stream: layer.stream,
            offset: place_in_pixel(layer.samples).to_array(),
            step: layer.step,
            ..self.view
        };
        self.pass_view = view;
        self.pass = Some(pass);
        self.pass_time = Duration::ZERO;
        Ok(pass)
    }

    /// Reads what there is to see: the passes proper, or before the first of them the control.
    pub fn film(&self, context: &DeviceContext) -> Result<Film> {
        let [control, main] = &self.layers;
        let moving = self.moving.as_ref().filter(|m| main.samples == 0 && m.layer.samples > 0);
        let shown = match (main.samples, moving) {
            (1.., _) => main,
            (_, Some(moving)) => &moving.layer,
            _ => control,
        };
        let lowered = match (main.samples, moving) {
            (1.., _) => Lowered::default(),
            (_, Some(moving)) => moving.lowered,
            _ => Lowered { apart: control.stride as u32, step: if self.plan.stepless { 1.0 } else { 2.0 } },
        };
        let controlled = main.samples > 0 && control.samples > 0 && !self.plan.stepless;
        let control = controlled.then(|| control.read(context, false)).transpose()?;
        let opacity_threshold = self.plan.opacity_threshold;
        // Of one sample a pixel has no deviation: it tells only where that sample was not finite.
        let deviations = shown.samples > 1 || shown.tiles().is_some() || self.counts(context)?.non_finite > 0;
        Ok(Film {
            size: self.size,
            main: shown.read(context, deviations)?,
            control,
            paired: self.paired(),
            stepless: self.plan.stepless,
            noisy: self.random.is_some(),
            opacity_threshold,
            lowered,
            step_loss: moving.map(|m| m.step_loss),
            halves: self.rounds.halves(),
            rounds: self.rounds.on_the_way(),
            ..Film::default()
        })
    }

    /// What the kernels have counted.
    pub fn counts(&self, context: &DeviceContext) -> Result<SampleCounts> {
        let mut counts = [0u32; 8];
        context.device.read(&self.counts, 0, &mut counts)?;
        let [non_finite, fireflies, clamped, broken, low, high, cut, _] = counts;
        let unit = self.random.and_then(|r| r.clamp_luminance).unwrap_or(0.0) / 65536.0;
        let clamped_luminance = (u64::from(high) << 32 | u64::from(low)) as f64 * unit;
        Ok(SampleCounts { non_finite, fireflies, clamped, broken, clamped_luminance, cut })
    }
}

fn quick(speed: Option<f64>, [width, height]: [usize; 2]) -> bool {
    speed.is_some_and(|per_ms| (width * height) as f64 / per_ms < QUICK_MS)
}
