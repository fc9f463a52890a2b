//! The noise of a film: the part of its error that more samples take away.

use super::bound::UPPER;
use super::{CLOSELY, Estimate, Film};

/// What none of N paths has met happens to less than this over N of them, at 95 % (Hanley & Lippman-Hand, JAMA 249, 1983: the rule of three).
const UNMET: f64 = 3.0;

/// The least effective number of blocks of pixels whose spread tells the noise.
const FEW: f64 = 3.0;

impl Film {
    /// The standard error of the mean over random samples, of luminance, root mean square over the pixels; and the effective number of its
    /// pixels, (Σ sᵢ²)² / Σ sᵢ⁴.
    pub(crate) fn random_noise(&self) -> (f64, f64) {
        let (sum, squares) = (self.sums.noise, self.sums.noise_squares);
        ((sum / self.main.pixels().max(1) as f64).sqrt(), if squares > 0.0 { sum * sum / squares } else { 0.0 })
    }

    /// True if the samples are spread better than random ones. Then the pixels' own variances are too large.
    pub fn is_well_spread(&self) -> bool {
        let ratio = self.probed_noise.and_then(|noise| noise.of_random);
        ratio.is_some_and(|ratio| ratio.value + 2.0 * ratio.error < 1.0)
    }

    /// The square of the noise, and its standard error. It is `None` if it is not known.
    ///
    /// The samples of a pixel are spread more evenly than random ones, so their variance is too large. The probe tells by how much: the ratio is
    /// that of its pixels. One sample has no variance; the variance of blocks of pixels takes its place.
    pub(super) fn noise_squared(&self) -> Option<Estimate> {
        let count = self.main.count;
        // Of random paths, and without a probe, nothing found yet is not nothing there.
        let is_nothing = self.sums.luminance == 0.0 && (self.noisy || self.reduced.is_some());
        if self.main.stride > 1 || is_nothing || self.are_few() {
            return None;
        }
        if let Some(reduced) = self.reduced {
            return Some(Estimate { value: (reduced.noise? * self.sums.of_blocks()).powi(2), error: 0.0 });
        }
        let (random, pixels) = self.random_noise();
        let squared = random * random;
        // The squared error of a picture deviates from its own expected value by √(2/ν) of it.
        let error = if pixels > 0.0 { squared * (2.0 / pixels).sqrt() } else { 0.0 };
        let as_random = Estimate { value: squared, error };
        match self.probed_noise {
            Some(probed) if count < 2 => Some(probed.squared_of(self.sums.of_blocks().powi(2))),
            Some(probed) if count < CLOSELY => Some(probed.squared_of(squared)),
            // Places that are spread evenly are no worse than random ones.
            Some(probed) => Some(probed.squared_of(squared).at_most(as_random.upper())),
            None if !self.noisy => None,
            // The mean of a 2×2 block takes a quarter of random noise away.
            None if count < 2 => Some(self.with_unmet(self.sums.noise_of_blocks())),
            None => Some(self.with_unmet(as_random)),
        }
    }

    /// True if so few random paths have found light that their spread says nothing: one sample a pixel, of which fewer than [`FEW`] blocks vary.
    fn are_few(&self) -> bool {
        self.noisy && self.main.count < 2 && self.sums.blocks_that_matter() < FEW
    }

    /// A bound of the loss of a picture of fewer pixels than asked for. Of random paths the differences of pixels are noise, whose bound has a margin.
    /// It is `None` if the picture is black, or of too few paths.
    pub(super) fn of_fewer_pixels(&self) -> Option<f64> {
        let loss = match self.noisy {
            true => self.sums.noise_of_blocks(),
            false => Estimate { value: self.sums.of_fewer_pixels().powi(2), error: 0.0 },
        };
        (self.sums.luminance > 0.0 && !self.are_few()).then(|| self.with_unmet(loss).upper().sqrt())
    }

    /// The square of random noise. If there is none, its bound has what no path has met yet, which is taken to change a sample by the picture's mean.
    pub(super) fn with_unmet(&self, noise: Estimate) -> Estimate {
        if noise.value > 0.0 {
            return noise;
        }
        let (pixels, count) = (self.main.pixels().max(1) as f64, f64::from(self.main.count.max(1)));
        let mean = self.sums.luminance / pixels;
        Estimate { value: 0.0, error: UNMET / (pixels * count) * mean * mean / count / UPPER }
    }

    /// The upper bound of the noise as a multiple of the deviation within blocks of 2 × 2 pixels, if it is known. Another camera has about the same.
    pub fn noise_in_blocks(&self) -> Option<f64> {
        let (noise, blocks) = (self.noise_squared()?.upper().sqrt(), self.sums.of_blocks());
        Some(if blocks > 0.0 { noise / blocks } else { 1.0 })
    }
}
