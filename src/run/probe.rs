//! The probe of a picture: a few of its pixels are sampled again, with other random numbers and with other steps, so that the picture's error is
//! known (`src/film/probed.rs`). It takes its samples after 1, 4, 8, 16, … samples of the picture. A pass takes many samples of each pixel, side by
//! side in a film of its own, so that the rays of a packet lie close together.

mod origin;
mod pixels;
mod sets;

use std::rc::Rc;

use super::context::DeviceContext;
use super::layer::{Batch, Layer};
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::film::{CLOSELY, MOST_FOR_STEP, ProbePixel, ProbedNoise, ProbedStep, luminance};
use crate::render::Scene;
use origin::Cells;
pub use sets::Steps;
use sets::{FINE, KINDS, MOST, QUICK_KINDS, SAME, Set, Step};

/// The pixels of a probe along the picture's shorter side, if that has at least so many pixels, or fewer.
const ALONG: [usize; 2] = [32, 20];
const LARGE: usize = 400;
/// The same if a sample costs little.
const ALONG_CHEAP: usize = 96;
/// The least shorter side of which every second cluster of these judges the step.
const SPARSE_FROM: usize = 200;
/// Pixels lie in clusters of two by two. With the samples of a pass they fill a beam of rays that lie close together.
const CLUSTER: u32 = 1;

/// The probe of a view whose samples are spread evenly.
pub(super) struct Probe {
    /// The film of the pass under way.
    pub layer: Layer,
    /// The kernels' counters of its passes. The picture's have none of them.
    pub counts: Buffer,
    /// Its clusters across and down, and their distance in the picture and in the full image.
    clusters: [usize; 2],
    /// A cluster has 2^`cluster` by 2^`cluster` pixels.
    cluster: u32,
    stride: usize,
    picture_stride: usize,
    is_large: bool,
    /// The step is judged at every cluster of so many each way; of few samples the noise, too.
    sparse: usize,
    steps: Steps,
    /// The kernel's tables for the steps.
    tables: Vec<(Step, Rc<Buffer>)>,
    sets: Vec<Set>,
    at: usize,
    closely: bool,
    step: Option<ProbedStep>,
    /// [`StepPixel::varies`] of the pixels that judge the step, if the grid was moved.
    varies: Vec<f64>,
}

impl Probe {
    /// Room for a probe of a scene's picture, in the memory `room` if that has the same size. `table` makes the kernel's table for a step.
    pub fn new(
        device: &Device,
        scene: &Scene,
        steps: Steps,
        cheap: bool,
        mut table: impl FnMut(f32) -> Result<Rc<Buffer>>,
        room: Option<Buffer>,
    ) -> Result<Self> {
        let region = scene.region();
        let shorter = region.size[0].min(region.size[1]) as usize / region.stride as usize;
        let cluster = if shorter > 1 { CLUSTER } else { 0 };
        let along = if cheap { ALONG_CHEAP } else { ALONG[usize::from(shorter < LARGE)] };
        let stride = (shorter / along).max(1) << cluster;
        let films = (MOST as usize) << (2 * cluster);
        let layer = Layer::new(device, scene, table(steps.step)?, stride, steps.step, films, room)?;
        let mut probe = Self {
            cluster,
            // A cluster is whole.
            clusters: region.size.map(|n| (n as usize / region.stride as usize / stride).max(1)),
            picture_stride: layer.picture_stride,
            layer,
            counts: device.upload(&[0; 32], 0)?,
            stride,
            is_large: shorter >= LARGE,
            sparse: if shorter >= SPARSE_FROM { 2 } else { 1 },
            steps,
            tables: Vec::new(),
            sets: Vec::new(),
            at: 0,
            closely: false,
            step: None,
            varies: Vec::new(),
        };
        probe.set_step(steps.step, &mut table)?;
        Ok(probe)
    }

    /// Starts over with another step.
    pub fn set_step(&mut self, step: f32, table: &mut impl FnMut(f32) -> Result<Rc<Buffer>>) -> Result<()> {
        self.steps.step = step;
        let all = [Step::Same, Step::Fine, Step::Twice];
        let needed = &all[..if self.steps.stepless { 1 } else { all.len() }];
        let tables = needed.iter().map(|step| Ok((*step, table(self.steps.of(*step))?)));
        self.tables = tables.collect::<Result<_>>()?;
        self.restart();
        Ok(())
    }

    /// Forgets all samples.
    pub fn restart(&mut self) {
        self.step = None;
        self.begin_stage(false);
    }

    /// Forgets the sets of samples, and takes others from now on.
    fn begin_stage(&mut self, closely: bool) {
        let kinds = KINDS.iter().take(if closely { KINDS.len() } else { QUICK_KINDS });
        let wanted = kinds.filter(|(step, _)| !self.steps.stepless || *step == Step::Same);
        let set = |&(step, stream): &(Step, u32)| {
            // Of few samples the noise is judged as sparsely as the step is otherwise, and the step of a large picture more sparsely.
            let times = match step {
                _ if self.steps.is_coarse() => 0,
                Step::Same => u32::from(!closely),
                _ => 1 + u32::from(!closely && self.is_large),
            };
            let mut set =
                Set { step, stream, sparse: self.sparse.pow(times), samples: 0, sums: Vec::new(), early: Vec::new() };
            set.sums = vec![0.0; self.pixels(&set).iter().product()];
            set
        };
        self.sets = wanted.map(set).collect();
        (self.closely, self.at) = (closely, 0);
    }

    /// The set of a kind.
    fn set(&self, kind: usize) -> Option<&Set> {
        self.sets.iter().find(|set| (set.step, set.stream) == KINDS[kind])
    }

    /// True if it is to take samples beside a picture of `samples` samples.
    pub fn is_owed(&self, samples: u32) -> bool {
        samples.is_power_of_two() && !self.has_all(samples)
    }

    /// True if it has all samples for a picture of `samples` samples.
    fn has_all(&self, samples: u32) -> bool {
        self.closely == (samples >= CLOSELY) && self.next(samples).is_none()
    }

    /// The set whose samples are next.
    fn next(&self, samples: u32) -> Option<usize> {
        self.sets.iter().position(|set| set.samples < set.wanted(samples))
    }

    /// True if the pass under way has rays that go to their end.
    pub fn goes_to_the_end(&self) -> bool {
        self.sets[self.at].step != Step::Same
    }

    /// Places the grid in the picture.
    fn place(&mut self, context: &DeviceContext, main: &Layer) -> Result<()> {
        let Some(first) = self.set(SAME[0]) else { return Ok(()) };
        let side = self.stride >> self.cluster;
        let cells = Cells { side, cluster: self.cluster, count: self.clusters, sparse: first.sparse };
        let origin = cells.origin(context, main)?;
        self.layer.origin = origin.at;
        self.varies = match self.set(FINE[0]) {
            Some(fine) if origin.at != [0; 2] => {
                let of = |[_, random]: [f64; 2]| if random.is_finite() { random / origin.random } else { 0.0 };
                self.picture(context, main, fine)?.into_iter().map(of).collect()
            }
            _ => Vec::new(),
        };
        Ok(())
    }

    /// Prepares the next pass beside a picture.
    pub fn begin(&mut self, context: &DeviceContext, main: &Layer) -> Result<()> {
        let samples = main.samples;
        if self.closely != (samples >= CLOSELY) {
            self.begin_stage(samples >= CLOSELY);
        }
        let Some(at) = self.next(samples) else { return Ok(()) };
        if self.sets.iter().all(|set| set.samples == 0) {
            self.place(context, main)?;
        }
        let [width, height] = self.pixels(&self.sets[at]);
        let (set, layer) = (&self.sets[at], &mut self.layer);
        let power = set.next().trailing_zeros();
        layer.batch = Some(Batch { across: power.div_ceil(2), down: power / 2, cluster: self.cluster });
        (layer.width, layer.height) = (width, height);
        (layer.stride, layer.picture_stride) = (self.stride * set.sparse, self.picture_stride * set.sparse);
        let table = self.tables.iter().find(|(step, _)| *step == set.step);
        table.into_iter().for_each(|(_, table)| layer.table = table.clone());
        (layer.step, layer.samples, layer.stream) = (self.steps.of(set.step), set.samples, set.stream);
        self.at = at;
        Ok(())
    }

    /// Takes over the samples of a pass. Once it has all that judge the step, it does so.
    pub fn passed(&mut self, context: &DeviceContext, main: &Layer) -> Result<()> {
        let (layer, set) = (&self.layer, &mut self.sets[self.at]);
        let Some(batch) = layer.batch else { return Ok(()) };
        let [wide, high] = layer.film_size();
        let mut film = vec![0.0f32; 4 * wide * high];
        context.device.read(&layer.buffer, 0, &mut film)?;
        let count = 1 << (batch.across + batch.down);
        for (pixel, sum) in set.sums.iter_mut().enumerate() {
            let (x, y) = ((pixel % layer.width) << batch.across, (pixel / layer.width) << batch.down);
            for sample in 0..count {
                let at = (y + (sample >> batch.across)) * wide + x + sample % (1 << batch.across);
                *sum += luminance(&film[4 * at..]);
            }
        }
        set.samples += count as u32;
        if set.samples <= MOST_FOR_STEP {
            set.early = set.sums.iter().map(|sum| sum / f64::from(set.samples)).collect();
        }
        if self.has_all(main.samples) && !self.steps.stepless {
            let shorter = self.steps.step / self.steps.of(Step::Fine);
            self.step = Some(ProbedStep::of(&self.step_pixels(), f64::from(shorter), self.steps.to_the_end));
        }
        Ok(())
    }

    /// What the step costs, once it is known.
    pub fn step(&self) -> Option<ProbedStep> {
        self.step
    }

    /// The noise of the picture, if the probe has its samples.
    pub fn noise(&self, context: &DeviceContext, main: &Layer) -> Result<Option<ProbedNoise>> {
        let sets = SAME.map(|kind| self.set(kind).filter(|_| main.samples > 0 && self.has_all(main.samples)));
        let Some(first) = sets[0] else { return Ok(None) };
        let picture = self.picture(context, main, first)?;
        let pixels =
            picture.iter().enumerate().filter(|(_, [_, random])| random.is_finite()).map(|(i, [picture, random])| {
                ProbePixel { picture: *picture, random: *random, again: sets.map(|set| set.map(|set| set.mean(i))) }
            });
        let per_pixel = (main.width * main.height) as f64 / picture.len() as f64;
        let part = if sets[1].is_some() { f64::from(first.samples) / f64::from(main.samples) } else { f64::INFINITY };
        Ok(Some(ProbedNoise::of(&pixels.collect::<Vec<_>>(), part, per_pixel)))
    }
}
