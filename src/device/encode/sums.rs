//! The sums that the kernel of [`super::Encoder`] leaves.

use crate::device::enums::DeviceEnum;
use crate::device_enum;
use crate::film::Sums;

device_enum! {
    /// Numbers that a work-item leaves of two rows of the film.
    pub enum FilmSum: "SUM" {
        /// Luminance.
        Luminance,
        /// The greatest luminance. Squares are summed relative to its square.
        LuminanceScale,
        /// Squares of the light that may be missing behind the ends of rays.
        Truncated,
        /// Squared deviations of blocks of four pixels from their means.
        Blocks,
        /// Squares of these.
        BlockSquares,
        /// Squared differences between pixels and the mean of their neighbours.
        Between,
        /// The number of pixels in `Between`.
        PixelsBetween,
        /// The greatest squared standard error.
        NoiseScale,
        /// Squared standard errors of pixels.
        Noise,
        /// Squares of `Noise`.
        NoiseSquares,
        /// Pixels of unknown error.
        Unknown,
        /// Values above white.
        Clipped,
        /// Luminance times samples.
        Weighted,
    }
}

/// The numbers of a work-item.
pub const SUMS: usize = FilmSum::LENGTH;

/// The sums of a block of the film.
pub fn sums_of_block(numbers: &[f32; SUMS]) -> Sums {
    let of = |sum: FilmSum| f64::from(numbers[sum as usize]);
    let (scale, noise_scale) = (of(FilmSum::LuminanceScale), of(FilmSum::NoiseScale));
    Sums {
        luminance: of(FilmSum::Luminance),
        truncated: of(FilmSum::Truncated) * scale * scale,
        blocks: of(FilmSum::Blocks) * scale * scale,
        block_squares: of(FilmSum::BlockSquares) * scale.powi(4),
        between: of(FilmSum::Between) * scale * scale,
        pixels_between: of(FilmSum::PixelsBetween) as u64,
        noise: of(FilmSum::Noise),
        noise_squares: of(FilmSum::NoiseSquares) * noise_scale * noise_scale,
        unknown: of(FilmSum::Unknown) as u64,
        clipped: of(FilmSum::Clipped) as u64,
        weighted: of(FilmSum::Weighted),
        ..Sums::default()
    }
}
