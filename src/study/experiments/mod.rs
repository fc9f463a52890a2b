//! The failures of methods: a sweep out of each method's domain. Each has one file, and one line here.

mod cameras;
mod constant_grid;
mod extremes;
mod majorant;
mod march_step;
mod opacity_step;
mod optical_depth;
mod outliers;
mod photon_count;
mod resampled;
mod single_scattering;

use serde_json::{Value, json};

use super::bench::{Bench, Reads, Run};
use super::verdict::{Findings, Sample};
use super::{Scale, simulation};
use crate::error::Result;

/// A sweep out of a method's domain.
pub struct Experiment {
    /// Its name, in the name of its file and in the page.
    pub name: &'static str,
    /// Its title, a line of words.
    pub title: &'static str,
    /// The codes of the warnings that tell of the failure. Others do not count.
    pub codes: &'static [&'static str],
    /// The result of a right implementation.
    pub expected: &'static str,
    /// The function that runs it.
    pub run: fn(&Bench, Scale) -> Result<Findings>,
}

/// Every experiment.
pub const EXPERIMENTS: &[Experiment] = &[
    march_step::EXPERIMENT,
    majorant::EXPERIMENT,
    outliers::VOXEL,
    outliers::SHELL,
    constant_grid::EXPERIMENT,
    optical_depth::EXPERIMENT,
    extremes::EXPERIMENT,
    photon_count::EXPERIMENT,
    opacity_step::EXPERIMENT,
    resampled::EXPERIMENT,
    cameras::EXPERIMENT,
    single_scattering::EXPERIMENT,
];

/// Failures elsewhere that no experiment here shows yet, with the technique that would have to be there first.
pub const NOT_HERE_YET: &[[&str; 2]] = &[
    ["quadrics from 10⁻³ to 10⁶ across, grazing rays, index 1", "ray tracing of quadrics"],
    ["relaxation of SIRT from 0.5 to 2.5", "reconstruction"],
    ["CGLS, SIRT and ML-EM on noisy data, many iterations", "reconstruction"],
    ["filtered backprojection of white noise", "reconstruction"],
    ["few views, a missing wedge, truncation", "reconstruction"],
];

/// A sample of a run, with the caller's reading.
fn sample(run: &Run, at: f64, [measured, standard_error]: [f64; 2], truth: f64) -> Sample {
    Sample {
        at,
        measured: Some(measured).filter(|m| m.is_finite()),
        standard_error,
        truth,
        predicted: None,
        permitted: 0.0,
        warnings: run.codes(),
        device_ms: run.device_ms,
    }
}

/// Runs a simulation for its ledger.
fn photons(bench: &Bench, parameters: &Value) -> Result<Run> {
    bench.run(&simulation(parameters), Reads::Ledger(&[]))
}

/// The members of `base` and `more` together; `more` has precedence.
fn with(base: &Value, more: &Value) -> Value {
    let mut all = base.clone();
    for (key, value) in more.as_object().into_iter().flatten() {
        all[key] = value.clone();
    }
    all
}

/// The mean over values that are estimates of the same quantity, and its standard error.
fn mean(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    [mean, (variance / n).sqrt()]
}

/// A layer that only absorbs, 1 per mm.
fn absorbing_layer(thickness_mm: f64) -> Value {
    json!({"thickness_mm": thickness_mm, "mu_a_per_mm": 1, "mu_s_per_mm": 0, "index": 1})
}
