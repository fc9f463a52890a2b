//! The error of a film, estimated from the film itself. docs/error.md has the whole.

use super::stated::{ErrorEstimate, LEAST_STATED, Unknown};
use super::{Film, Planned};

impl Film {
    /// The error, estimated from the samples and the probe.
    pub fn error(&self) -> ErrorEstimate {
        let sums = &self.sums;
        let is_whole = self.main.stride == 1;
        let noise = self.noise_squared();
        let discretisation = self.step_bound();
        let resolution = self.of_fewer_pixels().filter(|_| !is_whole);
        // A probe whose rays go to their end has measured what is behind the ends of the others.
        let is_measured = self.to_the_end && discretisation.is_some();
        let truncation = (!is_measured).then(|| (sums.truncated / self.main.pixels().max(1) as f64).sqrt());
        // The standard error is that of such pictures, not the error of this one.
        let expected = self.probed_noise.and_then(|p| p.expected).map(|part| self.random_noise().0 * part.sqrt());
        // A render that looks often enough would stop by a lucky estimate: it counts no less. The blocks of a picture of fewer pixels have its noise.
        let upper = noise.map(|n| n.upper().sqrt().max(expected.unwrap_or(0.0))).or(resolution.map(|_| 0.0));
        let rest = [resolution, truncation].into_iter().flatten();
        let own = upper.zip(discretisation).map(|(noise, step)| rest.fold(noise.hypot(step), f64::hypot));
        let relative = |absolute: f64| self.relative(absolute);
        let of_field = if self.has_field { self.field_error.map(|field| field.bound) } else { Some(0.0) };
        ErrorEstimate {
            total: own.zip(of_field).map(|(own, of_field)| relative(own).hypot(of_field)),
            noise: expected.or(noise.map(|n| n.value.max(0.0).sqrt())).map(relative),
            discretisation: discretisation.map(relative),
            resolution: resolution.map(relative),
            truncation: truncation.map(relative),
            field: self.field_error.map(|field| field.change),
            unknown: self.unknown(upper, discretisation, of_field),
            ..ErrorEstimate::default()
        }
        .beside(self.planned_now())
        .at_least(self.asked.map_or(LEAST_STATED, |asked| asked.min(LEAST_STATED)))
    }

    /// The reason for which the total is not known, from the parts that it needs.
    fn unknown(&self, noise: Option<f64>, step: Option<f64>, field: Option<f64>) -> Option<Unknown> {
        match (noise, step, field) {
            (_, None, _) if self.biased => Some(Unknown::Bias),
            (None, ..) if self.noisy && self.sums.luminance > 0.0 => Some(Unknown::Few),
            (None, ..) if self.noisy => Some(Unknown::Nothing),
            (None, ..) => Some(Unknown::Probe),
            (_, None, _) => Some(Unknown::Step),
            (.., None) if self.noisy => Some(Unknown::Hidden),
            (.., None) => Some(Unknown::Field),
            _ => None,
        }
    }

    /// What the planner knows, with its bound if this picture is the planned one.
    fn planned_now(&self) -> Option<Planned> {
        let planned = self.planned?;
        // Pilots that found nothing have not found that nothing is there, either.
        let is_nothing = self.noisy && self.sums.luminance == 0.0;
        let is_whole = self.main.stride == 1 && self.lowered.is_none() && !self.has_field && !is_nothing;
        let bound = planned.bound.filter(|_| is_whole && self.main.count >= planned.samples);
        Some(Planned { bound, ..planned })
    }

    /// The most that is likely to lie behind the opacity at which rays end, relative.
    pub fn truncation(&self) -> f64 {
        self.relative((self.sums.truncated / self.main.pixels().max(1) as f64).sqrt())
    }

    /// An upper bound of what the step costs, of luminance. It is `None` if it is not known.
    fn step_bound(&self) -> Option<f64> {
        if self.biased {
            return None;
        }
        if self.stepless {
            return Some(0.0);
        }
        match self.reduced {
            Some(reduced) => reduced.step.map(|step| self.absolute(step)),
            None => self.probed_step.map(|step| step.bound),
        }
    }

    /// The luminance of an error that is relative to the mean luminance, if that is above 0.
    fn absolute(&self, relative: f64) -> f64 {
        let mean = self.sums.luminance / self.main.pixels().max(1) as f64;
        if mean > 0.0 { relative * mean } else { relative }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bound::UPPER;
    use super::super::{Estimate, ProbedNoise, ProbedStep, Reduced, Samples, Source, Sums};
    use super::*;

    /// A film of 2 × 2 pixels of luminance 0.5 whose `count` samples have a variance of 0.09 each.
    fn film(count: u32, noise: Option<ProbedNoise>, step: Option<f64>) -> Film {
        let squared = 0.09 / f64::from(count);
        let sums =
            Sums { luminance: 2.0, noise: 4.0 * squared, noise_squares: 4.0 * squared * squared, ..Sums::default() };
        let main = Samples { width: 2, height: 2, stride: 1, count, ..Samples::default() };
        Film {
            size: [2, 2],
            main,
            sums,
            probed_noise: noise,
            probed_step: step.map(|bound| ProbedStep { bound, twice: bound }),
            opacity_threshold: 1.0,
            ..Film::default()
        }
    }

    #[test]
    fn random_noise_is_the_standard_error_of_the_mean_and_the_total_a_bound() {
        // Four samples with a variance of 0.09 a sample: the standard error is 0.3 / 2, relative to a mean of 0.5.
        let error = Film { stepless: true, noisy: true, ..film(4, None, None) }.error();
        assert!((error.noise.unwrap_or(f64::NAN) - 0.3).abs() < 1e-12, "{error:?}");
        // Four pixels: the square has a relative standard error of √(2/4).
        let bound = 0.3 * (1.0 + UPPER * 0.5f64.sqrt()).sqrt();
        assert!((error.total.unwrap_or(f64::NAN) - bound).abs() < 1e-12, "{error:?}");
    }

    #[test]
    fn what_is_not_known_is_not_zero() {
        let error = film(1, None, None).error();
        assert_eq!((error.total, error.noise, error.discretisation), (None, None, None));
        assert_eq!(error.unknown, Some(Unknown::Probe));
        let error = film(1, None, Some(0.0)).error();
        assert_eq!((error.total, error.discretisation), (None, Some(0.0)), "one sample has no noise that is known");
        let known = Some(ProbedNoise::default());
        let of = |film: Film| (film.error().total, film.error().unknown);
        assert_eq!(of(film(4, known, None)), (None, Some(Unknown::Step)), "the step has not been tried");
        assert_eq!(of(film(4, known, Some(0.1))).1, None, "all parts are known");
        let biased = Film { biased: true, ..film(4, known, Some(0.0)) };
        assert_eq!(of(biased), (None, Some(Unknown::Bias)), "a bias that is not measured");
        for (noisy, why) in [(false, Unknown::Field), (true, Unknown::Hidden)] {
            let of_field = Film { noisy, has_field: true, ..film(4, known, Some(0.0)) };
            assert_eq!(of(of_field), (None, Some(why)));
        }
        let black = Film { noisy: true, stepless: true, sums: Sums::default(), ..film(64, None, None) };
        assert_eq!((black.error().total, black.error().noise), (None, None), "nothing found yet is not nothing there");
        assert_eq!(black.error().unknown, Some(Unknown::Nothing));
        let reduced = Some(Reduced { step: Some(0.1), noise: None });
        assert_eq!(Film { reduced, ..film(1, None, None) }.error().total, None);
        // Of a moving picture earlier ones have shown the step's cost, and the noise as a multiple of the deviation within blocks, which is 0.25.
        let reduced = Some(Reduced { step: Some(0.3), noise: Some(0.8) });
        let moving = Film { reduced, ..film(1, None, None) };
        let sums = Sums { blocks: 0.0625, block_count: 1, ..moving.sums };
        let moving = Film { sums, ..moving };
        let total = moving.error().total.unwrap_or(f64::NAN);
        assert!((total - 0.5).abs() < 1e-12, "{total}");
        assert!(moving.noise_in_blocks().is_some_and(|part| (part - 0.8).abs() < 1e-12));
    }

    #[test]
    fn a_preview_of_random_paths_has_the_margin_of_few_pixels() {
        let sums = Sums { luminance: 2.0, blocks: 0.3, block_squares: 0.03, block_count: 1, ..Sums::default() };
        let main = Samples { width: 2, height: 2, stride: 4, count: 1, ..Samples::default() };
        let of =
            |noisy: bool| Film { size: [8, 8], main: main.clone(), sums, noisy, stepless: true, ..Film::default() };
        let (smooth, random) = (of(false).error().total, of(true).error().total);
        assert!((smooth.unwrap_or(0.0) - 0.3f64.sqrt() / 0.5).abs() < 1e-12, "{smooth:?}");
        // Student's 99 % point of two degrees of freedom is 6.965.
        let bound = (0.4 * (1.0 + 6.965 * (2.0f64 / 3.0).sqrt())).sqrt() / 0.5;
        assert!((random.unwrap_or(0.0) - bound).abs() < 1e-4, "three blocks: {random:?}, {bound}");
    }

    #[test]
    fn a_picture_in_which_hardly_anything_is_found_says_so() {
        let one = Sums { luminance: 2.0, blocks: 0.3, block_squares: 0.09, block_count: 1, ..Sums::default() };
        let of = |stride: usize, sums: Sums, noisy: bool| {
            let main = Samples { width: 2, height: 2, stride, count: 1, ..Samples::default() };
            let error = Film { size: [8, 8], main, sums, noisy, stepless: true, ..Film::default() }.error();
            (error.total, error.unknown)
        };
        for stride in [1, 4] {
            assert_eq!(of(stride, one, true), (None, Some(Unknown::Few)), "one block varies");
            assert_eq!(of(stride, Sums::default(), true), (None, Some(Unknown::Nothing)), "black");
        }
        assert_eq!(of(4, Sums::default(), false), (None, Some(Unknown::Probe)), "a black preview");
        let even = Sums { blocks: 0.0, block_squares: 0.0, ..one };
        assert!((of(4, even, false).0.unwrap_or(0.0) - (3.0 / 4.0f64).sqrt()).abs() < 1e-12, "an even preview");
        let reduced = Some(Reduced { step: Some(0.0), noise: Some(0.8) });
        let black = Film { reduced, sums: Sums::default(), ..film(1, None, None) }.error();
        assert_eq!((black.total, black.unknown), (None, Some(Unknown::Probe)), "a black picture of a moving camera");
    }

    #[test]
    fn what_no_path_has_met_may_still_be_there() {
        let sky = |count: u32, stride: usize| Film {
            noisy: true,
            stepless: true,
            sums: Sums { luminance: 2.0, block_count: 1, ..Sums::default() },
            main: Samples { width: 2, height: 2, stride, count, ..Samples::default() },
            ..film(count, None, None)
        };
        for (count, stride) in [(1, 1), (1, 4), (16, 1)] {
            let total = sky(count, stride).error().total.unwrap_or(f64::NAN);
            let met = (3.0 / 4.0f64).sqrt() / f64::from(count);
            assert!((total / met - 1.0).abs() < 1e-9, "{count} samples: {total}, {met}");
        }
    }

    #[test]
    fn what_cannot_be_seen_is_stated_as_the_least_that_can() {
        let of = |bound: f64, asked: Option<f64>| {
            let noiseless = ProbedNoise {
                of_random: Some(Estimate::default()),
                random: Estimate { value: 0.0225, error: 0.0 },
                ..ProbedNoise::default()
            };
            let error = Film { asked, ..film(4, Some(noiseless), Some(bound)) }.error();
            (error.total, error.discretisation)
        };
        // The step's bound is relative to a mean of 0.5.
        assert_eq!(of(1e-5, None), (Some(LEAST_STATED), Some(2e-5)));
        assert_eq!(of(1e-5, Some(3e-4)), (Some(3e-4), Some(2e-5)), "a lesser one is asked for");
        assert_eq!(of(0.0, None), (Some(0.0), Some(0.0)), "there is none");
        assert_eq!(of(0.01, Some(3e-4)).0, Some(0.02));
    }

    #[test]
    fn the_better_founded_bound_is_stated_with_its_source() {
        let own = film(4, None, Some(0.1)).error();
        let of = |bound: Option<f64>, bias: f64, count: u32| {
            let planned = Some(Planned { bound, samples: 4, bias });
            let error = Film { planned, ..film(count, None, Some(0.1)) }.error();
            (error.total, error.source)
        };
        assert_eq!((own.total, own.source, own.planned), (None, Source::Picture, None));
        assert_eq!(of(Some(0.02), 0.01, 4), (Some(0.02), Source::Plan));
        assert_eq!(of(Some(0.02), 0.01, 3), (None, Source::Picture), "fewer samples than planned");
        assert_eq!(of(None, 0.01, 4), (None, Source::Picture), "another camera");
        let known = Film { noisy: true, ..film(4, None, Some(0.1)) };
        let own = known.error().total.unwrap_or(f64::NAN);
        let with = |bound, bias| Film { planned: Some(Planned { bound, samples: 4, bias }), ..known.clone() }.error();
        let beside = with(Some(2.0 * own), 0.5 * own);
        assert_eq!((beside.source, beside.planned), (Source::Picture, Some(2.0 * own)));
        assert!((beside.total.unwrap_or(f64::NAN) - own.hypot(0.5 * own)).abs() < 1e-12, "{beside:?}");
    }

    #[test]
    fn a_probe_tells_how_well_samples_are_spread() {
        let of = |value, error| Estimate { value, error };
        let probed = ProbedNoise {
            squared: of(0.01, 0.001),
            of_random: Some(of(0.25, 0.0)),
            random: Estimate { value: 0.0225, error: 0.0 },
            expected: None,
        };
        let error = film(4, Some(probed), Some(0.03)).error();
        assert!((error.noise.unwrap_or(f64::NAN) - 0.15).abs() < 1e-12, "{error:?}");
        assert!((error.total.unwrap_or(f64::NAN) - 0.15f64.hypot(0.06)).abs() < 1e-12, "{error:?}");
        // A picture that has no variance: the probe's own noise counts.
        let error = film(1, Some(ProbedNoise { of_random: None, ..probed }), Some(0.0)).error();
        assert!((error.noise.unwrap_or(f64::NAN) - 0.2).abs() < 1e-12, "{error:?}");
        assert!((error.total.unwrap_or(f64::NAN) - (0.01f64 + UPPER * 0.001).sqrt() / 0.5).abs() < 1e-12, "{error:?}");
    }
}
