//! The rounds of a picture: the numbers of samples at which it is looked at.

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

/// The least number of a picture's samples from which its probe looks closely.
pub(crate) const CLOSELY: u32 = 4;
/// The samples of the first pass of a probe's set: the more evenly they are spread, the closer is the bound of a picture of few samples.
pub(crate) const FIRST_PROBED: u32 = 16;
/// The most samples of a set that judges the step.
pub(crate) const MOST_FOR_STEP: u32 = 64;

/// The samples of a probe's set beside a picture of `samples` samples, if it may have `most`.
pub(crate) fn probed_samples(samples: u32, most: u32) -> u32 {
    let whole = samples.checked_ilog2().map_or(0, |power| 1 << power);
    FIRST_PROBED.max(most.min(whole))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_are_looked_at_where_halves_can_be_compared() {
        let rounds: Vec<u32> = pilot_rounds().take_while(|n| *n <= 4096).collect();
        assert_eq!(rounds[..9], [1, 2, 3, 4, 6, 8, 12, 16, 20]);
        assert!(rounds.windows(2).all(|w| w[0] < w[1]), "{rounds:?}");
        assert!((0..=12).all(|power| rounds.contains(&(1 << power))), "{rounds:?}");
    }
}
