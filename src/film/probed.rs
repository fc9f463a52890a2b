//! What a probe tells of a picture: some of its pixels, sampled again with other random numbers and with other steps.

use super::bound::{Estimate, UPPER, matter, of_few};

/// The luminance of a pixel of the probe, to judge the noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ProbePixel {
    /// The picture itself.
    pub picture: f64,
    /// The square of the standard error that it would have if its samples were random. Of one sample that is not known: it is the variance of the
    /// block of 2 × 2 pixels that it lies in.
    pub random: f64,
    /// The same pixel by two other sets of samples, each with random places of its own, so that both are unbiased and independent. Of a picture of
    /// fewer than four samples there is one.
    pub again: [Option<f64>; 2],
}

/// The luminance of a pixel of the probe, to judge the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepPixel {
    /// One set of samples at the picture's step and at a fine one.
    pub first: [f64; 2],
    /// Another set at the same steps. Of a picture of fewer than four samples there is none.
    pub second: Option<[f64; 2]>,
    /// The first set at twice the picture's step, if there is a second one.
    pub twice: Option<f64>,
    /// The variance of its samples, of which the mean over all pixels of the picture is 1, if the probe's pixels were chosen by it.
    pub varies: Option<f64>,
}

/// The noise of a picture by its probe.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ProbedNoise {
    /// The square of the noise of luminance.
    pub squared: Estimate,
    /// The same as a part of [`ProbePixel::random`]; `None` if that is 0 in all pixels.
    pub of_random: Option<Estimate>,
    /// The mean of [`ProbePixel::random`].
    pub random: Estimate,
    /// The part of [`ProbePixel::random`] that is the expected square of the noise, whatever this picture's is; `None` if the sets have more samples
    /// than the picture.
    pub expected: Option<f64>,
}

/// What the step costs by a picture's probe.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ProbedStep {
    /// The upper bound of the error by the step, of luminance.
    pub bound: f64,
    /// The difference that twice the step makes, of luminance.
    pub twice: f64,
}

impl ProbedNoise {
    /// Judges the noise of a picture by one pixel of `per_pixel`.
    ///
    /// Let M be the picture, A and B the other sets, and I their common expected value. E (M − A)(M − B) = (M − I)², whatever M is. Of one set alone
    /// E (M − A)² = (M − I)² + E (A − I)², which is more. The error of the mean over the probe's pixels comes from A and B, and from the pixels
    /// that the probe leaves out. E (A − B)² / 2 is the expected square of the noise of either, and of a picture of as many samples; `part_of_samples` is
    /// their number as a part of the picture's.
    pub fn of(pixels: &[ProbePixel], part_of_samples: f64, per_pixel: f64) -> Self {
        let count = pixels.len().max(1) as f64;
        let squared = |p: &ProbePixel| {
            let apart = |again: Option<f64>| again.map(|a| p.picture - a);
            let [a, b] = p.again.map(apart);
            a.unwrap_or(0.0) * b.or(a).unwrap_or(0.0)
        };
        // The variance of (M − A)(M − B) given M: (M − I)² (σ_A² + σ_B²) + σ_A² σ_B².
        let within = |p: &ProbePixel| match p.again {
            [Some(a), Some(b)] => {
                let spread = (a - b).powi(2);
                spread * squared(p).abs() + 0.25 * spread * spread
            }
            _ => squared(p).powi(2),
        };
        let between = |p: &ProbePixel| match p.again {
            [Some(a), Some(b)] => 0.5 * (a - b).powi(2),
            _ => 0.0,
        };
        let part = 1.0 / per_pixel.max(1.0);
        let own: f64 = pixels.iter().map(within).sum();
        let all = Estimate::mean(pixels.iter().map(squared));
        let wider = of_few(matter(pixels.iter().map(squared)));
        let error = |sampled: f64, of: f64| ((1.0 - part) * (wider * sampled).powi(2) + part * own / (of * of)).sqrt();
        let ratio = Estimate::ratio(pixels.iter().map(|p| [squared(p), p.random]));
        let of_pixels = Estimate::mean(pixels.iter().map(|p| p.random));
        let random = count * of_pixels.value;
        Self {
            squared: Estimate { error: error(all.error, count), ..all },
            of_random: ratio.map(|ratio| Estimate { error: error(ratio.error, random), ..ratio }),
            random: Estimate { error: (1.0 - part).sqrt() * of_pixels.error, ..of_pixels },
            expected: (part_of_samples <= 1.0 && random > 0.0)
                .then(|| pixels.iter().map(between).sum::<f64>() * part_of_samples / random),
        }
    }

    /// The square of the noise of a picture whose mean of [`ProbePixel::random`] over all pixels is `random`. The probe may have missed what varies
    /// most, as edges. If it has seen less than there is, by more than chance, the rest may be as noisy as random samples, the more so the larger it is.
    pub fn squared_of(&self, random: f64) -> Estimate {
        let Some(ratio) = self.of_random else {
            return Estimate { error: self.squared.error + random / UPPER, ..self.squared };
        };
        let missed = (random - self.random.value - self.random.error).max(0.0);
        let part = if random > 0.0 { missed / random } else { 0.0 };
        let excess = missed * part * (1.0 - ratio.value.clamp(0.0, 1.0));
        Estimate { value: random * ratio.value, error: random * ratio.error + excess / UPPER }
    }
}

impl ProbedStep {
    /// Judges the step h of a picture; the fine step is h/m, with m = `shorter`.
    ///
    /// D = I(h/m) − I(h) by one set of samples and D' by another have independent noise, so the mean of D D' is that of the square of the true
    /// difference; the mean of D² alone is no less. A method of order p has I(0) − I(h) = D / (1 − m^−p), and the ratio of I(h) − I(2h) to D is
    /// (2^p − 1) / (1 − m^−p). It tells p, from 1 to 2. If rays go to their end at the fine step and at twice the step, D has what is behind the ends
    /// of the others, once. What the fine step still costs is taken to be of first order then: (I(h/m) − I(2h)) / (2m − 1).
    ///
    /// Pixels that were chosen since they vary have more of what goes with that than the picture has: a regression takes it from their means.
    pub fn of(pixels: &[StepPixel], shorter: f64, to_the_end: bool) -> Self {
        let mean = |of: &dyn Fn(&StepPixel) -> f64| {
            if pixels.iter().all(|p| p.varies.is_some()) {
                Estimate::regressed(pixels.iter().map(|p| [of(p), p.varies.unwrap_or_default()]))
            } else {
                Estimate::mean(pixels.iter().map(of))
            }
        };
        let apart = |[same, fine]: [f64; 2]| fine - same;
        let other = |p: &StepPixel| apart(p.second.unwrap_or(p.first));
        let squared = mean(&|p| apart(p.first) * other(p));
        let whole = [1, 2].map(|order| 1.0 / (1.0 - shorter.powi(-order)));
        let ratios = [whole[0], 3.0 * whole[1]];
        let longer = |p: &StepPixel| p.twice.map(|twice| p.first[0] - twice);
        let orders = pixels.iter().filter_map(|p| Some([longer(p)? * other(p), apart(p.first) * other(p)]));
        let ratio = Estimate::ratio(orders).map_or(ratios[0], |ratio| ratio.value - ratio.error);
        let second = ((ratio - ratios[0]) / (ratios[1] - ratios[0])).clamp(0.0, 1.0);
        // Of few samples, the step is taken to be of second order for twice of it.
        let to_the_end = to_the_end && pixels.iter().all(|p| p.twice.is_some());
        let longer = |p: &StepPixel| match p.twice {
            Some(twice) if to_the_end => p.first[1] - twice,
            Some(twice) => p.first[0] - twice,
            None => ratios[1] * apart(p.first),
        };
        let twice = mean(&|p| longer(p).powi(2)).value.sqrt();
        let bound = squared.upper().sqrt();
        let bound = if to_the_end {
            bound + twice / (2.0 * shorter - 1.0)
        } else {
            bound * (whole[0] + second * (whole[1] - whole[0]))
        };
        Self { bound, twice }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split_mix::SplitMix64;

    /// Uniform numbers of variance 1.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut random = SplitMix64::new(seed);
        move || 12.0f64.sqrt() * (random.unit() - 0.5)
    }

    #[test]
    fn the_noise_of_this_picture_is_found_whatever_its_samples_have_in_common() {
        let mut noise = numbers(5);
        // The picture is off by the same in all pixels: no spread of its own would tell.
        let pixel = |_| ProbePixel { picture: 1.1, random: 0.04, again: [(); 2].map(|()| Some(1.0 + 0.2 * noise())) };
        let pixels: Vec<_> = (0..4000).map(pixel).collect();
        for per_pixel in [1.0, 64.0] {
            let found = ProbedNoise::of(&pixels, 2.0, per_pixel);
            let Estimate { value, error } = found.squared;
            assert!((value - 0.01).abs() < 3.0 * error && error < 2e-3, "{found:?}");
            let ratio = found.of_random.unwrap_or_default();
            assert!((ratio.value - 0.25).abs() < 3.0 * ratio.error, "{found:?}");
            assert_eq!(found.expected, None, "the sets have more samples than the picture");
            let expected = ProbedNoise::of(&pixels, 0.5, per_pixel).expected.unwrap_or(f64::NAN);
            assert!(
                (expected / 0.5 - 1.0).abs() < 0.1,
                "half of the samples have 0.04, as much as random ones: {expected}"
            );
        }
        // One set alone has its own noise in the result.
        let alone: Vec<_> = pixels.iter().map(|p| ProbePixel { again: [p.again[0], None], ..*p }).collect();
        let found = ProbedNoise::of(&alone, 2.0, 1.0).squared;
        assert!((found.value - 0.05).abs() < 3.0 * found.error, "{found:?}");
    }

    #[test]
    fn what_the_probe_has_missed_may_be_as_noisy_as_random_samples() {
        let ratio = Estimate { value: 0.25, error: 0.0 };
        let found = ProbedNoise {
            squared: Estimate { value: 0.01, error: 0.0 },
            of_random: Some(ratio),
            random: Estimate { value: 0.04, error: 0.0 },
            expected: None,
        };
        assert!((found.squared_of(0.04).upper() - 0.01).abs() < 1e-12);
        // A picture that varies less than its probe, and one that varies by 0.02 more.
        assert!((found.squared_of(0.02).upper() - 0.005).abs() < 1e-12);
        assert!((found.squared_of(0.06).upper() - (0.015 + 0.75 * 0.02 / 3.0)).abs() < 1e-12);
        // One that varies by 0.02 more where 0.01 are chance.
        let uneven = ProbedNoise { random: Estimate { value: 0.04, error: 0.01 }, ..found };
        assert!((uneven.squared_of(0.06).upper() - (0.015 + 0.75 * 0.01 / 6.0)).abs() < 1e-12);
        // A probe that has seen nothing.
        let blind =
            ProbedNoise { of_random: None, random: Estimate::default(), squared: Estimate::default(), expected: None };
        assert!((blind.squared_of(0.06).upper() - 0.06).abs() < 1e-12);
    }

    /// Pixels with an error of `bias` at the step, of this order, and `lost` behind the ends of rays.
    fn steps(bias: f64, order: i32, shorter: f64, lost: f64) -> Vec<StepPixel> {
        let mut noise = numbers(7);
        let at = |step: f64| 1.0 - bias * step.powi(order);
        let pixel = |_| {
            let [a, b] = [0.1 * noise(), 0.1 * noise()];
            // The noise of other steps is that of the step but for a part.
            let mut other = |own: f64, step| at(step) + own + 0.01 * noise();
            let fine = shorter.recip();
            let (first, second) = ([at(1.0) + a, other(a, fine) + lost], [at(1.0) + b, other(b, fine) + lost]);
            StepPixel { first, second: Some(second), twice: Some(other(a, 2.0) + lost), varies: None }
        };
        (0..4000).map(pixel).collect()
    }

    #[test]
    fn the_error_by_the_step_is_bounded_closely_whatever_its_order() {
        for (order, shorter) in [(1, 2.0), (2, 2.0), (1, 6.0), (2, 6.0)] {
            let found = ProbedStep::of(&steps(0.05, order, shorter, 0.0), shorter, false);
            assert!(found.bound > 0.05 && found.bound < 0.06, "{order}: {found:?}");
            let twice = 0.05 * (2.0f64.powi(order) - 1.0);
            assert!((found.twice / twice - 1.0).abs() < 0.05, "{found:?}");
        }
        let none = ProbedStep::of(&steps(0.0, 1, 2.0, 0.0), 2.0, false);
        assert!(none.bound < 0.005, "{none:?}");
        // One set alone has its noise in the result.
        let alone: Vec<_> =
            steps(0.05, 1, 2.0, 0.0).iter().map(|p| StepPixel { second: None, twice: None, ..*p }).collect();
        let found = ProbedStep::of(&alone, 2.0, false);
        assert!(found.bound > 0.05 && found.bound < 0.07, "{found:?}");
    }

    #[test]
    fn pixels_that_were_chosen_since_they_vary_count_as_often_as_the_picture_has_them() {
        // One pixel of ten has an edge, and the step costs there; among the picture's it is one of a hundred.
        let mut edges = steps(0.05, 1, 2.0, 0.0);
        for (i, pixel) in edges.iter_mut().enumerate() {
            if i % 10 > 0 {
                *pixel = StepPixel { first: [1.0; 2], second: Some([1.0; 2]), twice: Some(1.0), varies: None };
            }
            pixel.varies = Some(if i % 10 > 0 { 0.0 } else { 100.0 });
        }
        let found = ProbedStep::of(&edges, 2.0, false);
        assert!(found.bound > 0.005 && found.bound < 0.007, "{found:?}");
        assert!((found.twice / 0.005 - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn what_is_behind_the_ends_of_rays_counts_once() {
        let found = ProbedStep::of(&steps(0.001, 1, 2.0, 0.1), 2.0, true);
        assert!(found.bound > 0.101 && found.bound < 0.11, "{found:?}");
        let found = ProbedStep::of(&steps(0.05, 1, 2.0, 0.0), 2.0, true);
        assert!(found.bound > 0.05 && found.bound < 0.06, "{found:?}");
    }
}
