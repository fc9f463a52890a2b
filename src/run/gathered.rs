//! The samples that a view has gathered on the device, and the films that are made of them.

use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

use super::context::DeviceContext;
use super::layer::Layer;
use super::motion::Moving;
use super::rounds::Rounds;
use crate::device::Buffer;
use crate::device::encode::{EncodeSettings, Encoder, Set};
use crate::device::enums::{Count, DeviceEnum};
use crate::error::Result;
use crate::film::picture::Background;
use crate::film::{Film, Lowered};
use crate::job::SampleCounts;
use crate::render::Scene;
use crate::technique::{Random, ViewPlan};

/// The stride of the control if the picture's shorter side has at least 400 pixels, at least 100, or fewer. A thousand pixels and more tell the
/// error.
const CONTROL: [usize; 3] = [8, 4, 2];

/// The layer that a pass samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    Control,
    Main,
    /// The picture of a moving camera, reduced so that it is in time.
    Moving,
}

/// The samples of a view.
pub(super) struct Gathered {
    /// The size of the picture.
    pub size: [usize; 2],
    /// The control, and the layer of the main passes.
    pub layers: [Layer; 2],
    /// The picture of a moving camera, reduced so that it is in time.
    pub moving: Option<Moving>,
    pub rounds: Rounds,
    /// The kernels' counters.
    pub counts: Buffer,
    /// The relative change of the picture since the field had half its histories.
    pub field_error: Option<f64>,
    random: Option<Random>,
    stepless: bool,
    opacity_threshold: f64,
    /// True if the control's rays go to their end, where others end early.
    to_the_end: bool,
    background: Background,
    encoder: Encoder,
    /// The last encoded film, as long as it is the one to show.
    encoded: Option<Film>,
    /// The kernels' counters at that time.
    pub counted: SampleCounts,
}

impl Gathered {
    /// Room for the samples that `plan` takes of a scene, with the tables of twice its step and of its step. The memory of `before` is used again
    /// if it has the same size. `to_the_end` is true if the control's rays go to their end, where others end early.
    pub fn new(
        context: &mut DeviceContext,
        scene: &Scene,
        [of_control, of_main]: [Rc<Buffer>; 2],
        plan: &ViewPlan,
        to_the_end: bool,
        before: Option<Self>,
    ) -> Result<Self> {
        let region = scene.region();
        let size = region.size.map(|n| n.div_ceil(region.stride) as usize);
        let (room, encoder) = before.map(|b| (b.layers.map(|l| l.buffer).into(), b.encoder)).unzip();
        let encoder = Encoder::new(&mut context.device, &context.curve, size, scene.background(), encoder)?;
        let device = &context.device;
        let sparse = match size[0].min(size[1]) {
            400.. => CONTROL[0],
            100.. => CONTROL[1],
            _ => CONTROL[2],
        };
        let mut room: VecDeque<Buffer> = room.unwrap_or_default();
        let mut layer = |table, stride, step| Layer::new(device, scene, table, stride, 0, step, room.pop_front());
        Ok(Self {
            size,
            layers: [layer(of_control, sparse, 2.0 * plan.step)?, layer(of_main, 1, plan.step)?],
            moving: None,
            rounds: Rounds::new(scene.is_pilot()),
            counts: device.upload(&[0; 32], 0)?,
            field_error: None,
            random: scene.view().random(),
            stepless: plan.stepless,
            opacity_threshold: plan.opacity_threshold,
            to_the_end,
            background: scene.background(),
            encoder,
            encoded: None,
            counted: SampleCounts::default(),
        })
    }

    /// Forgets the samples, as for another camera.
    pub fn restart(&mut self, context: &DeviceContext) -> Result<()> {
        context.device.write(&mut self.counts, 0, &[0; 32])?;
        self.layers.iter_mut().try_for_each(|layer| layer.restart(&context.device))?;
        self.rounds.forget();
        (self.field_error, self.encoded) = (None, None);
        Ok(())
    }

    /// The samples per pixel of the main passes.
    pub fn samples(&self) -> u32 {
        self.layers[1].samples
    }

    /// The bytes on the device.
    pub fn bytes(&self) -> usize {
        let moving = self.moving.as_ref().map_or(0, |m| m.layer.buffer.len());
        self.layers.iter().map(|l| l.buffer.len()).sum::<usize>() + self.encoder.bytes() + moving
    }

    pub fn layer(&self, pass: Pass) -> &Layer {
        layer(&self.layers, self.moving.as_ref(), pass)
    }

    pub fn layer_mut(&mut self, pass: Pass) -> &mut Layer {
        match (pass, &mut self.moving) {
            (Pass::Moving, Some(moving)) => &mut moving.layer,
            (Pass::Control, _) => &mut self.layers[0],
            _ => &mut self.layers[1],
        }
    }

    /// The next pass.
    pub fn next_pass(&self) -> Pass {
        if self.moving.as_ref().is_some_and(|m| m.layer.samples == 0) && self.samples() == 0 {
            return Pass::Moving;
        }
        let [control, main] = &self.layers;
        let owed = match main.samples {
            // Without a step the control is only the first picture: there is no error of a step to control.
            _ if self.stepless => 1,
            // A sample of the control is the main sample of the same number but for its step. Otherwise noise would pass for the step's error, or
            // hide it.
            n => n + 1,
        };
        if control.samples < owed { Pass::Control } else { Pass::Main }
    }

    /// The layer to show: the main one, or before its first pass the picture of the moving camera, or else the control.
    fn shown(&self) -> Pass {
        match &self.moving {
            _ if self.samples() > 0 => Pass::Main,
            Some(moving) if moving.layer.samples > 0 => Pass::Moving,
            _ => Pass::Control,
        }
    }

    /// True if there is anything to see.
    pub fn is_something(&self) -> bool {
        self.layer(self.shown()).samples > 0
    }

    /// Notes that the picture to show is about to change.
    pub fn will_change(&mut self) {
        self.encoded = None;
    }

    /// Encodes the picture to show, unless that has been done. The film has the picture's sums, but not its pixels.
    pub fn encode(&mut self, context: &DeviceContext) -> Result<Film> {
        let film = match self.encoded.take() {
            Some(film) => film,
            None => self.encode_anew(context)?,
        };
        self.encoded = Some(film.clone());
        Ok(Film { field_error: self.field_error, ..film })
    }

    fn encode_anew(&mut self, context: &DeviceContext) -> Result<Film> {
        let pass = self.shown();
        // A single sample per pixel has no deviation. Its deviations only mark the pixels whose sample was not finite.
        self.counted = self.read_counts(context)?;
        let Self { layers, moving, encoder, counted, .. } = self;
        let shown = layer(layers, moving.as_ref(), pass);
        let main = shown.unread();
        let controlled = pass == Pass::Main && layers[0].samples > 0 && !self.stepless;
        let control = controlled.then(|| layers[0].unread());
        let settings = EncodeSettings {
            size: self.size,
            background: self.background,
            opacity_threshold: self.opacity_threshold,
            deviations: main.count > 1 || main.tiles.is_some() || counted.non_finite > 0,
        };
        let of_control = control.as_ref().map(|samples| Set { buffer: &layers[0].buffer, samples });
        let of_main = Set { buffer: &shown.buffer, samples: &main };
        let sums = encoder.encode(&context.device, of_main, of_control, &settings)?;
        let twice = if self.stepless { 1.0 } else { 2.0 };
        let (lowered, step_loss) = match (pass, moving) {
            (Pass::Moving, Some(moving)) => (moving.lowered, Some(moving.step_loss)),
            (Pass::Control, _) => (Lowered { stride: layers[0].stride as u32, step: twice }, None),
            _ => (Lowered::default(), None),
        };
        Ok(Film {
            size: self.size,
            main,
            sums,
            control,
            stepless: self.stepless,
            noisy: self.random.is_some(),
            opacity_threshold: self.opacity_threshold,
            to_the_end: self.to_the_end,
            field_error: self.field_error,
            background: self.background,
            lowered,
            step_loss,
            halves: self.rounds.halves(),
            step_noise: self.rounds.step_noise(),
            rounds: self.rounds.on_the_way(),
        })
    }

    /// The bytes of the picture that was encoded last.
    pub fn picture(&self, context: &DeviceContext) -> Result<Vec<u8>> {
        self.encoder.picture(&context.device)
    }

    /// The film to show, with its pixels.
    pub fn film(&mut self, context: &DeviceContext) -> Result<Film> {
        let mut film = self.encode(context)?;
        let deviations = film.main.count > 1 || film.main.tiles.is_some() || film.sums.unknown > 0;
        film.main = self.layer(self.shown()).read(context, deviations)?;
        film.control = film.control.map(|_| self.layers[0].read(context, false)).transpose()?;
        Ok(film)
    }

    /// Keeps the picture after a main pass, if its halves are to be compared.
    pub fn keep_round(&mut self, context: &DeviceContext, device_time: Duration) -> Result<()> {
        let [control, main] = &self.layers;
        let control = (!self.stepless).then_some(control);
        self.rounds.passed(context, main, control, device_time)
    }

    fn read_counts(&self, context: &DeviceContext) -> Result<SampleCounts> {
        let mut counts = [0u32; Count::LENGTH];
        context.device.read(&self.counts, 0, &mut counts)?;
        let of = |count: Count| counts[count as usize];
        let unit = self.random.and_then(|r| r.clamp_luminance).unwrap_or(0.0) / 65536.0;
        let clamped = u64::from(of(Count::ClampedEnergyHigh)) << 32 | u64::from(of(Count::ClampedEnergyLow));
        Ok(SampleCounts {
            non_finite: of(Count::NonFinite),
            fireflies: of(Count::Fireflies),
            clamped: of(Count::Clamped),
            broken: of(Count::Broken),
            clamped_luminance: clamped as f64 * unit,
            cut: of(Count::Cut),
        })
    }
}

fn layer<'a>(layers: &'a [Layer; 2], moving: Option<&'a Moving>, pass: Pass) -> &'a Layer {
    match (pass, moving) {
        (Pass::Moving, Some(moving)) => &moving.layer,
        (Pass::Control, _) => &layers[0],
        _ => &layers[1],
    }
}
