//! Running simulations and judging them.

use cloudchamber::technique::{Kind, find};
use serde_json::{Value, json};

use super::common::engine::House;
pub use super::common::with;

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

/// Mean and standard error, from the spread of twenty seeds, of a value of the result.
pub fn over_seeds(parameters: &Value, value: impl Fn(&Value) -> f64) -> (f64, f64) {
    let runs: Vec<f64> = (0..20).map(|seed| value(&simulate(&with(parameters, &json!({"seed": seed}))))).collect();
    spread(&runs)
}

/// Mean and standard error of runs.
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

/// How many standard deviations a sum of squared z values of `count` bins is above what chance gives.
pub fn chi_squared_excess(z: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, count) = z.fold((0.0, 0usize), |(sum, n), z| (sum + z * z, n + 1));
    // Wilson & Hilferty (1931): the cube root of chi²/n is nearly normal.
    let n = count as f64;
    (((sum / n).cbrt() - (1.0 - 2.0 / (9.0 * n))) / (2.0 / (9.0 * n)).sqrt(), count)
}

#[test]
fn sums_near_the_end_of_their_range_are_flagged() {
    let Kind::Field(parse) = find("photon_transport").unwrap().kind else { panic!("not a field") };
    let small = json!({"photons": 1000, "grid": [4, 4, 4]});
    let field = parse(&small, "/volume/photon_transport", &House::shared().store).unwrap();
    let plan = field.plan().unwrap();
    let flags = |grid_sum: u64, ledger_sum: u64| {
        let (mut grid, mut ledger) = (vec![0; plan.cells], vec![0; plan.ledger]);
        (grid[5], ledger[6]) = (grid_sum, ledger_sum);
        let result = field.finish(&grid, &[ledger.clone(), ledger], 1000).unwrap().result;
        let warned = result["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "sums_overflow");
        assert_eq!(result["overflow"], warned);
        warned
    };
    assert!(!flags(1 << 60, 1 << 59), "sums with room to spare");
    assert!(flags((1 << 61) + 1, 0), "a voxel's sum");
    assert!(flags(0, (1 << 60) + 1), "the ledger's sum of two batches");
    // Wrapped round: the sum of a positive 2^63 is negative.
    assert!(flags(1 << 63, 0), "a sum that has wrapped round");
}
