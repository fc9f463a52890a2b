//! The cost of a whole picture on the device.

use crate::film::{CLOSELY, FIRST_PROBED, MOST_FOR_STEP, probed_samples};

/// The part of a probe's cost that grows with the samples of the picture, once those that judge the step have all of theirs.
const GROWING: f64 = 0.5;

/// The device times of a whole picture, ms.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cost {
    /// The time besides the samples.
    pub besides: f64,
    /// The time of a sample.
    pub sample: f64,
    /// The time of the probe beside the first samples, and once it looks closely (`src/run/probe.rs`). Random paths have none.
    pub probe: [f64; 2],
}

impl Cost {
    /// The time of a picture.
    pub fn of(&self, samples: u32) -> f64 {
        self.besides + self.sample * f64::from(samples) + self.of_probe(samples)
    }

    /// The most samples that there is time for; at least one.
    pub fn samples_in(&self, ms: f64) -> u32 {
        let samples = |besides: f64| ((ms - self.besides - besides) / self.sample).floor().max(1.0) as u32;
        samples(self.of_probe(samples(0.0)))
    }

    /// The cost of a picture that takes so many times as long.
    pub fn times(&self, factor: f64) -> Self {
        let Self { besides, sample, probe } = *self;
        Self { besides: factor * besides, sample: factor * sample, probe: probe.map(|ms| factor * ms) }
    }

    fn of_probe(&self, samples: u32) -> f64 {
        if samples < CLOSELY {
            return self.probe[0];
        }
        let sets = |most: u32| f64::from(probed_samples(samples, most)) / f64::from(FIRST_PROBED);
        self.probe[1] * (sets(MOST_FOR_STEP) + GROWING * (sets(samples) - sets(MOST_FOR_STEP)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probe_costs_as_its_samples_do() {
        let cost = Cost { besides: 1.0, sample: 2.0, probe: [3.0, 8.0] };
        assert_eq!([1, 3, 4, 31, 32].map(|n| cost.of(n)), [6.0, 10.0, 17.0, 71.0, 81.0]);
        // At 128 samples the sets that judge the step have 64: the probe costs 8 (4 + 4 / 2).
        assert_eq!(cost.of(128), 257.0 + 48.0);
        for ms in [0.5, 6.0, 17.0, 100.0, 1000.0] {
            let samples = cost.samples_in(ms);
            assert!(samples == 1 || cost.of(samples) <= ms, "{samples} samples in {ms} ms");
        }
        assert_eq!(Cost { probe: [0.0; 2], ..cost }.samples_in(8.0), 3);
        assert_eq!(cost.times(2.0).of(32), 162.0);
    }
}
