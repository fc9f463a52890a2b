//! How wrong a film is, as far as it can tell from itself.

use serde::Serialize;

use super::rounds::SURE;
use super::sums::Sums;
use super::{Film, Samples};

/// The estimated error of a picture: root mean square over its pixels of the error of linear luminance, divided by the
/// picture's mean luminance (absolute where that is 0). A part is null where it is not known apart from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Standard error of the mean over the samples; where the halves of them agree better than those of random ones would, as where the
    /// places in a pixel are spread evenly over an edge, what the halves differ by.
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

impl Film {
    /// The error as it can be told from the samples alone.
    pub fn error(&self) -> ErrorEstimate {
        self.error_of(&self.sums())
    }

    /// The error, of the sums over all samples.
    pub(super) fn error_of(&self, sums: &Sums) -> ErrorEstimate {
        let pixels = self.main.pixels().max(1) as f64;
        let mean = sums.luminance / pixels;
        let relative = |absolute: f64| if mean > 0.0 { absolute / mean } else { absolute };
        let block = (sums.blocks / sums.block_count.max(1) as f64).sqrt();
        let noise = match self.main.count {
            // Of noise a 2×2 block's mean takes a quarter of the variance away.
            0 | 1 => self.noisy.then(|| block * (4.0f64 / 3.0).sqrt()),
            _ => Some(self.noise_of(sums, SURE).0),
        };
        let truncation = (sums.truncated / pixels).sqrt();
        let (discretisation, joint) = match (&self.control, self.main.stride) {
            (Some(control), 1) => self.against(control),
            _ if self.stepless => (Some(0.0), None),
            _ if self.step_loss.is_some() => {
                (self.step_loss.map(|loss| if mean > 0.0 { loss * mean } else { loss }), None)
            }
            _ => (None, None),
        };
        let resolution = (self.main.stride > 1).then_some(block);
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

    /// The standard error of the mean over random samples, of luminance, root mean square over the pixels; and how many pixels it is of:
    /// (Σ sᵢ²)² / Σ sᵢ⁴.
    pub(crate) fn random_noise(&self) -> (f64, f64) {
        self.random_noise_of(&self.sums())
    }

    fn random_noise_of(&self, sums: &Sums) -> (f64, f64) {
        let (sum, squares) = (sums.noise, sums.noise_squares);
        ((sum / self.main.pixels().max(1) as f64).sqrt(), if squares > 0.0 { sum * sum / squares } else { 0.0 })
    }

    /// The noise, and whether the samples are spread better than random ones, by so many `deviations`.
    pub(crate) fn known_noise(&self, deviations: f64) -> (f64, bool) {
        self.noise_of(&self.sums(), deviations)
    }

    fn noise_of(&self, sums: &Sums, deviations: f64) -> (f64, bool) {
        let (random, pixels) = self.random_noise_of(sums);
        let spread = self.halves.and_then(|h| h.noise(self.main.count, random, pixels, deviations));
        spread.map_or((random, false), |noise| (noise, true))
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
}
