//! The rounds of a picture. The difference to the picture after fewer samples tells its error, whatever its samples have in common.

/// The halves are not random if their difference is less than this part of the difference of random halves.
const WELL_SPREAD: f64 = 0.9;
/// The number of deviations of the squared difference of random halves by which the halves must be closer, so that this is not by chance.
pub(crate) const SURE: f64 = 4.0;

/// True if a picture has a round after this number of samples: 1, 2, 3, 4, 6, 8, 12, …
pub(crate) fn is_round(samples: u32) -> bool {
    samples.is_power_of_two() || (samples.is_multiple_of(3) && (samples / 3).is_power_of_two())
}

/// The numbers of samples after which a pilot has a round: 1, 2, 3, 4, 6, then every fourth to 64 and every eighth part of an octave from
/// there. The quality of evenly spread places goes up and down between these.
pub(crate) fn pilot_rounds() -> impl Iterator<Item = u32> {
    (1..5)
        .chain([6])
        .chain((8..64).step_by(4))
        .chain((3..24).flat_map(|octave| (8..16).map(move |eighth| eighth << octave)))
}

/// The picture after some samples.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    /// Samples per pixel.
    pub samples: u32,
    /// Time on the device so far.
    pub device_ms: f64,
    /// Linear luminance of every pixel.
    pub luminance: Vec<f32>,
}

impl Round {
    /// The root mean square of the difference to another round.
    pub fn apart(&self, other: &Round) -> f64 {
        let squares = self.luminance.iter().zip(&other.luminance).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        (squares.sum::<f64>() / self.luminance.len().max(1) as f64).sqrt()
    }
}

/// The difference of the first half of the samples to all of them, A − (A + B) / 2. For random samples its square is the variance of the
/// mean itself. If samples are spread evenly, as the places in a pixel are, the mean converges faster than with random ones, and the two
/// halves differ by less. They still differ by no less than the error of the mean, since each half is wrong by more than the mean of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Halves {
    /// The number of samples of both halves.
    pub samples: u32,
    /// The root mean square of the difference over the pixels, of luminance.
    pub apart: f64,
}

impl Halves {
    /// The halves from the picture after half of its samples and the picture after all of them.
    pub fn of(half: &Round, all: &Round) -> Self {
        Self { samples: all.samples, apart: half.apart(all) }
    }

    /// The square of the difference after `samples`, as that of random halves.
    pub fn squared_after(&self, samples: u32) -> f64 {
        self.apart * self.apart * f64::from(self.samples) / f64::from(samples)
    }

    /// The noise after `samples`, if it is clearly less than `random`, the noise of random samples. More samples are taken to be random.
    /// For random halves the square is `random`² on average, with a relative variance of 2/ν. The number of `pixels` that matter, ν = (Σ
    /// sᵢ²)² / Σ sᵢ⁴, may be small if only a few pixels met a firefly.
    pub fn noise(&self, samples: u32, random: f64, pixels: f64, deviations: f64) -> Option<f64> {
        let noise = self.apart * (f64::from(self.samples) / f64::from(samples)).sqrt();
        let by_chance = 1.0 - deviations * (2.0 / pixels.max(1.0)).sqrt();
        (noise < WELL_SPREAD * random && noise * noise < by_chance * random * random).then_some(noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of n samples of an edge that covers `part` of each pixel, at places n/N or by chance.
    fn edges(samples: u32, place: impl Fn(u32, usize) -> f64) -> Round {
        let part = |pixel: usize| (pixel as f64 * 0.618).fract();
        let mean = |pixel: usize| {
            let lit = (0..samples).filter(|n| place(*n, pixel) < part(pixel)).count();
            (lit as f64 / f64::from(samples)) as f32
        };
        Round { samples, device_ms: 0.0, luminance: (0..2000).map(mean).collect() }
    }

    fn truth() -> Round {
        let part = |pixel: usize| (pixel as f64 * 0.618).fract() as f32;
        Round { samples: 0, device_ms: 0.0, luminance: (0..2000).map(part).collect() }
    }

    #[test]
    fn pilots_are_looked_at_where_halves_can_be_compared() {
        let rounds: Vec<u32> = pilot_rounds().take_while(|n| *n <= 4096).collect();
        assert_eq!(rounds[..9], [1, 2, 3, 4, 6, 8, 12, 16, 20]);
        assert!(rounds.windows(2).all(|w| w[0] < w[1]), "{rounds:?}");
        assert!((0..=12).all(|power| rounds.contains(&(1 << power))), "{rounds:?}");
    }

    #[test]
    fn places_that_are_spread_evenly_are_better_than_random_ones_and_the_halves_know() {
        // Variance of a sample: the mean of p (1 − p), 1/6.
        let random = |n: u32| (1.0 / 6.0 / f64::from(n)).sqrt();
        let golden = |n: u32, _| (0.5 + f64::from(n) * 0.618_033_988_75).fract();
        for n in [32, 128, 512] {
            let (half, all) = (edges(n / 2, golden), edges(n, golden));
            let told = Halves::of(&half, &all).noise(n, random(n), 2000.0, SURE);
            let wrong = all.apart(&truth());
            assert!(told.is_some_and(|t| t >= wrong && t < 3.0 * wrong), "{n}: {told:?} of {wrong}");
        }
        let hash = |n: u32, pixel: usize| {
            let mut state = (u64::from(n) << 32 | pixel as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            state = (state ^ (state >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            ((state ^ (state >> 32)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let halves = Halves::of(&edges(16, hash), &edges(32, hash));
        assert_eq!(
            halves.noise(32, random(32), 2000.0, SURE),
            None,
            "of random ones the samples' own variance is better: {halves:?}"
        );
        assert!((halves.apart / random(32) - 1.0).abs() < 0.1, "{halves:?}");

        let lucky = Halves { samples: 32, apart: 0.8 * random(32) };
        assert_eq!(lucky.noise(32, random(32), 10.0, SURE), None, "of ten pixels that matter this says nothing");
    }
}
