//! Simulations, and their statistical tests.

use serde_json::{Value, json};

use crate::common::engine::House;
pub use crate::common::with;

/// The render request of a simulation.
pub fn request(parameters: &Value) -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"photon_transport": parameters},
        "image": {"width": 8, "height": 8}, "budget": {"samples": 1}
    })
}

/// The result of a simulation.
pub fn simulate(parameters: &Value) -> Value {
    House::shared().finish(&request(parameters)).resource()["result"].clone()
}

/// A fraction of the ledger with its standard error.
pub fn fraction(result: &Value, name: &str) -> (f64, f64) {
    let entry = &result["ledger"][name];
    (
        entry["value"].as_f64().unwrap_or_else(|| panic!("{name} in {result}")),
        entry["standard_error"].as_f64().unwrap_or(0.0),
    )
}

/// The mean and the standard error, from the spread of twenty seeds, of a value of the result.
pub fn over_seeds(parameters: &Value, value: impl Fn(&Value) -> f64) -> (f64, f64) {
    let runs: Vec<f64> = (0..20).map(|seed| value(&simulate(&with(parameters, &json!({"seed": seed}))))).collect();
    spread(&runs)
}

/// The mean and the standard error of runs.
pub fn spread(runs: &[f64]) -> (f64, f64) {
    let n = runs.len() as f64;
    let mean = runs.iter().sum::<f64>() / n;
    let variance = runs.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Judges the mean of twenty seeds against a truth that is known to `within` (one standard error).
pub fn judge(what: &str, parameters: &Value, truth: f64, within: f64, value: impl Fn(&Value) -> f64) {
    let (mean, error) = over_seeds(parameters, value);
    let z = (mean - truth) / error.hypot(within);
    assert!(z.abs() <= 3.5, "{what}: {mean} ± {error} for {truth} ± {within}, z = {z:.2}");
}

/// The excess of a sum of squared z values of `count` bins above chance, in standard deviations.
pub fn chi_squared_excess(z: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, count) = z.fold((0.0, 0usize), |(sum, n), z| (sum + z * z, n + 1));
    // Wilson & Hilferty (1931): the cube root of chi²/n is nearly normal.
    let n = count as f64;
    (((sum / n).cbrt() - (1.0 - 2.0 / (9.0 * n))) / (2.0 / (9.0 * n)).sqrt(), count)
}
