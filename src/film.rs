//! The film on the host: the samples that a view has gathered so far, its estimated error, and the numbers that are read from its pixels.

mod bound;
mod chance;
pub mod difference;
mod estimate;
mod field;
mod lowered;
mod noise;
pub mod picture;
mod probed;
mod rounds;
pub mod srgb;
mod stated;
mod sums;

use std::sync::Arc;

pub use bound::Estimate;
pub use chance::by_chance;
pub use field::{FieldError, freedom};
pub use lowered::Lowered;
use picture::Background;
pub use probed::{ProbePixel, ProbedNoise, ProbedStep, StepPixel};
pub(crate) use rounds::{CLOSELY, FIRST_PROBED, MOST_FOR_STEP, Round, is_round, pilot_rounds, probed_samples};
pub use stated::{ErrorEstimate, LEAST_STATED, Source, Unknown};
pub use sums::Sums;

/// Means and squared deviations of one set of samples, as the device leaves them (`kernels/shared/film.h`).
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// The width in its own pixels.
    pub width: usize,
    /// The height in its own pixels.
    pub height: usize,
    /// The distance of its pixels: it holds every `stride`-th pixel of the full image.
    pub stride: usize,
    /// Samples per pixel.
    pub count: u32,
    /// The mean linear R, G, B and alpha of every pixel. It is empty if it was not read.
    pub mean: Vec<f32>,
    /// The sum of squared deviations of the luminance of every pixel; NaN if a sample was not finite. It is empty if it was not read, as
    /// with one sample that was finite everywhere.
    pub m2: Vec<f32>,
    /// The samples by tile, if tiles with more error got more samples.
    pub tiles: Option<Tiles>,
}

/// The number of samples of each tile of a picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tiles {
    /// The number of pixels along a tile's side.
    pub side: usize,
    /// The number of tiles across.
    pub wide: usize,
    /// The samples of each pixel of a tile, row by row.
    pub counts: Vec<u32>,
}

impl Tiles {
    /// The samples of the pixel (x, y).
    pub fn count_at(&self, x: usize, y: usize) -> u32 {
        self.counts[y / self.side * self.wide + x / self.side]
    }
}

/// The luminance of linear sRGB (ITU-R BT.709), `luminance` of the kernel.
pub(crate) fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

impl Samples {
    /// The linear luminance of a pixel.
    pub fn luminance(&self, pixel: usize) -> f64 {
        luminance(&self.mean[4 * pixel..])
    }

    /// The number of pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// The samples of a pixel.
    fn count_at(&self, pixel: usize) -> u32 {
        match &self.tiles {
            Some(tiles) => tiles.count_at(pixel % self.width, pixel / self.width),
            None => self.count,
        }
    }

    /// The variance of one sample of a pixel's luminance; 0 for a single sample, NaN if a sample was not finite.
    fn known_variance(&self, pixel: usize) -> f64 {
        let count = self.count_at(pixel);
        if count < 2 { 0.0 } else { f64::from(self.m2[pixel]) / f64::from(count - 1) }
    }

    /// The variance of one sample of a pixel's luminance; 0 if it is not known.
    fn variance(&self, pixel: usize) -> f64 {
        Some(self.known_variance(pixel)).filter(|v| v.is_finite()).unwrap_or(0.0)
    }

    /// The square of the standard error of a pixel's luminance; NaN if a sample was not finite.
    fn squared_error(&self, pixel: usize) -> f64 {
        self.known_variance(pixel) / f64::from(self.count_at(pixel).max(1))
    }

    /// A pixel's term in the denominator of Welch's degrees of freedom: the square of its squared error over its own degrees of freedom.
    fn error_spread(&self, pixel: usize) -> f64 {
        self.squared_error(pixel).powi(2) / f64::from(self.count_at(pixel).max(2) - 1)
    }

    /// The deviation of the samples of each tile of `side` × `side` pixels, row by row: the root of their mean variance.
    pub fn deviations(&self, side: usize) -> Vec<f64> {
        let (wide, high) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let (mut sums, mut pixels) = (vec![0.0; wide * high], vec![0.0; wide * high]);
        for i in 0..self.pixels() {
            let tile = i / self.width / side * wide + i % self.width / side;
            sums[tile] += self.variance(i);
            pixels[tile] += 1.0;
        }
        sums.iter().zip(pixels).map(|(s, n): (&f64, f64)| (s / n.max(1.0)).sqrt()).collect()
    }
}

/// The samples that a view has gathered, and what is known of their error.
#[derive(Debug, Clone, Default)]
pub struct Film {
    /// The size of the picture asked for.
    pub size: [usize; 2],
    /// The samples; `stride` is 1 but for a preview. The pixels themselves are there only if somebody asked for them.
    pub main: Samples,
    /// The sums from which its error is computed.
    pub sums: Sums,
    /// The noise by a probe, once it is known.
    pub probed_noise: Option<ProbedNoise>,
    /// What the step costs by a probe, once it is known.
    pub probed_step: Option<ProbedStep>,
    /// True if the step plays no part in the picture, so that it causes no error.
    pub stepless: bool,
    /// True if its samples are random. With one sample, the error is estimated from the differences of neighbours.
    pub noisy: bool,
    /// True if the method has an error besides noise that is not measured.
    pub biased: bool,
    /// The opacity at which rays end.
    pub opacity_threshold: f64,
    /// True if the probe's rays go to their end at other steps, so that its difference has the loss of others' early end.
    pub to_the_end: bool,
    /// True if it shows a field that random work fills.
    pub has_field: bool,
    /// The error that the field causes, once it is known.
    pub field_error: Option<FieldError>,
    /// The background behind the volume.
    pub background: Background,
    /// The quality that was reduced so that the picture came in time.
    pub lowered: Lowered,
    /// What earlier pictures have shown of one that is to be in time.
    pub reduced: Option<Reduced>,
    /// The error that is asked for.
    pub asked: Option<f64>,
    /// What a planner knows of a picture made as it planned.
    pub planned: Option<Planned>,
    /// The rounds of a pilot.
    pub(crate) rounds: Vec<Arc<Round>>,
}

/// What a planner has measured of a picture that is made as it planned, relative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// An upper bound of its error after the planned samples, which 95 of 100 pictures keep; `None` if the picture is not the planned one.
    pub bound: Option<f64>,
    /// The planned samples per pixel.
    pub samples: u32,
    /// The error that it has against the scene as it was asked for, however many samples it takes.
    pub bias: f64,
}

/// What earlier pictures have shown of a picture of one sample per pixel that has no probe.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reduced {
    /// An upper bound of what its step costs, relative, if it is known.
    pub step: Option<f64>,
    /// An upper bound of its noise as a multiple of the deviation within blocks of 2 × 2 pixels, if it is known.
    pub noise: Option<f64>,
}

impl Film {
    /// The relative root-mean-square difference in luminance to another film of the same size, if both have their pixels.
    pub fn difference(&self, other: &Film) -> Option<f64> {
        if self.main.mean.len() != other.main.mean.len() || self.main.stride != other.main.stride {
            return None;
        }
        let squared: f64 =
            (0..self.main.pixels()).map(|i| (self.main.luminance(i) - other.main.luminance(i)).powi(2)).sum();
        let rms = (squared / self.main.pixels().max(1) as f64).sqrt();
        Some(self.relative(rms))
    }

    /// Divides an error by the mean luminance, if that is above 0.
    fn relative(&self, absolute: f64) -> f64 {
        let mean = self.sums.luminance / self.main.pixels().max(1) as f64;
        if mean > 0.0 { absolute / mean } else { absolute }
    }

    /// The loss of half the resolution, interpolated to this one, relative.
    pub fn resolution_loss(&self) -> f64 {
        self.relative(self.sums.of_every_second())
    }

    /// The loss of twice the step, relative, if a probe has measured it.
    pub fn step_loss_seen(&self) -> Option<f64> {
        self.probed_step.map(|step| self.relative(step.twice))
    }

    /// The bytes of the film on the device.
    pub fn bytes(&self) -> usize {
        20 * self.main.pixels()
    }
}
