//! The error of a film, estimated from the film itself.

use serde::Serialize;

use super::Film;
use super::rounds::SURE;
use super::sums::Apart;

/// The estimated error of a picture: root mean square over its pixels of the error of linear luminance, divided by the picture's mean
/// luminance (absolute if that is 0). A part is null if it is not known apart from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct ErrorEstimate {
    /// The error of all parts together.
    pub total: f64,
    /// The standard error of the mean over the samples. If the halves of the samples agree better than those of random ones would, it is
    /// the difference of the halves instead. They do so if the places in a pixel are spread evenly over an edge.
    pub noise: Option<f64>,
    /// The difference that halving the step made, less its noise; with that of following rays to their end, if they end early.
    pub discretisation: Option<f64>,
    /// The loss of a picture of fewer pixels than asked for.
    pub resolution: Option<f64>,
    /// The contribution from behind the opacity at which rays end. It is null if a control has measured it together with the step's.
    pub truncation: Option<f64>,
    /// The contribution of a field that is still being computed: the change since it had half its histories.
    pub field: Option<f64>,
}

/// The deviations of its noise by which the difference to the control may be wrong.
const STEP_DEVIATIONS: f64 = 2.0;

impl Film {
    /// The error, estimated from the samples alone.
    pub fn error(&self) -> ErrorEstimate {
        let sums = &self.sums;
        let pixels = self.main.pixels().max(1) as f64;
        let mean = sums.luminance / pixels;
        let relative = |absolute: f64| if mean > 0.0 { absolute / mean } else { absolute };
        let block = sums.of_blocks();
        let noise = match self.main.count {
            // The mean of a 2×2 block takes a quarter of the noise's variance away.
            0 | 1 => self.noisy.then(|| block * (4.0f64 / 3.0).sqrt()),
            _ => Some(self.known_noise(SURE).0),
        };
        let (discretisation, joint) = match (&self.control, &sums.control, self.main.stride) {
            (Some(control), Some(apart), 1) => self.against(control.count, apart),
            _ if self.stepless => (Some(0.0), None),
            _ if self.step_loss.is_some() => {
                (self.step_loss.map(|loss| if mean > 0.0 { loss * mean } else { loss }), None)
            }
            _ => (None, None),
        };
        let resolution = (self.main.stride > 1).then_some(block);
        // A control whose rays go to their end has measured what is behind the ends of the others.
        let is_measured = self.to_the_end && discretisation.or(joint).is_some();
        let truncation = (!is_measured).then(|| (sums.truncated / pixels).sqrt());
        let parts = [noise, discretisation.or(joint), resolution, truncation];
        let own = parts.iter().flatten().map(|e| e * e).sum::<f64>().sqrt();
        let total = relative(own).hypot(self.field_error.unwrap_or(0.0));
        ErrorEstimate {
            total,
            noise: noise.map(relative),
            discretisation: discretisation.map(relative),
            resolution: resolution.map(relative),
            truncation: truncation.map(relative),
            field: self.field_error,
        }
    }

    /// The most that is likely to lie behind the opacity at which rays end, relative.
    pub fn truncation(&self) -> f64 {
        self.relative((self.sums.truncated / self.main.pixels().max(1) as f64).sqrt())
    }

    /// The standard error of the mean over random samples, of luminance, root mean square over the pixels; and the effective number of its
    /// pixels, (Σ sᵢ²)² / Σ sᵢ⁴.
    pub(crate) fn random_noise(&self) -> (f64, f64) {
        let (sum, squares) = (self.sums.noise, self.sums.noise_squares);
        ((sum / self.main.pixels().max(1) as f64).sqrt(), if squares > 0.0 { sum * sum / squares } else { 0.0 })
    }

    /// The noise, and true if the samples are spread better than random ones by at least `deviations` deviations.
    pub(crate) fn known_noise(&self, deviations: f64) -> (f64, bool) {
        let (random, pixels) = self.random_noise();
        let spread = self.halves.and_then(|h| h.noise(self.main.count, random, pixels, deviations));
        spread.map_or((random, false), |noise| (noise, true))
    }

    /// The difference to the control, whose step is twice as long. A method of first order or better is at most this wrong: |I(h) − I| ≤
    /// |I(2h) − I(h)|. A sample of the control is the proper one of the same number but for its step, so most of their noise is in common. The noise
    /// of the difference is known from its halves, and it is taken off, less what it may be wrong by. Before the halves are known, it is a part of
    /// the difference. With one sample it cannot be told from the picture's own noise, and the second value is both together. The m samples of the
    /// control and the n proper ones also differ by the n − m that one of them lacks, with a variance of 1/m − 1/n of a sample's.
    fn against(&self, control_samples: u32, apart: &Apart) -> (Option<f64>, Option<f64>) {
        let (n, m) = (f64::from(self.main.count), f64::from(control_samples));
        let pixels = apart.pixels.max(1) as f64;
        if self.main.count < 2 {
            return (None, Some((apart.squared / pixels).sqrt()));
        }
        let lacking = apart.variance * (1.0 / m - 1.0 / n).abs() / pixels;
        let noise = lacking + self.step_noise.map_or(0.0, |halves| halves.squared_after(self.main.count));
        // The noise is known to a relative variance of 2/ν of its square.
        let doubt = STEP_DEVIATIONS * noise * (2.0 / pixels).sqrt();
        (Some(((apart.squared / pixels - noise).max(0.0) + doubt).sqrt()), None)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Halves, Samples, Sums};
    use super::*;

    /// A film of 2 × 2 pixels of one luminance, with `count` samples of one variance each, and a control of another luminance.
    fn film(luminance: f64, count: u32, variance: f64, control: Option<(f64, u32)>) -> Film {
        let set = |count| Samples { width: 2, height: 2, stride: 1, count, ..Samples::default() };
        let squared = variance / f64::from(count);
        let apart = |(other, _): (f64, u32)| Apart {
            squared: 4.0 * (luminance - other).powi(2),
            variance: 4.0 * variance,
            pixels: 4,
        };
        let sums = Sums {
            luminance: 4.0 * luminance,
            noise: 4.0 * squared,
            noise_squares: 4.0 * squared * squared,
            control: control.map(apart),
            ..Sums::default()
        };
        let control = control.map(|(_, count)| set(count));
        Film { size: [2, 2], main: set(count), sums, control, opacity_threshold: 1.0, ..Film::default() }
    }

    #[test]
    fn noise_is_the_standard_error_of_the_mean() {
        // Four samples with a variance of 0.09 a sample: the standard error is 0.3 / 2, relative to a mean of 0.5.
        let error = film(0.5, 4, 0.09, None).error();
        assert!((error.total - 0.3).abs() < 1e-12, "{error:?}");
        assert_eq!(error.discretisation, None);
    }

    #[test]
    fn the_control_tells_discretisation_from_noise() {
        let error = film(0.5, 100, 0.0, Some((0.6, 1))).error();
        let discretisation = error.discretisation.unwrap_or(0.0);
        assert!((discretisation - 0.2).abs() < 1e-12 && (error.total - 0.2).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn the_noise_of_the_difference_to_the_control_is_taken_off_less_its_doubt() {
        // With as many samples of both, the noise of the samples plays no part.
        let film = |step_noise| Film { step_noise, ..film(0.5, 4, 0.09, Some((0.6, 4))) };
        let of = |step_noise| film(step_noise).error().discretisation.unwrap_or(0.0);
        assert!((of(None) - 0.2).abs() < 1e-12, "before the halves are known all of it is the step's");
        // Halves of 8 samples that are 0.05 apart: of 4 samples the square is twice that.
        let (squared, doubt) = (0.01 - 0.005, 2.0 * 0.005 * 0.5f64.sqrt());
        let halves = Some(Halves { samples: 8, apart: 0.05 });
        assert!((of(halves) - 2.0 * (squared + doubt).sqrt()).abs() < 1e-12, "{}", of(halves));
    }
}
