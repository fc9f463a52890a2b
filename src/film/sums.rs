//! What the error of a film is made of: sums over its pixels, in one pass.

use std::ops::Range;

use rayon::prelude::*;

use super::{Film, Samples, luminance};
use crate::frame;

/// Pixels that are worked out side by side.
const SIDE_BY_SIDE: usize = 8;

/// Sums over some rows of the samples.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// Of linear luminance.
    pub luminance: f64,
    /// Of the square of what lies at most behind the opacity at which rays end: what is in front of it, times what still gets through.
    pub truncated: f64,
    /// Of the square sᵢ² of a pixel's standard error where it is known,
    pub noise: f64,
    /// and of sᵢ⁴.
    pub noise_squares: f64,
    /// Of the mean squared deviation from the mean of each block of 2 × 2 pixels,
    pub blocks: f64,
    /// and how many blocks there are.
    pub block_count: usize,
}

impl std::iter::Sum for Sums {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            luminance: a.luminance + b.luminance,
            truncated: a.truncated + b.truncated,
            noise: a.noise + b.noise,
            noise_squares: a.noise_squares + b.noise_squares,
            blocks: a.blocks + b.blocks,
            block_count: a.block_count + b.block_count,
        })
    }
}

impl Film {
    /// The sums over all samples; the same to the last bit for any number of cores.
    pub(super) fn sums(&self) -> Sums {
        let parts = frame::stripes([self.main.width, self.main.height]).map(|rows| self.sums_of(rows));
        parts.collect::<Vec<_>>().into_iter().sum()
    }

    /// The sums over a stripe of the samples.
    pub(super) fn sums_of(&self, rows: Range<usize>) -> Sums {
        let main = &self.main;
        let (luminance, truncated) =
            light(&main.mean[4 * main.width * rows.start..4 * main.width * rows.end], self.opacity_threshold);
        let (noise, noise_squares) = if main.count < 2 { (0.0, 0.0) } else { main.noise(rows.clone()) };
        // Of more samples, pixels tell their error themselves.
        let blocky = main.stride > 1 || (main.count < 2 && self.noisy);
        let (blocks, block_count) = if blocky { main.blocks(rows) } else { (0.0, 0) };
        Sums { luminance, truncated, noise, noise_squares, blocks, block_count }
    }
}

/// The sums of luminance, and of the square of what is behind rays that ended.
fn light(pixels: &[f32], opacity_threshold: f64) -> (f64, f64) {
    let ended = 1.0 - opacity_threshold;
    let (mut sums, mut behind) = ([0.0; SIDE_BY_SIDE], [0.0; SIDE_BY_SIDE]);
    let (eights, rest) = pixels.as_chunks::<{ 4 * SIDE_BY_SIDE }>();
    let mut add = |i: usize, luminance: f64, through: f64| {
        sums[i] += luminance;
        behind[i] += if through <= ended { (through.max(0.0) * luminance).powi(2) } else { 0.0 };
    };
    for eight in eights {
        // Beside the volume.
        if eight.iter().fold(0, |bits, v| bits | v.to_bits()) == 0 {
            continue;
        }
        let pixels: [_; SIDE_BY_SIDE] = std::array::from_fn(|i| &eight[4 * i..4 * i + 4]);
        let (luminances, through) = (pixels.map(luminance), pixels.map(|p| 1.0 - f64::from(p[3])));
        (0..SIDE_BY_SIDE).for_each(|i| add(i, luminances[i], through[i]));
    }
    rest.chunks_exact(4).for_each(|p| add(0, luminance(p), 1.0 - f64::from(p[3])));
    (sums.iter().sum(), behind.iter().sum())
}

impl Samples {
    /// The sums of sᵢ² and sᵢ⁴.
    fn noise(&self, rows: Range<usize>) -> (f64, f64) {
        let Some(tiles) = &self.tiles else {
            return noise(&self.m2[self.width * rows.start..self.width * rows.end], self.count);
        };
        let of_row = |y: usize| {
            let row = self.m2[self.width * y..self.width * (y + 1)].chunks(tiles.side);
            row.enumerate().map(move |(i, tile)| noise(tile, tiles.count_at(i * tiles.side, y)))
        };
        rows.flat_map(of_row).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d))
    }

    /// The sum over blocks of 2 × 2 pixels of the mean squared deviation from their mean, and how many there are.
    fn blocks(&self, rows: Range<usize>) -> (f64, usize) {
        let (mut sum, mut count) = (0.0, 0);
        let row = |y: usize| self.mean[4 * self.width * y..4 * self.width * (y + 1)].chunks_exact(8);
        for y in rows.step_by(2).filter(|y| y + 1 < self.height) {
            for (top, low) in row(y).zip(row(y + 1)) {
                let four = [&top[..4], &top[4..], &low[..4], &low[4..]].map(luminance);
                let mean = four.iter().sum::<f64>() / 4.0;
                sum += four.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 4.0;
                count += 1;
            }
        }
        (sum, count)
    }

    /// Root mean square of the deviation from the mean of each 2×2 block: what half the resolution would lose, which bounds
    /// what this resolution loses on a picture that is smooth at its scale.
    pub(super) fn resolution_error(&self) -> f64 {
        let parts = frame::stripes([self.width, self.height]).map(|rows| self.blocks(rows)).collect::<Vec<_>>();
        let (sum, count) = parts.into_iter().fold((0.0, 0), |(a, b), (c, d)| (a + c, b + d));
        (sum / count.max(1) as f64).sqrt()
    }
}

/// The sums of sᵢ² and sᵢ⁴ of pixels with `count` samples each, of their squared deviations; what is no number counts as 0.
fn noise(m2: &[f32], count: u32) -> (f64, f64) {
    if count < 2 {
        return (0.0, 0.0);
    }
    let scale = 1.0 / (f64::from(count) * f64::from(count - 1));
    let (mut sums, mut squares) = ([0.0; SIDE_BY_SIDE], [0.0; SIDE_BY_SIDE]);
    let (eights, rest) = m2.as_chunks::<SIDE_BY_SIDE>();
    let mut add = |i: usize, m2: f32| {
        let squared = f64::from(if m2.is_finite() { m2 } else { 0.0 }) * scale;
        sums[i] += squared;
        squares[i] += squared * squared;
    };
    for eight in eights {
        eight.iter().enumerate().for_each(|(i, m2)| add(i, *m2));
    }
    rest.iter().for_each(|m2| add(0, *m2));
    (sums.iter().sum(), squares.iter().sum())
}

#[cfg(test)]
#[path = "sums/tests.rs"]
mod tests;
