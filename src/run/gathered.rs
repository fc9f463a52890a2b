//! The samples that a view has gathered on the device, and the films that are made of them.

use std::rc::Rc;
use std::time::Duration;

use super::context::DeviceContext;
use super::counts;
use super::layer::Layer;
use super::motion::Moving;
use super::probe::{Probe, Steps};
use super::rounds::Rounds;
use crate::device::encode::{EncodeSettings, Encoder, Set};
use crate::device::variance;
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::film::picture::Background;
use crate::film::{CLOSELY, FieldError, Film, Lowered, Planned};
use crate::job::SampleCounts;
use crate::render::Scene;
use crate::technique::{Random, ViewPlan};

/// The stride of the preview if the picture's shorter side has at least 400 pixels, at least 100, or fewer.
const PREVIEW: [usize; 3] = [8, 4, 2];

/// The layer that a pass samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    /// The first picture, of few pixels and at twice the step.
    Preview,
    Main,
    /// Samples of the picture's probe.
    Probe,
    /// The picture of a moving camera, reduced so that it is in time.
    Moving,
}

/// The samples of a view.
pub(super) struct Gathered {
    /// The size of the picture.
    pub size: [usize; 2],
    /// The preview, and the layer of the main passes.
    pub layers: [Layer; 2],
    /// The probe of a picture whose samples are spread evenly. A pilot has none, unless it is to tell what that costs.
    pub probe: Option<Probe>,
    /// The picture of a moving camera, reduced so that it is in time.
    pub moving: Option<Moving>,
    pub rounds: Rounds,
    /// The kernels' counters.
    pub counts: Buffer,
    /// The error that the field causes, if there is a field and it is known.
    pub field_error: Option<FieldError>,
    has_field: bool,
    asked: Option<f64>,
    planned: Option<Planned>,
    random: Option<Random>,
    stepless: bool,
    biased: bool,
    opacity_threshold: f64,
    /// True if the probe's rays go to their end at other steps, where others end early.
    to_the_end: bool,
    background: Background,
    encoder: Encoder,
    /// The last encoded film, as long as it is the one to show.
    encoded: Option<Film>,
    /// The kernels' counters at that time.
    pub counted: SampleCounts,
}

impl Gathered {
    /// Room for the samples that `plan` takes of a scene; `table` makes the kernel's table for a step, and `steps` are the probe's. The memory of
    /// `before` is used again if it has the same size.
    pub fn new(
        context: &mut DeviceContext,
        scene: &Scene,
        mut table: impl FnMut(&Device, f32) -> Result<Rc<Buffer>>,
        plan: &ViewPlan,
        steps: Steps,
        before: Option<Self>,
    ) -> Result<Self> {
        let region = scene.region();
        let size = region.size.map(|n| n.div_ceil(region.stride) as usize);
        let (room, encoder) = before.map(|b| ((b.layers.map(|l| l.buffer), b.probe), b.encoder)).unzip();
        let ([of_preview, of_main], of_probe) =
            room.map_or(([None, None], None), |(layers, probe)| (layers.map(Some), probe.map(|p| p.layer.buffer)));
        let encoder = Encoder::new(&mut context.device, &context.curve, size, scene.background(), encoder)?;
        variance::build(&mut context.device)?;
        let device = &context.device;
        let sparse = match size[0].min(size[1]) {
            400.. => PREVIEW[0],
            100.. => PREVIEW[1],
            _ => PREVIEW[2],
        };
        let mut layer = |stride, step, room| Layer::new(device, scene, table(device, step)?, stride, step, 1, room);
        let layers = [layer(sparse, 2.0 * plan.step, of_preview)?, layer(1, plan.step, of_main)?];
        let is_probed = scene.view().random().is_none() && scene.is_probed();
        let probe = || Probe::new(device, scene, steps, plan.cheap, |step| table(device, step), of_probe);
        Ok(Self {
            size,
            layers,
            probe: is_probed.then(probe).transpose()?,
            moving: None,
            rounds: Rounds::new(scene.is_pilot()),
            counts: device.upload(&[0; 32], 0)?,
            field_error: None,
            has_field: scene.subject().field().is_some(),
            random: scene.view().random(),
            asked: scene.budget().max_error,
            planned: scene.planned(),
            stepless: plan.stepless,
            biased: plan.biased,
            opacity_threshold: plan.opacity_threshold,
            to_the_end: steps.to_the_end,
            background: scene.background(),
            encoder,
            encoded: None,
            counted: SampleCounts::default(),
        })
    }

    /// Forgets the samples, as for another camera. The error that the field causes stands until there is another.
    pub fn restart(&mut self, context: &DeviceContext) -> Result<()> {
        context.device.write(&mut self.counts, 0, &[0; 32])?;
        self.layers.iter_mut().try_for_each(|layer| layer.restart(&context.device))?;
        self.probe.iter_mut().for_each(Probe::restart);
        self.rounds.forget();
        self.encoded = None;
        Ok(())
    }

    /// The samples per pixel of the main passes.
    pub fn samples(&self) -> u32 {
        self.layers[1].samples
    }

    /// The bytes on the device.
    pub fn bytes(&self) -> usize {
        let moving = self.moving.as_ref().map_or(0, |m| m.layer.buffer.len());
        let probe = self.probe.as_ref().map_or(0, |p| p.layer.buffer.len());
        self.layers.iter().map(|l| l.buffer.len()).sum::<usize>() + self.encoder.bytes() + moving + probe
    }

    pub fn layer(&self, pass: Pass) -> &Layer {
        match (pass, &self.moving, &self.probe) {
            (Pass::Moving, Some(moving), _) => &moving.layer,
            (Pass::Probe, _, Some(probe)) => &probe.layer,
            (Pass::Preview, ..) => &self.layers[0],
            _ => &self.layers[1],
        }
    }

    pub fn layer_mut(&mut self, pass: Pass) -> &mut Layer {
        match (pass, &mut self.moving, &mut self.probe) {
            (Pass::Moving, Some(moving), _) => &mut moving.layer,
            (Pass::Probe, _, Some(probe)) => &mut probe.layer,
            (Pass::Preview, ..) => &mut self.layers[0],
            _ => &mut self.layers[1],
        }
    }

    /// The kernels' counters in a pass.
    pub fn counts(&self, pass: Pass) -> &Buffer {
        self.probe.as_ref().filter(|_| pass == Pass::Probe).map_or(&self.counts, |probe| &probe.counts)
    }

    /// True if the probe is to follow the picture. Without a wish for its error, it waits until there are a few samples.
    pub fn owes_probe(&self, error_is_wanted: bool) -> bool {
        let samples = self.samples();
        let due = samples >= CLOSELY || (samples > 0 && error_is_wanted);
        due && self.probe.as_ref().is_some_and(|probe| probe.is_owed(samples))
    }

    /// The next pass. `preview` is true if a preview may be shown.
    pub fn next_pass(&self, preview: bool, error_is_wanted: bool) -> Pass {
        let samples = self.samples();
        if samples == 0 && self.moving.as_ref().is_some_and(|m| m.layer.samples == 0) {
            Pass::Moving
        } else if samples == 0 && preview && self.layers[0].samples == 0 {
            Pass::Preview
        } else if self.owes_probe(error_is_wanted) {
            Pass::Probe
        } else {
            Pass::Main
        }
    }

    /// The layer to show: the main one, or before its first pass the picture of the moving camera, or else the preview.
    fn shown(&self) -> Pass {
        match &self.moving {
            _ if self.samples() > 0 => Pass::Main,
            Some(moving) if moving.layer.samples > 0 => Pass::Moving,
            _ => Pass::Preview,
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
        Ok(Film { field_error: self.field_error, planned: self.planned, ..film })
    }

    fn encode_anew(&mut self, context: &DeviceContext) -> Result<Film> {
        let pass = self.shown();
        // A single sample per pixel has no deviation. Its deviations only mark the pixels whose sample was not finite.
        self.counted = counts::read(context, &self.counts, self.random)?;
        let counted = self.counted;
        let main = self.layer(pass).unread();
        let settings = EncodeSettings {
            size: self.size,
            background: self.background,
            opacity_threshold: self.opacity_threshold,
            deviations: main.count > 1 || main.tiles.is_some() || counted.non_finite > 0,
        };
        let shown = layer(&self.layers, self.moving.as_ref(), pass);
        let sums = self.encoder.encode(&context.device, Set { buffer: &shown.buffer, samples: &main }, &settings)?;
        let twice = if self.stepless { 1.0 } else { 2.0 };
        let (lowered, reduced) = match (pass, &self.moving) {
            (Pass::Moving, Some(moving)) => (moving.lowered, Some(moving.losses)),
            (Pass::Preview, _) => (Lowered { stride: self.layers[0].stride as u32, step: twice }, None),
            _ => (Lowered::default(), None),
        };
        let probe = self.probe.as_ref().filter(|_| pass == Pass::Main);
        let probed_noise = probe.and_then(|probe| probe.noise(context, &self.layers[1]).transpose()).transpose()?;
        Ok(Film {
            size: self.size,
            main,
            sums,
            probed_noise,
            probed_step: probe.and_then(Probe::step),
            stepless: self.stepless,
            biased: self.biased,
            noisy: self.random.is_some(),
            opacity_threshold: self.opacity_threshold,
            to_the_end: self.to_the_end,
            has_field: self.has_field,
            field_error: self.field_error,
            background: self.background,
            lowered,
            reduced,
            asked: self.asked,
            planned: self.planned,
            rounds: self.rounds.all(),
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
        Ok(film)
    }

    /// Keeps the picture after a main pass, if it is a pilot's and the planner wants to see it.
    pub fn keep_round(&mut self, context: &DeviceContext, device_time: Duration) -> Result<()> {
        self.rounds.passed(context, &self.layers[1], device_time)
    }

    /// Prepares the next pass of the probe.
    pub fn begin_probe(&mut self, context: &DeviceContext) -> Result<()> {
        let Self { probe, layers, .. } = self;
        probe.iter_mut().try_for_each(|probe| probe.begin(context, &layers[1]))
    }

    /// Takes over the samples of a pass of the probe.
    pub fn probe_passed(&mut self, context: &DeviceContext) -> Result<()> {
        let Self { probe, layers, .. } = self;
        probe.iter_mut().try_for_each(|probe| probe.passed(context, &layers[1]))
    }
}

/// The layer of a pass that may be shown.
fn layer<'a>(layers: &'a [Layer; 2], moving: Option<&'a Moving>, pass: Pass) -> &'a Layer {
    match (pass, moving) {
        (Pass::Moving, Some(moving)) => &moving.layer,
        (Pass::Preview, _) => &layers[0],
        _ => &layers[1],
    }
}
