//! What the error of a film is made of: sums over its pixels, which the device works out (`kernels/encode.cl`).

/// Sums over the samples of a film.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Of linear luminance.
    pub luminance: f64,
    /// Of luminance times the pixel's number of samples.
    pub weighted: f64,
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
    /// Of the squared difference of every second pixel of a row to the mean of its neighbours,
    pub between: f64,
    /// over so many pixels: all that have both neighbours in their part of a row.
    pub pixels_between: u64,
    /// Pixels of which a sample was not finite.
    pub unknown: u64,
    /// Values of the picture that were clipped at white.
    pub clipped: u64,
    /// Against the control, where there is one.
    pub control: Option<Apart>,
}

/// The samples against those of a control, at the control's pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Apart {
    /// Sum of the squared differences of luminance,
    pub squared: f64,
    /// of the variance of one sample, where it is known,
    pub variance: f64,
    /// over so many pixels.
    pub pixels: usize,
}

impl std::iter::Sum for Sums {
    /// Of parts of the pixels; what is known of the whole alone is the first's.
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            luminance: a.luminance + b.luminance,
            weighted: a.weighted + b.weighted,
            truncated: a.truncated + b.truncated,
            noise: a.noise + b.noise,
            noise_squares: a.noise_squares + b.noise_squares,
            blocks: a.blocks + b.blocks,
            block_count: a.block_count + b.block_count,
            between: a.between + b.between,
            pixels_between: a.pixels_between + b.pixels_between,
            unknown: a.unknown + b.unknown,
            clipped: a.clipped + b.clipped,
            control: a.control.or(b.control),
        })
    }
}

impl Sums {
    /// Root mean square of the deviation from the mean of each 2×2 block: what half the resolution would lose, which bounds
    /// what this resolution loses on a picture that is smooth at its scale.
    pub(super) fn of_blocks(&self) -> f64 {
        (self.blocks / self.block_count.max(1) as f64).sqrt()
    }

    /// Root mean square of what is lost where only every second pixel of every second row is there and the others are interpolated: across
    /// for a quarter of the pixels, down for a quarter, both for a quarter.
    pub(super) fn of_every_second(&self) -> f64 {
        (self.between / self.pixels_between.max(1) as f64).sqrt()
    }
}
