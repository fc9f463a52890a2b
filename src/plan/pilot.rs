//! Pilots: a few thousand pixels of the picture itself with each candidate. They tell its cost on this device, and its error.
//!
//! The squared bias is the mean over the pixels of d₁ d₂, where d is the difference to the reference with seeds of their own. The noise of
//! the two is independent and averages to nothing, and the places in a pixel are the same for both. The part of the error that more samples
//! take away is in `noise`.

use super::cost::Cost;
use super::noise::Places;
use super::run::mean;
use crate::technique::Setting;

/// The approximate number of pixels of a pilot.
pub const PIXELS: f64 = 4096.0;
/// The samples of a pilot.
pub const SAMPLES: u32 = 16;
/// The deviations that one value in twenty is beyond, on one side.
const ONE_IN_TWENTY: f64 = 1.645;
/// The number of groups of pixels. Their spread tells the deviation of a bias.
const GROUPS: usize = 16;

/// The findings of a pilot.
#[derive(Clone)]
pub struct Pilot {
    /// The setting of the pilot.
    pub setting: Setting,
    /// J² of `noise`, relative: the variance that random numbers bring into a sample.
    pub random: f64,
    /// The factor by which the random part of a picture's error may be larger by chance.
    pub chance: f64,
    /// The bias, relative. More samples do not take it away.
    pub bias: f64,
    /// The amount by which the bias might be larger.
    pub bias_within: f64,
    /// The mean luminance that these are relative to.
    pub scale: f64,
    /// The device time of a sample of a pixel, ms.
    pub ms_per_sample: f64,
    /// The cost of the whole picture, once it was begun.
    pub whole: Option<Cost>,
}

impl Pilot {
    /// The square of the noise after `samples`, with the random part of the error times `by_chance`.
    pub fn squared_after(&self, samples: f64, places: &Places, by_chance: f64) -> f64 {
        places.squared_after(samples) + by_chance * by_chance * self.random / samples
    }

    /// The whole error after `samples`.
    pub fn error_after(&self, samples: f64, places: &Places) -> f64 {
        (self.squared_after(samples, places, 1.0) + self.bias * self.bias).sqrt()
    }

    /// The fewest samples after which the error is at most `error`; `None` if the bias or the limit of samples is in the way.
    pub fn samples_for(&self, error: f64, places: &Places, most: u32) -> Option<u32> {
        let room = error * error - (self.bias + self.bias_within).powi(2);
        let enough = |n: u32| self.squared_after(f64::from(n), places, self.chance) <= room;
        // The error need not fall everywhere among the numbers that were looked at; beyond them, it does.
        let last = places.last().min(most);
        let looked_at = (1..=last).find(|n| room > 0.0 && enough(*n));
        looked_at.or_else(|| {
            (room > 0.0 && enough(most)).then(|| {
                let (mut low, mut high) = (last, most);
                while high - low > 1 {
                    let middle = low + (high - low) / 2;
                    if enough(middle) { high = middle } else { low = middle }
                }
                high
            })
        })
    }
}

/// The relative deviation of a mean of squares over so many pixels.
pub fn deviation(pixels: f64) -> f64 {
    (2.0 / pixels.max(1.0)).sqrt()
}

/// The factor by which the random part of a picture's error may exceed its deviation, in 19 of 20 cases. Its square has a relative variance
/// of 2/ν, where ν is the number of `pixels` that matter. The estimate of it has such a variance too, with ν = `numbers`.
pub fn chance(pixels: f64, numbers: f64) -> f64 {
    let variance = 2.0 / pixels.max(1.0) + 2.0 / numbers.max(1.0);
    (1.0 + ONE_IN_TWENTY * variance.sqrt()).sqrt()
}

/// The root of the mean of the products d₁ d₂ of the pixels, and the amount by which it might be larger: two deviations, by the spread over
/// groups of pixels.
pub fn lasting(products: Vec<f64>) -> (f64, f64) {
    let count = GROUPS.min(products.len());
    let groups: Vec<f64> = (0..count).map(|g| mean(products.iter().skip(g).step_by(count).copied())).collect();
    let middle = mean(groups.iter().copied());
    let spread = match count {
        0 | 1 => middle.abs(),
        n => (mean(groups.iter().map(|g| (g - middle).powi(2))) / (n - 1) as f64).sqrt(),
    };
    let bias = middle.max(0.0).sqrt();
    (bias, (middle.max(0.0) + 2.0 * spread).sqrt() - bias)
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::noise;
    use super::*;

    #[test]
    fn a_planted_loss_is_found_under_noise_ten_times_as_large() {
        let mut random = noise(7);
        let mut products = |missing: f64| -> Vec<f64> {
            let mut difference = || random() - random() - missing;
            (0..4096).map(|_| difference() * difference()).collect()
        };
        let (bias, within) = lasting(products(0.03));
        assert!((bias - 0.03).abs() < within + 0.03 && bias + within > 0.03, "{bias} + {within}");
        let (bias, within) = lasting(products(0.0));
        assert!(bias + within < 0.12, "{bias} + {within}: nothing is missing");
    }
}
