//! The pixels of a probe, in the picture and in its sets of samples.

use super::Probe;
use super::sets::{FINE, SAME, Set, TWICE};
use crate::error::Result;
use crate::film::{StepPixel, luminance};
use crate::run::context::DeviceContext;
use crate::run::layer::Layer;

impl Probe {
    /// The pixels of a set across and down.
    pub(super) fn pixels(&self, set: &Set) -> [usize; 2] {
        self.clusters.map(|n| n.div_ceil(set.sparse) << self.cluster)
    }

    pub(super) fn step_pixels(&self) -> Vec<StepPixel> {
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
                varies: self.varies.get(i).copied(),
            })
        };
        (0..fine.sums.len()).filter_map(pixel).collect()
    }

    /// The picture's luminance at the pixels of a set, and the square of the standard error of as many random samples; NaN if a sample was not finite.
    /// Of one sample it is the variance of the cluster.
    pub(super) fn picture(&self, context: &DeviceContext, main: &Layer, set: &Set) -> Result<Vec<[f64; 2]>> {
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
