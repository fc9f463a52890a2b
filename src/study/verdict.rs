//! The findings of an experiment: a quantity measured on the way out of a method's domain, its true value, the value that a closed form
//! predicts for the method, and the verdict.

use serde::{Deserialize, Serialize};

/// The deviations of a measured mean that are taken for noise (VALIDATION.md).
const NOISE: f64 = 3.5;
/// The greatest error of single precision, relative.
const ROUNDING: f64 = 2e-5;

/// The verdict on a place in a sweep, on a sweep, or on an experiment. The later ones are worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Right to single precision.
    Exact,
    /// Not wrong by more than noise.
    Unbiased,
    /// Wrong by no more than it permits itself, or says of itself.
    Within,
    /// Wrong, with a warning.
    BiasedAndFlagged,
    /// Not a number or without bound, with a warning.
    DivergesAndFlagged,
    /// Wrong, without a warning: fails the build.
    BiasedAndSilent,
    /// Not a number or without bound, without a warning: fails the build.
    DivergesAndSilent,
}

impl Verdict {
    /// The verdict in words.
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
    /// The place: the value of the parameter of the sweep.
    pub at: f64,
    /// The measured value; `None` if it is not finite.
    pub measured: Option<f64>,
    /// Its standard error; 0 if nothing is random.
    pub standard_error: f64,
    /// The true value.
    pub truth: f64,
    /// The value that a closed form predicts for the method.
    pub predicted: Option<f64>,
    /// The permitted error, in the unit of the value: a bound that is published, or that the reply states.
    pub permitted: f64,
    /// The codes of the reply's warnings.
    pub warnings: Vec<String>,
    /// The time on the device.
    pub device_ms: f64,
}

impl Sample {
    /// The verdict on this sample.
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

    /// True if the measured value is the predicted one within noise and the part `tolerance`; `None` without a prediction.
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
    /// The permitted error of a prediction, relative, for terms that its closed form leaves out.
    pub tolerance: f64,
    /// The samples, place by place.
    pub samples: Vec<Sample>,
}

/// The relative error of a method over two parameters that matter together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    /// The title of the map.
    pub title: String,
    /// The two parameters, across and up.
    pub axes: [String; 2],
    /// The values of the parameter across.
    pub across: Vec<f64>,
    /// The values of the parameter up.
    pub up: Vec<f64>,
    /// The permitted error of a prediction, relative.
    pub tolerance: f64,
    /// The samples: a row for each of `up`, from the first.
    pub samples: Vec<Vec<Sample>>,
}

/// The findings of an experiment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    /// The parameter of the sweeps.
    pub of: String,
    /// The measured quantity, with its unit.
    pub quantity: String,
    /// The sweeps, method by method.
    pub sweeps: Vec<Sweep>,
    /// The map, if two parameters matter.
    pub heat_map: Option<HeatMap>,
}

impl Findings {
    /// Every sample with the name of its method.
    pub fn samples(&self) -> impl Iterator<Item = (&str, &Sample)> {
        let mapped = self.heat_map.iter().flat_map(|h| h.samples.iter().flatten().map(|s| (h.title.as_str(), s)));
        self.sweeps.iter().flat_map(|sweep| sweep.samples.iter().map(|s| (sweep.method.as_str(), s))).chain(mapped)
    }

    /// The worst verdict of the samples.
    pub fn verdict(&self) -> Verdict {
        self.samples().map(|(_, s)| s.verdict()).max().unwrap_or(Verdict::DivergesAndSilent)
    }

    /// The places that are not as predicted, in words.
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

    /// Keeps the warnings with these codes, and drops the others.
    pub fn keep_codes(&mut self, codes: &[&str]) {
        let mapped = self.heat_map.iter_mut().flat_map(|map| map.samples.iter_mut().flatten());
        let swept = self.sweeps.iter_mut().flat_map(|sweep| &mut sweep.samples);
        swept.chain(mapped).for_each(|sample| sample.warnings.retain(|w| codes.contains(&w.as_str())));
    }
}

impl Sweep {
    /// The worst verdict of the samples.
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
