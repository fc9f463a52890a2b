//! The noise, in two parts that fall differently with more samples: e_n² = P_n² + J² / n.
//!
//! P_n is the error of the sample places in a pixel, at edges above all. All pilots have the picture's own places, whatever their seed. As long
//! as the picture is much the same, it is the same for every setting. J² is the variance that random numbers bring into a sample, along its path or at the start of its steps.
//! Every seed has another random part.

use std::sync::Arc;

use super::run::mean;
use crate::film::{Estimate, Round};

/// A part of the variance that is too small to look at more closely.
pub const SMALL: f64 = 0.1;
/// The greatest ratio, in variance, of the random part of the setting that looked at the places to that of another setting, so that the
/// look is good enough for the other one.
const AS_GOOD: f64 = 4.0;
/// The number of first rounds that the whole picture may have too.
const FIRST: usize = 4;

/// The error P after some samples, as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    samples: u32,
    /// P², relative.
    squared: f64,
    /// J² of the setting that was looked at, which blurs P².
    random: f64,
}

/// The error P, by the numbers of samples that were looked at.
#[derive(Debug, Clone, Default)]
pub struct Places {
    known: Vec<Known>,
    /// The squares of the differences between these samples and the first, without a random part.
    steps: Vec<(u32, f64)>,
    /// The ratio of P² in the picture to that in the pilots, and the relative amount by which it might be larger. Pilots have few of the
    /// picture's edges.
    more: f64,
    within: f64,
    /// True if more samples than were looked at are taken to be as good as they could be. A setting that might be the best is then looked
    /// at.
    pub hopeful: bool,
}

impl Places {
    /// P from two renders of the first setting with seeds of their own, relative to `scale`: the mean of (Iₙ − I_N) (I′ₙ − I′_N), in which
    /// their random parts average to nothing. `within` is the relative deviation of such squares.
    pub fn by_two(a: &[Arc<Round>], b: &[Arc<Round>], scale: f64, within: f64) -> Self {
        let (Some(last), Some(other)) = (a.last(), b.last()) else { return Self::default() };
        let (random, _) = random(a, b, scale);
        let looked_at = a.iter().zip(b).filter(|(a, _)| 2 * a.samples <= last.samples);
        let known = looked_at.map(|(a, b)| {
            let squared = apart(a, last, mean(in_common([a, last], [b, other])) / (scale * scale));
            Known { samples: a.samples, squared, random }
        });
        let more = a.iter().zip(b).take(FIRST).skip(1);
        let steps =
            more.map(|(few, other)| (few.samples, mean(in_common([&a[0], few], [&b[0], other])) / (scale * scale)));
        Self { known: known.collect(), steps: steps.collect(), more: 1.0, within, hopeful: true }
    }

    /// Takes P² from two renders as above and two `judges`, pictures of the same pixels with places of their own in each pixel: the mean of
    /// (Iₙ − A) (I′ₙ − B) is P², whatever A and B lack, since that is independent. A picture I_N of the same places is not: of many n, some are wrong as
    /// it is, and seem to be right.
    pub fn judge(&mut self, [a, b]: [&[Arc<Round>]; 2], [one, other]: [&Round; 2], random: f64, scale: f64) {
        // Of many numbers of samples the best is planned, which is the one that is underestimated most: hence a standard error more.
        let squared = |a: &Round, b: &Round| {
            let both = in_common([a, one], [b, other]).zip(in_common([a, other], [b, one]));
            let found = Estimate::mean(both.map(|(p, q)| 0.5 * (p + q)).collect::<Vec<_>>().into_iter());
            (found.value + found.error).max(0.0) / (scale * scale)
        };
        let judged = a.iter().zip(b).map(|(a, b)| Known { samples: a.samples, squared: squared(a, b), random });
        let last = a.last().map_or(0, |a| a.samples);
        let further = self.known.iter().copied().filter(|k| k.samples > last);
        self.known = judged.chain(further).collect();
    }

    /// Raises each P² to that of another look after as many samples, if that is larger.
    pub fn at_least(&mut self, other: &Self) {
        for known in &mut self.known {
            let seen = other.known.iter().find(|k| k.samples == known.samples);
            known.squared = seen.map_or(known.squared, |k| k.squared.max(known.squared));
        }
    }

    /// Adds P² from more samples of one setting of which J² is known: |Iₙ − I_N|² = P² + J² (1/n − 1/N).
    pub fn look_deeper(&mut self, rounds: &[Arc<Round>], scale: f64, random: f64) {
        let Some(last) = rounds.last() else { return };
        let seen: Vec<Known> = rounds
            .iter()
            .filter(|r| 2 * r.samples <= last.samples)
            .map(|r| {
                let by_chance = random * (1.0 / f64::from(r.samples) - 1.0 / f64::from(last.samples));
                let squared = apart(r, last, (r.apart(last) / scale).powi(2) - by_chance);
                Known { samples: r.samples, squared, random }
            })
            .collect();
        let better = |k: &Known| k.random <= random && seen.iter().any(|s| s.samples == k.samples);
        let kept: Vec<Known> = self.known.iter().copied().filter(better).collect();
        let new = seen.into_iter().filter(|s| !kept.iter().any(|k| k.samples == s.samples));
        let further = self.known.iter().copied().filter(|k| k.samples > last.samples / 2);
        self.known = kept.iter().copied().chain(new).chain(further).collect();
        self.known.sort_by_key(|k| k.samples);
    }

    /// The ratio of `squared`, the squared difference between the first sample of the whole picture and the first few, to that of the
    /// pilots.
    pub fn more_by(&self, samples: u32, squared: f64) -> f64 {
        let pilots = self.steps.iter().find(|s| s.0 == samples).map_or(0.0, |s| s.1);
        if pilots > 0.0 { squared / pilots } else { f64::INFINITY }
    }

    /// Sets the ratio of P² in the picture to that in the pilots to `more`, which may be larger by the part `within`.
    pub fn scale(&mut self, more: f64, within: f64) {
        (self.more, self.within) = (more, within);
    }

    /// The largest number of samples that was looked at.
    pub fn last(&self) -> u32 {
        self.known.last().map_or(1, |k| k.samples)
    }

    /// P² after `samples`, relative. It need not fall everywhere: places in the middle or balanced around it are better than a few more. So
    /// between two numbers that were looked at it is taken to be twice the larger, plus the weight of one place more or less, from the
    /// second sample. If P matters, no such number is planned. Beyond them it falls no faster than with evenly spread places, and no more
    /// slowly than with random ones.
    pub fn squared_after(&self, samples: f64) -> f64 {
        self.squared(samples, if self.hopeful { 2 } else { 1 })
    }

    /// P² after `samples`. Beyond the numbers that were looked at it falls by this power.
    fn squared(&self, samples: f64, power: i32) -> f64 {
        let Some(last) = self.known.last() else { return 0.0 };
        let beyond = f64::from(last.samples) / samples;
        let at = self.known.iter().position(|k| f64::from(k.samples) >= samples).unwrap_or(0);
        let squared = if beyond < 1.0 {
            last.squared * beyond.powi(power)
        } else if f64::from(self.known[at].samples) == samples {
            self.known[at].squared
        } else {
            let second = self.known.iter().find(|k| k.samples == 2).map_or(0.0, |k| k.squared);
            let larger = self.known[at].squared.max(self.known[at.saturating_sub(1)].squared);
            2.0 * larger + second * (2.0 / samples).powi(2)
        };
        squared * self.more * (1.0 + self.within)
    }

    /// True if P after `samples` of a setting with this J² is known, or too small to matter.
    pub fn is_known(&self, samples: u32, random: f64) -> bool {
        let seen = self.known.iter().find(|k| k.samples >= samples);
        seen.is_some_and(|s| s.random <= AS_GOOD * random) || self.is_small(samples, random)
    }

    /// True if P after `samples` is too small to matter beside this J², even if it falls no faster than that.
    pub fn is_small(&self, samples: u32, random: f64) -> bool {
        let n = f64::from(samples);
        self.squared(n, 1) <= SMALL * random / n
    }
}

/// P² from the squared difference to the picture of more samples. These are no truth, so the difference is taken to be as with random
/// samples, |Iₙ − I_N|² = P² (1 − n/N).
fn apart(few: &Round, more: &Round, squared: f64) -> f64 {
    squared.max(0.0) / (1.0 - f64::from(few.samples) / f64::from(more.samples))
}

/// The difference of two pictures times that of two pictures of another seed, of every pixel: (Iₙ − I_N) (I′ₙ − I′_N).
pub fn in_common<'a>(a: [&'a Round; 2], b: [&'a Round; 2]) -> impl Iterator<Item = f64> + 'a {
    let apart = |[few, more]: [&Round; 2], i: usize| f64::from(few.luminance[i]) - f64::from(more.luminance[i]);
    let products = (0..a[0].luminance.len()).map(move |i| apart(a, i) * apart(b, i));
    products.map(|p| if p.is_finite() { p } else { 0.0 })
}

/// J², relative, as half of the variance of the differences of two seeds from round to round; and the effective number of its pixels, ν =
/// (Σ Jᵢ²)² / Σ Jᵢ⁴. The square of a Jᵢ² that is known by k rounds is too large by 1 + 2/k.
pub fn random(a: &[Arc<Round>], b: &[Arc<Round>], scale: f64) -> (f64, f64) {
    let pixels = a.first().map_or(0, |r| r.luminance.len());
    let rounds = a.len().min(b.len()).max(1) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..pixels {
        let (mut fewer, mut before, mut of_pixel) = (0.0, 0.0, 0.0);
        for (a, b) in a.iter().zip(b) {
            let samples = f64::from(a.samples);
            let apart = samples * (f64::from(a.luminance[i]) - f64::from(b.luminance[i]));
            of_pixel += (apart - before).powi(2) / (2.0 * (samples - fewer)) / rounds;
            (fewer, before) = (samples, apart);
        }
        if of_pixel.is_finite() {
            sum += of_pixel;
            squares += of_pixel * of_pixel;
        }
    }
    let matter = if squares > 0.0 { sum * sum / squares * (1.0 + 2.0 / rounds) } else { 0.0 };
    (sum / pixels.max(1) as f64 / (scale * scale), matter)
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Noise of deviation 0.3.
    pub fn noise(seed: u32) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1u32 << 24)
            };
            0.3 * ((0..12).map(|_| next()).sum::<f64>() - 6.0)
        }
    }

    const PIXELS: usize = 4096;

    /// The error of this test's places in a pixel after n samples.
    fn missed(samples: u32, pixel: usize) -> f64 {
        0.8 * (pixel as f64 * 2.399).sin() / f64::from(samples)
    }

    /// A picture of 1 with random numbers of that deviation, and with an error of the places.
    fn rounds(seed: u32, deviation: f64, most: u32) -> Vec<Arc<Round>> {
        let (mut random, mut sums) = (noise(seed), vec![0.0f64; PIXELS]);
        let of = |samples: u32| {
            sums.iter_mut().for_each(|s| *s += deviation / 0.3 * random());
            let value = |i: usize| 1.0 + missed(samples, i) + sums[i] / f64::from(samples);
            Round { samples, device_ms: 0.0, luminance: (0..PIXELS).map(|i| value(i) as f32).collect() }
        };
        (1..=most).map(of).filter(|r| r.samples.is_power_of_two()).map(Arc::new).collect()
    }

    #[test]
    fn places_and_random_numbers_are_told_apart() {
        let of = |seed| rounds(seed, 0.5, 64);
        let (a, b) = (of(3), of(4));
        let (found, pixels) = random(&a, &b, 1.0);
        assert!((found / 0.25 - 1.0).abs() < 0.03, "{found}");
        assert!((pixels / PIXELS as f64 - 1.0).abs() < 0.1, "{pixels}: all of them alike");
        let mut places = Places::by_two(&a[..5], &b[..5], 1.0, 0.0);
        places.hopeful = false;
        // The first is 0.8² / 2 / n²; the rest is the part that the last picture has in common.
        let expected = |n: f64, last: f64| 0.32 * (1.0 / n - 1.0 / last).powi(2) / (1.0 - n / last);
        for n in [1.0, 2.0, 4.0] {
            let got = places.squared_after(n);
            assert!((got - expected(n, 16.0)).abs() < 0.01 / n, "{n}: {got}, {}", expected(n, 16.0));
        }
        assert_eq!(places.last(), 8);
        assert!(places.squared_after(3.0) > places.squared_after(2.0), "between two it is more than the larger");
        assert!((places.squared_after(32.0) / places.squared_after(8.0) - 0.25).abs() < 1e-9);
        assert!(places.is_known(8, 0.25) && places.is_known(1000, 10.0) && !places.is_known(16, 1e-6));

        places.look_deeper(&rounds(5, 0.05, 256), 1.0, 0.0025);
        assert_eq!(places.last(), 128);
        let got = places.squared_after(8.0);
        assert!((got / expected(8.0, 256.0) - 1.0).abs() < 0.1, "{got}: less blurred than before");
        let before = places.squared_after(8.0);
        assert!(places.more_by(4, 1.0) > 1.0 && places.more_by(5, 1.0).is_infinite());
        places.scale(2.0, 0.1);
        assert!((places.squared_after(8.0) / before - 2.2).abs() < 1e-9);
        assert!(places.is_known(128, 0.0025) && !places.is_known(8, 1e-6), "too blurred for what is less random");
    }

    #[test]
    fn judges_find_an_error_that_more_samples_share() {
        // However many samples there are, all pictures of these places are wrong by the same.
        let shared = |pixel: usize| 0.1 * (pixel as f64 * 1.7).sin();
        let of = |seed: u32, deviation: f64, shared: &dyn Fn(usize) -> f64| -> Arc<Round> {
            let mut random = noise(seed);
            let value = |i: usize| (1.0 + shared(i) + deviation / 0.3 * random()) as f32;
            Arc::new(Round { samples: 8, device_ms: 0.0, luminance: (0..PIXELS).map(value).collect() })
        };
        let [a, b] = [3, 4]
            .map(|seed| [2, 4, 8].map(|n| Arc::new(Round { samples: n, ..(*of(seed + n, 0.02, &shared)).clone() })));
        let mut places = Places::by_two(&a, &b, 1.0, 0.0);
        assert!(places.squared_after(4.0) < 1e-4, "they agree: {}", places.squared_after(4.0));
        let judges = [20, 21].map(|seed| of(seed, 0.1, &|_| 0.0));
        places.judge([&a, &b], judges.each_ref().map(|j| &**j), 0.0, 1.0);
        for n in [2.0, 4.0, 8.0] {
            let found = places.squared_after(n);
            assert!((4.5e-3..6e-3).contains(&found), "0.1² / 2, and a little more: {found}");
        }
    }
}
