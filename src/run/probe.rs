//! The probe of a picture: a few of its pixels are sampled again, with other random numbers and with other steps, so that the picture's error is
//! known (`src/film/probed.rs`). It takes its samples after 1, 4, 8, 16, … samples of the picture. A pass takes many samples of each pixel, side by
//! side in a film of its own, so that the rays of a packet lie close together.

mod origin;
mod sets;

use std::rc::Rc;

use super::context::DeviceContext;
use super::layer::{Batch, Layer};
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::film::{CLOSELY, MOST_FOR_STEP, ProbePixel, ProbedNoise, ProbedStep, StepPixel, luminance};
use crate::render::Scene;
use origin::Cells;
pub use sets::Steps;
use sets::{FINE, KINDS, MOST, QUICK_KINDS, SAME, Set, Step, TWICE};

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

    /// The pixels of a set across and down.
    fn pixels(&self, set: &Set) -> [usize; 2] {
        self.clusters.map(|n| n.div_ceil(set.sparse) << self.cluster)
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

    /// Prepares the next pass beside a picture.
    pub fn begin(&mut self, context: &DeviceContext, main: &Layer) -> Result<()> {
        let samples = main.samples;
        if self.closely != (samples >= CLOSELY) {
            self.begin_stage(samples >= CLOSELY);
        }
        let Some(at) = self.next(samples) else { return Ok(()) };
        if let (Some(first), true) = (self.set(SAME[0]), self.sets.iter().all(|set| set.samples == 0)) {
            let (side, sparse) = (self.stride >> self.cluster, first.sparse);
            let cells = Cells { side, cluster: self.cluster, count: self.clusters, sparse };
            self.layer.origin = cells.origin(context, main)?;
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

    fn step_pixels(&self) -> Vec<StepPixel> {
        let Some(fine) = self.set(FINE[0]) else { return Vec::new() };
        let width = self.pixels(fine)[0];
        let both = |[same, fine]: [usize; 2], i: usize| {
            let (same, fine) = (self.set(same)?, self.set(fine)?);
            let factor = fine.sparse / same.sparse;
            let at = |n: usize| (((n >> self.cluster) * factor) << self.cluster) + n % (1 << self.cluster);
            Some([same.early[at(i / width) * self.pixels(same)[0] + at(i % width)], fine.mean(i)])
        };
        let pixel = |i: usize| {
            Some(StepPixel {
                first: both([SAME[0], FINE[0]], i)?,
                second: both([SAME[1], FINE[1]], i),
                twice: self.set(TWICE).map(|set| set.mean(i)),
            })
        };
        (0..fine.sums.len()).filter_map(pixel).collect()
    }

    /// The picture's luminance at the pixels of a set, and the square of the standard error of as many random samples; NaN if a sample was not finite.
    /// Of one sample it is the variance of the cluster.
    fn picture(&self, context: &DeviceContext, main: &Layer, set: &Set) -> Result<Vec<[f64; 2]>> {
        let ([width, height], stride) = (self.pixels(set), self.stride * set.sparse);
        let [column, line] = self.layer.origin;
        let rows = |from: usize, channels: usize| -> Result<Vec<f32>> {
            let (row, mut all) = (4 * channels * main.width, Vec::new());
            for within in 0..1 << self.cluster {
                let from = from + (line + within) * row;
                all.push(context.device.read_rows(
                    &main.buffer,
                    from,
                    stride * row,
                    height >> self.cluster,
                    channels * main.width,
                )?);
            }
            Ok(all.concat())
        };
        let means = rows(0, 4)?;
        let squared = if main.samples > 1 { rows(16 * main.width * main.height, 1)? } else { Vec::new() };
        let n = f64::from(main.samples);
        let at = |x: usize, y: usize| {
            let row = y % (1 << self.cluster) * (height >> self.cluster) + (y >> self.cluster);
            row * main.width + column + (x >> self.cluster) * stride + x % (1 << self.cluster)
        };
        let of_cluster = |x: usize, y: usize| {
            let side = 1 << self.cluster;
            let all = (0..side * side)
                .map(|i| luminance(&means[4 * at(x / side * side + i % side, y / side * side + i / side)..]));
            let mean = all.clone().sum::<f64>() / (side * side) as f64;
            all.map(|l| (l - mean).powi(2)).sum::<f64>() / (side * side) as f64
        };
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let random = match squared.get(at(x, y)) {
                Some(m2) => f64::from(*m2) / (n * (n - 1.0)),
                None => of_cluster(x, y),
            };
            [luminance(&means[4 * at(x, y)..]), random]
        };
        Ok((0..width * height).map(pixel).collect())
    }
}
