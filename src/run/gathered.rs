//! What a view has gathered so far, on the device: sets of samples, and the films that are made of them.

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

/// What a view has gathered.
pub(super) struct Gathered {
    /// Size of the picture.
    pub size: [usize; 2],
    /// The control, and the passes proper.
    pub layers: [Layer; 2],
    /// A picture that is in time while the camera moves.
    pub moving: Option<Moving>,
    pub rounds: Rounds,
    /// What the kernels count.
    pub counts: Buffer,
    /// Relative change of the picture since the field had half its histories.
    pub field_error: Option<f64>,
    random: Option<Random>,
    paired: bool,
    stepless: bool,
    opacity_threshold: f64,
    background: Background,
    encoder: Encoder,
    /// What was encoded last, as long as it is what there is to see.
    encoded: Option<Film>,
    /// What the kernels had counted then.
    pub counted: SampleCounts,
}

impl Gathered {
    /// Room for what `plan` makes of a scene, with the tables of twice its step and of its step, in the memory of what was gathered `before`
    /// where that is as large; `paired` says whether a sample of the control differs from the one of its number in the passes proper by
    /// its step alone.
    pub fn new(
        context: &mut DeviceContext,
        scene: &Scene,
        [of_control, of_main]: [Rc<Buffer>; 2],
        plan: &ViewPlan,
        paired: bool,
        before: Option<Self>,
    ) -> Result<Self> {
        let region = scene.region();
        let size = region.size.map(|n| n.div_ceil(region.stride) as usize);
        let (room, encoder) = before.map(|b| (b.layers.map(|l| l.buffer).into(), b.encoder)).unzip();
        let encoder = Encoder::new(&mut context.device, &context.curve, size, scene.background(), encoder)?;
        let device = &context.device;
        let sparse = match size[0].min(size[1]) {
            400.. => CONTROL[0],
            200.. => CONTROL[1],
            _ => CONTROL[2],
        };
        let mut room: VecDeque<Buffer> = room.unwrap_or_default();
        let mut layer =
            |table, stride, stream, step| Layer::new(device, scene, table, stride, stream, step, room.pop_front());
        Ok(Self {
            size,
            layers: [layer(of_control, sparse, 1, 2.0 * plan.step)?, layer(of_main, 1, 0, plan.step)?],
            moving: None,
            rounds: Rounds::new(scene.is_pilot()),
            counts: device.upload(&[0; 32], 0)?,
            field_error: None,
            random: scene.view().random(),
            paired,
            stepless: plan.stepless,
            opacity_threshold: plan.opacity_threshold,
            background: scene.background(),
            encoder,
            encoded: None,
            counted: SampleCounts::default(),
        })
    }

    /// Forgets what was gathered: another camera.
    pub fn restart(&mut self, context: &DeviceContext) -> Result<()> {
        context.device.write(&mut self.counts, 0, &[0; 32])?;
        self.layers.iter_mut().try_for_each(|layer| layer.restart(&context.device))?;
        self.rounds.forget();
        (self.field_error, self.encoded) = (None, None);
        Ok(())
    }

    /// Samples per pixel of the passes proper.
    pub fn samples(&self) -> u32 {
        self.layers[1].samples
    }

    /// Bytes on the device.
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

    /// Which pass is next.
    pub fn next_pass(&self) -> Pass {
        if self.moving.as_ref().is_some_and(|m| m.layer.samples == 0) && self.samples() == 0 {
            return Pass::Moving;
        }
        let [control, main] = &self.layers;
        let owed = match main.samples {
            // The first picture; there is nothing to control.
            _ if self.stepless => 1,
            // Paired with the passes proper: only so does noise not pass for the step's doing, nor hide it.
            n if self.paired => n + 1,
            0 | 1 => 1,
            n => 1 + n.ilog2(),
        };
        if control.samples < owed { Pass::Control } else { Pass::Main }
    }

    /// What there is to see: the passes proper, or before the first of them the picture that is in time, or the control.
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

    /// What there is to see is about to be another.
    pub fn will_change(&mut self) {
        self.encoded = None;
    }

    /// Encodes what there is to see, unless that has been done: what it says of itself, without its pixels.
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
        // Of one sample a pixel has no deviation: it tells only where that sample was not finite.
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
            paired: self.paired,
            stepless: self.stepless,
            noisy: self.random.is_some(),
            opacity_threshold: self.opacity_threshold,
            field_error: self.field_error,
            background: self.background,
            lowered,
            step_loss,
            halves: self.rounds.halves(),
            rounds: self.rounds.on_the_way(),
        })
    }

    /// The bytes of the picture that was encoded last.
    pub fn picture(&self, context: &DeviceContext) -> Result<Vec<u8>> {
        self.encoder.picture(&context.device)
    }

    /// What there is to see, with its pixels.
    pub fn film(&mut self, context: &DeviceContext) -> Result<Film> {
        let mut film = self.encode(context)?;
        let deviations = film.main.count > 1 || film.main.tiles.is_some() || film.sums.unknown > 0;
        film.main = self.layer(self.shown()).read(context, deviations)?;
        film.control = film.control.map(|_| self.layers[0].read(context, false)).transpose()?;
        Ok(film)
    }

    /// After a pass proper: keeps what the picture is, where its halves are to be compared.
    pub fn keep_round(&mut self, context: &DeviceContext, device_time: Duration) -> Result<()> {
        self.rounds.passed(context, &self.layers[1], device_time)
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
