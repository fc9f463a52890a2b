//! The study's arithmetic: the errors of many runs of one setting against a truth.
//!
//! For R runs of N values v_ri against t_i, with m_i the mean over the runs and s the mean of |t_i|:
//!
//! | number | formula |
//! |---|---|
//! | `rmse` | √(mean over r and i of (v_ri − t_i)²) / s |
//! | `bias` | mean over i of (m_i − t_i), over s; its interval by Student's t from the spread of the runs' own means |
//! | `bias_rms` | √(mean over i of ((m_i − t_i)² − var_i / R)) / s: the part that no further run takes away |
//! | `noise` | √(mean over i of var_i) / s, var_i the variance over the runs |
//! | `p99` | the 99th percentile of \|v_ri − t_i\| / s |

use serde::{Deserialize, Serialize};

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::error::{Error, Result};

/// The confidence level of the interval of a bias.
const CONFIDENCE: f64 = 0.95;

/// The errors of a setting's runs, relative to the mean magnitude of the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Root of the mean squared error.
    pub rmse: f64,
    /// The mean error, with its sign.
    pub bias: f64,
    /// Half of the 95 % interval of `bias`; `None` for a single run.
    pub bias_within: Option<f64>,
    /// Root of the mean squared error of the runs' mean, less its noise; `None` for a single run.
    pub bias_rms: Option<f64>,
    /// Root of the mean variance of a run; `None` for a single run.
    pub noise: Option<f64>,
    /// The error that 99 in 100 values do not exceed.
    pub p99: f64,
}

/// Compares runs with a truth.
///
/// # Errors
/// [`Error::Internal`] for a run of another number of values, no run, no truth, or values that are not finite.
pub fn measure(runs: &[Vec<f64>], truth: &[f64]) -> Result<Measured> {
    if runs.is_empty() || truth.is_empty() {
        return Err(Error::internal("nothing to compare: a run or the truth is missing"));
    }
    if let Some(other) = runs.iter().find(|r| r.len() != truth.len()) {
        return Err(Error::internal(format!("a run of {} values against a truth of {}", other.len(), truth.len())));
    }
    if !runs.iter().flatten().chain(truth).all(|v| v.is_finite()) {
        return Err(Error::internal("a value that is not finite"));
    }
    let (n, r) = (truth.len() as f64, runs.len() as f64);
    let scale = Some(truth.iter().map(|t| t.abs()).sum::<f64>() / n).filter(|s| *s > 0.0).unwrap_or(1.0);
    let errors: Vec<Vec<f64>> =
        runs.iter().map(|run| run.iter().zip(truth).map(|(v, t)| (v - t) / scale).collect()).collect();
    let squared = errors.iter().flatten().map(|e| e * e).sum::<f64>();
    let own_means: Vec<f64> = errors.iter().map(|e| e.iter().sum::<f64>() / n).collect();
    let bias = own_means.iter().sum::<f64>() / r;
    let mut magnitudes: Vec<f64> = errors.iter().flatten().map(|e| e.abs()).collect();
    magnitudes.sort_by(f64::total_cmp);
    let p99 = magnitudes[((0.99 * magnitudes.len() as f64).ceil() as usize).clamp(1, magnitudes.len()) - 1];
    let several = runs.len() > 1;
    let (mut variance, mut lasting) = (0.0, 0.0);
    for i in 0..truth.len() {
        let mean = errors.iter().map(|e| e[i]).sum::<f64>() / r;
        let own = errors.iter().map(|e| (e[i] - mean).powi(2)).sum::<f64>() / (r - 1.0).max(1.0);
        variance += own / n;
        lasting += (mean * mean - own / r) / n;
    }
    let spread = own_means.iter().map(|m| (m - bias).powi(2)).sum::<f64>() / (r - 1.0).max(1.0);
    let t = StudentsT::new(0.0, 1.0, (r - 1.0).max(1.0)).map_err(Error::internal)?.inverse_cdf(0.5 + CONFIDENCE / 2.0);
    Ok(Measured {
        rmse: (squared / n / r).sqrt(),
        bias,
        bias_within: several.then(|| t * (spread / r).sqrt()),
        bias_rms: several.then(|| lasting.max(0.0).sqrt()),
        noise: several.then(|| variance.sqrt()),
        p99,
    })
}

/// The median: the middle value, or the mean of the two in the middle; 0 for no values.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of deviation 1 in a known order: SplitMix64 through the sum of twelve uniforms.
    fn noise(seed: u64, n: usize) -> Vec<f64> {
        let mut random = crate::study::oracle::Random::new(seed);
        (0..n).map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0).collect()
    }

    fn runs(bias: f64, deviation: f64, count: usize) -> Vec<Vec<f64>> {
        let of = |seed| noise(seed, 400).into_iter().map(|e| 2.0 + 2.0 * bias + 2.0 * deviation * e).collect();
        (1..=count as u64).map(of).collect()
    }

    #[test]
    fn a_planted_bias_is_found_and_noise_is_not_taken_for_one() {
        let truth = vec![2.0; 400];
        let biased = measure(&runs(0.01, 0.05, 20), &truth).expect("a measurement");
        let within = biased.bias_within.expect("an interval");
        assert!((biased.bias - 0.01).abs() <= within && biased.bias > within, "{biased:?}");
        assert!((biased.bias_rms.expect("of several") - 0.01).abs() < 0.003, "{biased:?}");
        assert!((biased.noise.expect("of several") - 0.05).abs() < 0.002, "{biased:?}");
        assert!((biased.rmse - 0.05f64.hypot(0.01)).abs() < 0.002, "{biased:?}");
        let honest = measure(&runs(0.0, 0.05, 20), &truth).expect("a measurement");
        assert!(honest.bias.abs() <= honest.bias_within.expect("an interval"), "{honest:?}");
        assert!(honest.bias_rms.expect("of several") < 0.004, "{honest:?}");
        // One in a hundred values of normal noise is beyond 2.576 deviations.
        assert!((honest.p99 / 0.05 - 2.576).abs() < 0.12, "{honest:?}");
    }

    #[test]
    fn the_interval_holds_as_often_as_it_says() {
        let truth = vec![2.0; 30];
        let covers = |trial: u64| {
            let run = |k: u64| noise(1000 * trial + k, 30).into_iter().map(|e| 2.0 + 0.1 * e).collect();
            let found = measure(&(0..4).map(run).collect::<Vec<_>>(), &truth).expect("a measurement");
            found.bias.abs() <= found.bias_within.unwrap_or(0.0)
        };
        let held = (1..=1000).filter(|trial| covers(*trial)).count();
        // The expectation is 950 with a deviation of 7.
        assert!((925..=975).contains(&held), "{held} of 1000 intervals of four runs hold the truth");
    }

    #[test]
    fn what_cannot_be_compared_is_an_error() {
        assert!(measure(&[], &[1.0]).is_err(), "no run");
        assert!(measure(&[vec![1.0]], &[]).is_err(), "no truth");
        assert!(measure(&[vec![1.0, 2.0]], &[1.0]).is_err(), "another size");
        assert!(measure(&[vec![f64::NAN]], &[1.0]).is_err(), "not a number");
    }
}
