//! The film on the host: what a view has gathered so far, its estimated error, and the picture of it.

pub mod difference;
pub mod picture;

use serde::Serialize;

use picture::Background;

/// Means and squared deviations of one set of samples, as the device leaves them (`kernels/shared/film.h`).
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Width in its own pixels.
    pub width: usize,
    /// Height in its own pixels.
    pub height: usize,
    /// It holds every `stride`-th pixel of the full image.
    pub stride: usize,
    /// Samples per pixel.
    pub count: u32,
    /// Mean linear R, G, B and alpha of every pixel.
    pub mean: Vec<f32>,
    /// Sum of squared deviations of the luminance of every pixel; NaN where a sample was not finite.
    pub m2: Vec<f32>,
    /// Samples by tile, where they were put where the error is.
    pub tiles: Option<Tiles>,
}

/// How often each tile of a picture was sampled.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tiles {
    /// Pixels along a tile's side.
    pub side: usize,
    /// Tiles across.
    pub wide: usize,
    /// Samples of each pixel of a tile, row by row.
    pub counts: Vec<u32>,
}

impl Tiles {
    /// Samples of the pixel (x, y).
    pub fn count_at(&self, x: usize, y: usize) -> u32 {
        self.counts[y / self.side * self.wide + x / self.side]
    }
}

/// The luminance of linear sRGB (ITU-R BT.709), `luminance` of the kernel.
fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

impl Samples {
    /// Linear luminance of a pixel.
    pub fn luminance(&self, pixel: usize) -> f64 {
        luminance(&self.mean[4 * pixel..])
    }

    /// How many there are.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Samples of a pixel.
    fn count_at(&self, pixel: usize) -> u32 {
        match &self.tiles {
            Some(tiles) => tiles.count_at(pixel % self.width, pixel / self.width),
            None => self.count,
        }
    }

    /// Variance of one sample of a pixel's luminance; 0 where there is but one, NaN where a sample was not finite.
    fn known_variance(&self, pixel: usize) -> f64 {
        let count = self.count_at(pixel);
        if count < 2 { 0.0 } else { f64::from(self.m2[pixel]) / f64::from(count - 1) }
    }

    /// The same, 0 where it is not known.
    fn variance(&self, pixel: usize) -> f64 {
        Some(self.known_variance(pixel)).filter(|v| v.is_finite()).unwrap_or(0.0)
    }

    /// The square of the standard error of a pixel's luminance; NaN where a sample was not finite.
    fn squared_error(&self, pixel: usize) -> f64 {
        self.known_variance(pixel) / f64::from(self.count_at(pixel).max(1))
    }

    /// What a pixel adds to the denominator of Welch's degrees of freedom: its squared error's square over its own.
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

    /// Pixels of which a sample was not finite.
    pub fn unknown_pixels(&self) -> usize {
        self.m2.iter().filter(|v| !v.is_finite()).count()
    }

    fn mean_luminance(&self) -> f64 {
        (0..self.pixels()).map(|i| self.luminance(i)).sum::<f64>() / self.pixels().max(1) as f64
    }

    /// Root mean square of the deviation from the mean of each 2×2 block: what half the resolution would lose, which bounds
    /// what this resolution loses on a picture that is smooth at its scale.
    fn resolution_error(&self) -> f64 {
        let (mut sum, mut blocks) = (0.0, 0usize);
        for y in (0..self.height.saturating_sub(1)).step_by(2) {
            for x in (0..self.width.saturating_sub(1)).step_by(2) {
                let at = y * self.width + x;
                let four = [at, at + 1, at + self.width, at + self.width + 1].map(|i| self.luminance(i));
                let mean = four.iter().sum::<f64>() / 4.0;
                sum += four.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 4.0;
                blocks += 1;
            }
        }
        (sum / blocks.max(1) as f64).sqrt()
    }
}

/// The estimated error of a picture: root mean square over its pixels of the error of linear luminance, divided by the
/// picture's mean luminance (absolute where that is 0). A part is null where it is not known apart from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Standard error of the mean over the samples.
    pub noise: Option<f64>,
    /// The difference that halving the step made, less its noise.
    pub discretisation: Option<f64>,
    /// What a picture of fewer pixels than asked for leaves out.
    pub resolution: Option<f64>,
    /// What lies behind the opacity at which rays end.
    pub truncation: Option<f64>,
    /// What a field that is still being computed contributes: the change since it had half its histories.
    pub field: Option<f64>,
}

/// What a view has gathered: its samples, and those of a control at twice the step on every second pixel.
#[derive(Debug, Clone, Default)]
pub struct Film {
    /// Size of the picture asked for.
    pub size: [usize; 2],
    /// The samples; `stride` is 1 but for a preview.
    pub main: Samples,
    /// The control, if there is one yet.
    pub control: Option<Samples>,
    /// Whether a sample of the control is that of the same number of the others but for its step: nothing random is in them.
    pub paired: bool,
    /// Whether the step plays no part in the picture: there is no error of it.
    pub stepless: bool,
    /// Whether its samples are random: of one sample the error is told from how neighbours differ.
    pub noisy: bool,
    /// Opacity at which rays end.
    pub opacity_threshold: f64,
    /// Relative change of the picture since the field had half its histories.
    pub field_error: Option<f64>,
    /// What is behind the volume.
    pub background: Background,
}

impl Film {
    /// The error as it can be told from the samples alone.
    pub fn error(&self) -> ErrorEstimate {
        let mean = self.main.mean_luminance();
        let relative = |absolute: f64| if mean > 0.0 { absolute / mean } else { absolute };
        let pixels = self.main.pixels().max(1) as f64;
        let squared = |i: usize| Some(self.main.squared_error(i)).filter(|e| e.is_finite()).unwrap_or(0.0);
        let noise = match self.main.count {
            // Of noise a 2×2 block's mean takes a quarter of the variance away.
            0 | 1 => self.noisy.then(|| self.main.resolution_error() * (4.0f64 / 3.0).sqrt()),
            _ => Some(((0..self.main.pixels()).map(squared).sum::<f64>() / pixels).sqrt()),
        };
        let truncation = self.truncation();
        let (discretisation, joint) = match (&self.control, self.main.stride) {
            (Some(control), 1) => self.against(control),
            _ if self.stepless => (Some(0.0), None),
            _ => (None, None),
        };
        let resolution = (self.main.stride > 1).then(|| self.main.resolution_error());
        let parts = [noise, discretisation.or(joint), resolution, Some(truncation)];
        let own = parts.iter().flatten().map(|e| e * e).sum::<f64>().sqrt();
        let total = relative(own).hypot(self.field_error.unwrap_or(0.0));
        ErrorEstimate {
            total,
            noise: noise.map(relative),
            discretisation: discretisation.map(relative),
            resolution: resolution.map(relative),
            truncation: Some(relative(truncation)),
            field: self.field_error,
        }
    }

    /// The difference to the control, whose step is twice as long. A method of first order or better is at most this wrong:
    /// |I(h) − I| ≤ |I(2h) − I(h)|. With two samples or more the noise of both is taken off and the rest is discretisation;
    /// with one sample the two cannot be told apart, and the second value is both together. Samples that are paired have their
    /// noise in common: what the m of the control and the n proper differ by without a change of step is that of the n − m that
    /// only one has, with a variance of 1/m − 1/n of a sample's.
    fn against(&self, control: &Samples) -> (Option<f64>, Option<f64>) {
        let n = f64::from(self.main.count);
        let m = f64::from(control.count);
        let (mut squared, mut noise, mut pixels) = (0.0, 0.0, 0usize);
        for y in 0..control.height {
            for x in 0..control.width {
                let at = (y * control.stride) * self.main.width + x * control.stride;
                squared += (self.main.luminance(at) - control.luminance(y * control.width + x)).powi(2);
                noise +=
                    self.main.variance(at) * if self.paired { (1.0 / m - 1.0 / n).abs() } else { 1.0 / n + 1.0 / m };
                pixels += 1;
            }
        }
        let pixels = pixels.max(1) as f64;
        if self.main.count < 2 {
            return (None, Some((squared / pixels).sqrt()));
        }
        (Some(((squared - noise) / pixels).max(0.0).sqrt()), None)
    }

    /// Rays that ended early leave out what is behind: at most what is in front of it, times what still gets through.
    fn truncation(&self) -> f64 {
        let ended = |i: usize| {
            let through = 1.0 - f64::from(self.main.mean[4 * i + 3]);
            if through <= 1.0 - self.opacity_threshold {
                (through.max(0.0) * self.main.luminance(i)).powi(2)
            } else {
                0.0
            }
        };
        ((0..self.main.pixels()).map(ended).sum::<f64>() / self.main.pixels().max(1) as f64).sqrt()
    }

    /// Relative root-mean-square difference in luminance to another film of the same size.
    pub fn difference(&self, other: &Film) -> Option<f64> {
        if self.main.mean.len() != other.main.mean.len() || self.main.stride != other.main.stride {
            return None;
        }
        let squared: f64 =
            (0..self.main.pixels()).map(|i| (self.main.luminance(i) - other.main.luminance(i)).powi(2)).sum();
        let rms = (squared / self.main.pixels().max(1) as f64).sqrt();
        let mean = self.main.mean_luminance();
        Some(if mean > 0.0 { rms / mean } else { rms })
    }

    /// The luminance of all samples together.
    pub fn luminance_sum(&self) -> f64 {
        (0..self.main.pixels()).map(|i| self.main.luminance(i) * f64::from(self.main.count_at(i))).sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let held = |s: &Samples| 4 * (s.mean.len() + s.m2.len());
        held(&self.main) + self.control.as_ref().map_or(0, held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(stride: usize, count: u32, luminances: &[f32], m2: f32) -> Samples {
        let mean = luminances.iter().flat_map(|&l| [l, l, l, 0.5]).collect();
        let width = 2;
        let height = luminances.len() / width;
        Samples { width, height, stride, count, mean, m2: vec![m2; luminances.len()], tiles: None }
    }

    #[test]
    fn noise_is_the_standard_error_of_the_mean() {
        // Four samples with a variance of 0.09 a sample: the standard error is 0.3 / 2, relative to a mean of 0.5.
        let main = samples(1, 4, &[0.5; 4], 3.0 * 0.09);
        let error = Film { size: [2, 2], main, opacity_threshold: 1.0, ..Film::default() }.error();
        assert!((error.total - 0.3).abs() < 1e-6, "{error:?}");
        assert_eq!(error.discretisation, None);
    }

    #[test]
    fn the_control_tells_discretisation_from_noise() {
        let main = samples(1, 100, &[0.5; 4], 0.0);
        let control = Samples {
            width: 1,
            height: 1,
            stride: 2,
            count: 1,
            mean: vec![0.6, 0.6, 0.6, 0.5],
            m2: vec![0.0],
            tiles: None,
        };
        let film = Film { size: [2, 2], main, control: Some(control), opacity_threshold: 1.0, ..Film::default() };
        let error = film.error();
        assert!(
            (error.discretisation.unwrap_or(0.0) - 0.2).abs() < 1e-5 && (error.total - 0.2).abs() < 1e-5,
            "{error:?}"
        );
    }

    #[test]
    fn paired_samples_have_their_noise_in_common() {
        // As many samples of both: what they differ by is the step's doing, whatever the noise.
        let sample = |luminance: f32| samples(1, 4, &[luminance; 4], 3.0 * 0.09);
        let film = |paired: bool| Film {
            size: [2, 2],
            main: sample(0.5),
            control: Some(sample(0.6)),
            paired,
            opacity_threshold: 1.0,
            ..Film::default()
        };
        assert!((film(true).error().discretisation.unwrap_or(0.0) - 0.2).abs() < 1e-5);
        assert_eq!(film(false).error().discretisation, Some(0.0));
    }

    #[test]
    fn srgb_is_the_standard_curve() {
        for (linear, byte) in [(0.0, 0), (0.0031308, 10), (0.2158605, 128), (0.5, 188), (1.0, 255), (7.0, 255)] {
            let film = Film { size: [2, 1], main: samples(1, 1, &[linear; 2], 0.0), ..Film::default() };
            assert_eq!(film.srgb8().0[0], byte, "at {linear}");
        }
    }
}
