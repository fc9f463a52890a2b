//! What an experiment finds: a quantity measured on the way out of a method's domain, what it should be, what a closed form says
//! that the method makes of it, and the verdict of these.

use serde::{Deserialize, Serialize};

/// Deviations of a measured mean that are taken for noise (VALIDATION.md).
const NOISE: f64 = 3.5;
/// What single precision may be wrong by, relative.
const ROUNDING: f64 = 2e-5;

/// What is made of a place in a sweep, of a sweep, or of an experiment: the later, the worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Right to single precision.
    Exact,
    /// What it is wrong by is not told from noise.
    Unbiased,
    /// Wrong by no more than it permits itself, or says of itself.
    Within,
    /// Wrong, and says so.
    BiasedAndFlagged,
    /// Not a number or without bound, and says so.
    DivergesAndFlagged,
    /// Wrong, and says nothing: fails the build.
    BiasedAndSilent,
    /// Not a number or without bound, and says nothing: fails the build.
    DivergesAndSilent,
}

impl Verdict {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Unbiased => "unbiased",
            Self::Within => "within",
            Self::BiasedAndFlagged => "biased and flagged",
            Self::DivergesAndFlagged => "diverges and flagged",
            Self::BiasedAndSilent => "biased and silent",
            Self::DivergesAndSilent => "diverges and silent",
        }
    }

    /// True if the build may go on.
    pub fn is_told(self) -> bool {
        self < Self::BiasedAndSilent
    }
}

/// One place in a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Where.
    pub at: f64,
    /// What was measured; none where it is not finite.
    pub measured: Option<f64>,
    /// Its standard error; 0 where nothing is random.
    pub standard_error: f64,
    /// What it should be.
    pub truth: f64,
    /// What a closed form says that the method makes of it.
    pub predicted: Option<f64>,
    /// What it may be wrong by, in its own unit: a bound that is published, or that the reply states.
    pub permitted: f64,
    /// The codes of the reply's warnings.
    pub warnings: Vec<String>,
    /// Time on the device.
    pub device_ms: f64,
}

impl Sample {
    /// What is made of it.
    pub fn verdict(&self) -> Verdict {
        let flagged = !self.warnings.is_empty();
        let Some(measured) = self.measured else {
            return if flagged { Verdict::DivergesAndFlagged } else { Verdict::DivergesAndSilent };
        };
        let error = (measured - self.truth).abs();
        let rounding = ROUNDING * self.truth.abs().max(measured.abs());
        match self.standard_error {
            se if se == 0.0 && error <= rounding => Verdict::Exact,
            se if error <= NOISE * se + rounding => Verdict::Unbiased,
            se if error <= self.permitted + NOISE * se => Verdict::Within,
            _ if flagged => Verdict::BiasedAndFlagged,
            _ => Verdict::BiasedAndSilent,
        }
    }

    /// True if it is what was predicted, give or take noise and the part `tolerance`; none without a prediction.
    pub fn as_predicted(&self, tolerance: f64) -> Option<bool> {
        let predicted = self.predicted?;
        let within = NOISE * self.standard_error + tolerance * predicted.abs().max(self.truth.abs());
        Some(self.measured.is_some_and(|m| (m - predicted).abs() <= within))
    }
}

/// A sweep of one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// The technique with its options.
    pub method: String,
    /// What a prediction may be off by, relative: terms that its closed form leaves out.
    pub tolerance: f64,
    /// Place by place.
    pub samples: Vec<Sample>,
}

/// Two parameters that matter together: what a method is wrong by, relative.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    /// What it is a map of.
    pub title: String,
    /// The two parameters, across and up,
    pub axes: [String; 2],
    /// and their values.
    pub across: Vec<f64>,
    /// See `across`.
    pub up: Vec<f64>,
    /// What a prediction may be off by, relative.
    pub tolerance: f64,
    /// The samples: a row for each of `up`, from the first.
    pub samples: Vec<Vec<Sample>>,
}

/// What an experiment found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    /// What the sweeps go along.
    pub of: String,
    /// What is measured, with its unit.
    pub quantity: String,
    /// Method by method.
    pub sweeps: Vec<Sweep>,
    /// Where two parameters matter.
    pub heat_map: Option<HeatMap>,
}

impl Findings {
    /// Every sample with the name of its method.
    pub fn samples(&self) -> impl Iterator<Item = (&str, &Sample)> {
        let mapped = self.heat_map.iter().flat_map(|h| h.samples.iter().flatten().map(|s| (h.title.as_str(), s)));
        self.sweeps.iter().flat_map(|sweep| sweep.samples.iter().map(|s| (sweep.method.as_str(), s))).chain(mapped)
    }

    /// The worst of the samples'.
    pub fn verdict(&self) -> Verdict {
        self.samples().map(|(_, s)| s.verdict()).max().unwrap_or(Verdict::DivergesAndSilent)
    }

    /// Places that are not what was predicted, in words.
    pub fn surprises(&self) -> Vec<String> {
        let of = |sweep: &Sweep| {
            let off = sweep.samples.iter().filter(|s| s.as_predicted(sweep.tolerance) == Some(false));
            off.map(|s| {
                let measured = s.measured.unwrap_or(f64::NAN);
                let predicted = s.predicted.unwrap_or(f64::NAN);
                format!("{}, {} {}: {measured} for {predicted} ± {}", sweep.method, self.of, s.at, s.standard_error)
            })
            .collect::<Vec<_>>()
        };
        let mapped = self.heat_map.iter().flat_map(|map| {
            map.samples.iter().enumerate().map(|(row, samples)| Sweep {
                method: format!("{}, {} {}", map.title, map.axes[1], map.up[row]),
                tolerance: map.tolerance,
                samples: samples.clone(),
            })
        });
        self.sweeps.iter().cloned().chain(mapped).flat_map(|sweep| of(&sweep)).collect()
    }

    /// Leaves of the warnings those that tell of what is looked at.
    pub fn keep_codes(&mut self, codes: &[&str]) {
        let mapped = self.heat_map.iter_mut().flat_map(|map| map.samples.iter_mut().flatten());
        let swept = self.sweeps.iter_mut().flat_map(|sweep| &mut sweep.samples);
        swept.chain(mapped).for_each(|sample| sample.warnings.retain(|w| codes.contains(&w.as_str())));
    }
}

impl Sweep {
    /// The worst of the samples'.
    pub fn verdict(&self) -> Verdict {
        self.samples.iter().map(Sample::verdict).max().unwrap_or(Verdict::DivergesAndSilent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(measured: f64, standard_error: f64, permitted: f64, warnings: &[&str]) -> Sample {
        let warnings = warnings.iter().map(|w| (*w).to_owned()).collect();
        let measured = Some(measured).filter(|m| m.is_finite());
        Sample { at: 1.0, measured, standard_error, truth: 1.0, predicted: None, permitted, warnings, device_ms: 0.0 }
    }

    #[test]
    fn a_planted_bias_is_silent_until_it_is_flagged() {
        assert_eq!(sample(1.000_001, 0.0, 0.0, &[]).verdict(), Verdict::Exact);
        assert_eq!(sample(1.03, 0.01, 0.0, &[]).verdict(), Verdict::Unbiased);
        assert_eq!(sample(1.03, 0.0, 0.05, &[]).verdict(), Verdict::Within);
        assert_eq!(sample(1.05, 0.01, 0.0, &[]).verdict(), Verdict::BiasedAndSilent);
        assert_eq!(sample(1.05, 0.01, 0.0, &["march_bias"]).verdict(), Verdict::BiasedAndFlagged);
        assert_eq!(sample(f64::NAN, 0.01, 9.0, &[]).verdict(), Verdict::DivergesAndSilent);
        assert_eq!(sample(f64::NAN, 0.01, 9.0, &["sums_overflow"]).verdict(), Verdict::DivergesAndFlagged);
        let of = |samples| Sweep { method: "m".into(), tolerance: 0.0, samples };
        let good = of(vec![sample(1.0, 0.0, 0.0, &[])]);
        let bad = of(vec![sample(1.0, 0.0, 0.0, &[]), sample(2.0, 0.1, 0.0, &[])]);
        let found = Findings { sweeps: vec![good, bad], ..Findings::default() };
        assert!(!found.verdict().is_told(), "the worst place is the verdict");
        assert!(!Findings::default().verdict().is_told(), "nothing measured is no verdict");
    }

    #[test]
    fn what_is_not_as_predicted_is_told() {
        let mut planted = sample(0.9, 0.01, 1.0, &[]);
        assert_eq!(planted.as_predicted(0.0), None);
        planted.predicted = Some(0.88);
        assert_eq!(planted.as_predicted(0.0), Some(true));
        planted.predicted = Some(0.8);
        assert_eq!(planted.as_predicted(0.0), Some(false));
        let sweep = Sweep { method: "m".into(), tolerance: 0.0, samples: vec![planted] };
        assert_eq!(Findings { sweeps: vec![sweep], ..Findings::default() }.surprises().len(), 1);
    }
}
