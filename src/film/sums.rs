//! The sums over a film's pixels from which its error is computed. The device works them out (`kernels/encode.cl`).

use super::Estimate;
use super::bound::of_few;

/// Sums over the samples of a film.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// The sum of linear luminance.
    pub luminance: f64,
    /// The sum of luminance times the pixel's number of samples.
    pub weighted: f64,
    /// The sum of the square of the most that may lie behind the opacity at which rays end: the luminance in front of it, times the
    /// transmittance that is left.
    pub truncated: f64,
    /// The sum of the square sᵢ² of a pixel's standard error, if it is known.
    pub noise: f64,
    /// The sum of sᵢ⁴.
    pub noise_squares: f64,
    /// The sum of the mean squared deviation from the mean of each block of 2 × 2 pixels.
    pub blocks: f64,
    /// The sum of the squares of these deviations.
    pub block_squares: f64,
    /// The number of these blocks.
    pub block_count: usize,
    /// The sum of the squared difference of every second pixel of a row to the mean of its neighbours; of a film of fewer pixels than the picture also that
    /// of every second pixel of a column.
    pub between: f64,
    /// The number of pixels of `between`: all that have both neighbours in their part of a row or a column.
    pub pixels_between: u64,
    /// The number of pixels with a sample that was not finite.
    pub unknown: u64,
    /// The number of values of the picture that were clipped at white.
    pub clipped: u64,
}

impl std::iter::Sum for Sums {
    /// Adds the sums of parts of the pixels.
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            luminance: a.luminance + b.luminance,
            weighted: a.weighted + b.weighted,
            truncated: a.truncated + b.truncated,
            noise: a.noise + b.noise,
            noise_squares: a.noise_squares + b.noise_squares,
            blocks: a.blocks + b.blocks,
            block_squares: a.block_squares + b.block_squares,
            block_count: a.block_count + b.block_count,
            between: a.between + b.between,
            pixels_between: a.pixels_between + b.pixels_between,
            unknown: a.unknown + b.unknown,
            clipped: a.clipped + b.clipped,
        })
    }
}

impl Sums {
    /// The root mean square of the deviation from the mean of each 2×2 block. Half the resolution would lose this much. It bounds the loss
    /// of this resolution on a picture that is smooth at its scale.
    pub(super) fn of_blocks(&self) -> f64 {
        (self.blocks / self.block_count.max(1) as f64).sqrt()
    }

    /// The square of random noise, from the deviations within blocks: the mean of a block takes a quarter of it away. The effective number of blocks is
    /// ν = (Σ b)² / Σ b²; that square, and the squared error of the picture, deviate from it by up to √(2/ν) of it, with Student's margin if ν is small.
    pub(super) fn noise_of_blocks(&self) -> Estimate {
        let value = self.of_blocks().powi(2) * 4.0 / 3.0;
        let blocks = self.blocks_that_matter();
        Estimate { value, error: value * of_few(blocks) * (2.0 / blocks).sqrt() }
    }

    /// The effective number of blocks, ν = (Σ b)² / Σ b²; infinite if none varies.
    pub(super) fn blocks_that_matter(&self) -> f64 {
        if self.blocks > 0.0 { self.blocks * self.blocks / self.block_squares } else { f64::INFINITY }
    }

    /// A bound of the loss of a film of fewer pixels than the picture: at edges the deviation within blocks is the lesser, on slopes the loss of every
    /// second pixel.
    pub(super) fn of_fewer_pixels(&self) -> f64 {
        if self.pixels_between > 0 { self.of_blocks().min(self.of_every_second()) } else { self.of_blocks() }
    }

    /// The root mean square of the loss if only every second pixel of every second row is there and the others are interpolated: across for
    /// a quarter of the pixels, down for a quarter, both for a quarter.
    pub(super) fn of_every_second(&self) -> f64 {
        (self.between / self.pixels_between.max(1) as f64).sqrt()
    }
}
