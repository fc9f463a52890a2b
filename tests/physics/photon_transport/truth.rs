//! Ledger, estimators, lanes and seeds.

use cloudchamber::volume::builtin::chamber_value;
use serde_json::{Value, json};

use super::oracle::{Random, photon};
use crate::common::engine::House;

const FRACTIONS: [&str; 8] =
    ["exit_minus_x", "exit_plus_x", "exit_minus_y", "exit_plus_y", "exit_minus_z", "exit_plus_z", "absorbed", "lost"];

fn simulate(house: &House, parameters: &Value) -> Value {
    let request = json!({
        "technique": "emission_absorption", "volume": {"photon_transport": parameters},
        "image": {"width": 16, "height": 16}, "budget": {"samples": 1}
    });
    house.finish(&request).resource()["result"].clone()
}

fn fraction(result: &Value, name: &str) -> (f64, f64) {
    let entry = &result["ledger"][name];
    (entry["value"].as_f64().unwrap(), entry["standard_error"].as_f64().unwrap())
}

/// The mean and the standard error of a value over seeds.
fn over_seeds(seeds: u64, value: impl Fn(u64) -> f64) -> (f64, f64) {
    let values: Vec<f64> = (0..seeds).map(value).collect();
    let mean = values.iter().sum::<f64>() / seeds as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (seeds - 1) as f64;
    (mean, (variance / seeds as f64).sqrt())
}

#[test]
fn the_energy_ledger_closes() {
    for parameters in [
        json!({"photons": 200_000}),
        json!({"photons": 100_001, "albedo": 1}),
        json!({"photons": 100_000, "albedo": 0}),
        json!({"photons": 100_000, "extinction_scale": 0}),
        json!({"photons": 30_000, "extinction_scale": 100, "albedo": 0.99, "roulette": {"threshold": 0.5, "survival": 0.2}}),
        json!({"photons": 7, "source": {"position_mm": [0, 1, 0]}}),
        json!({"photons": 1, "source": {"position_mm": [0.5, 0.5, 0.5]}}),
    ] {
        let result = simulate(House::shared(), &parameters);
        let sum: f64 = FRACTIONS.iter().map(|f| result["ledger"][f]["value"].as_f64().unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{parameters}: the ledger adds up to {sum}");
        assert_eq!(result["faults"], 0, "{parameters}");
        assert_eq!(result["photons"], parameters["photons"], "{parameters}");
    }
}

#[test]
fn in_a_vacuum_each_face_sees_its_solid_angle() {
    // From the centre, a sixth goes to each face. z is over twenty seeds.
    for (i, face) in FRACTIONS[..6].iter().enumerate() {
        let run = |seed: u64| {
            let parameters = json!({"photons": 20_000, "extinction_scale": 0, "grid": [16, 16, 16], "seed": seed + 100 * i as u64,
                "source": {"position_mm": [0.5, 0.5, 0.5]}});
            fraction(&simulate(House::shared(), &parameters), face).0
        };
        let (mean, error) = over_seeds(20, run);
        let z = (mean - 1.0 / 6.0) / error;
        assert!(z.abs() <= 3.5, "{face}: {mean} ± {error}, z = {z}");
    }
}

#[test]
fn the_stated_standard_error_is_the_spread_of_the_runs() {
    let parameters = |seed: u64| json!({"photons": 20_000, "seed": seed, "grid": [24, 24, 24]});
    let runs: Vec<(f64, f64)> =
        (0..24).map(|s| fraction(&simulate(House::shared(), &parameters(s)), "absorbed")).collect();
    let mean = runs.iter().map(|r| r.0).sum::<f64>() / 24.0;
    let spread = (runs.iter().map(|r| (r.0 - mean).powi(2)).sum::<f64>() / 23.0).sqrt();
    let stated = runs.iter().map(|r| r.1).sum::<f64>() / 24.0;
    assert!((0.6..1.6).contains(&(stated / spread)), "stated {stated}, spread {spread}");
}

#[test]
fn the_chamber_is_what_an_independent_simulation_says() {
    let n = 24;
    let centre = |i: usize| (i as f64 + 0.5) / n as f64;
    let density = |c: [usize; 3]| chamber_value(centre(c[0]), centre(c[1]), centre(c[2]));
    let photons = 60_000;
    let mut random = Random(7);
    let (mut sum, mut squares) = ([0.0; 7], [0.0; 7]);
    for _ in 0..photons {
        for (entry, value) in photon(&mut random, &density, n, 0.8, [0.5, 0.9, 0.5]).into_iter().enumerate() {
            sum[entry] += value;
            squares[entry] += value * value;
        }
    }
    let parameters = json!({"photons": 400_000, "grid": [n, n, n], "albedo": 0.8});
    let result = simulate(House::shared(), &parameters);
    for (entry, name) in FRACTIONS[..7].iter().enumerate() {
        let mean = sum[entry] / f64::from(photons);
        let error = ((squares[entry] / f64::from(photons) - mean * mean) / f64::from(photons)).sqrt();
        let (ours, our_error) = fraction(&result, name);
        let z = (ours - mean) / error.hypot(our_error);
        assert!(z.abs() <= 3.5, "{name}: {ours} ± {our_error}, independent {mean} ± {error}, z = {z}");
    }
}

#[test]
fn a_point_light_in_a_vacuum_falls_with_the_square_of_the_distance() {
    let parameters = json!({"photons": 2_000_000, "extinction_scale": 0, "grid": [20, 20, 20], "source": {"position_mm": [0.5, 0.5, 0.5]}});
    let request = json!({
        "technique": "emission_absorption", "volume": {"photon_transport": parameters}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}
    });
    let field = House::shared().finish(&request).field().unwrap();
    for voxel in [[15, 10, 10], [10, 16, 10], [9, 10, 18], [14, 14, 14], [2, 5, 16]] {
        // The mean of 1 / (4 pi r²) over the voxel, by points.
        let (mut truth, m) = (0.0, 8);
        for i in 0..m * m * m {
            let at = |axis: usize, k: usize| (voxel[axis] as f64 + (k as f64 + 0.5) / m as f64) / 20.0 - 0.5;
            let r2 = at(0, i % m).powi(2) + at(1, i / m % m).powi(2) + at(2, i / m / m).powi(2);
            truth += 1.0 / (4.0 * std::f64::consts::PI * r2) / (m * m * m) as f64;
        }
        let got = field.values().unwrap().at(voxel[0], voxel[1], voxel[2]);
        // The number of photons that cross the voxel is two million times its solid angle. A track has a spread of about a half.
        let crossing = 2e6 * truth / 400.0;
        let z = (got / truth - 1.0) / (1.2 / crossing.sqrt());
        assert!(z.abs() <= 3.5, "{voxel:?}: {got} for {truth}, z = {z}");
    }
}

#[test]
fn both_estimators_of_the_fluence_agree() {
    let mean = |estimator: &str, seed: u64| {
        let parameters = json!({"photons": 100_000, "grid": [16, 16, 16], "estimator": estimator, "seed": seed, "extinction_scale": 3});
        let request = json!({
            "technique": "emission_absorption", "volume": {"photon_transport": parameters}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}
        });
        let field = House::shared().finish(&request).field().unwrap();
        (0..field.voxel_count()).map(|i| f64::from(field.voxels().unwrap().get_f32(i))).sum::<f64>()
    };
    let ((track, track_error), (collision, collision_error)) =
        (over_seeds(20, |s| mean("track_length", s)), over_seeds(20, |s| mean("collision", 1000 + s)));
    let z = (track - collision) / track_error.hypot(collision_error);
    assert!(z.abs() <= 3.5, "track length {track} ± {track_error}, collision {collision} ± {collision_error}, z = {z}");
}

#[test]
fn roulette_changes_no_mean() {
    let absorbed = |threshold: f64, seed: u64| {
        let parameters = json!({"photons": 20_000, "grid": [16, 16, 16], "albedo": 0.7, "seed": seed, "roulette": {"threshold": threshold, "survival": 0.2}});
        fraction(&simulate(House::shared(), &parameters), "absorbed").0
    };
    let ((often, often_error), (never, never_error)) =
        (over_seeds(20, |s| absorbed(0.6, s)), over_seeds(20, |s| absorbed(1e-6, 1000 + s)));
    let z = (often - never) / often_error.hypot(never_error);
    assert!(z.abs() <= 3.5, "roulette {often} ± {often_error}, without {never} ± {never_error}, z = {z}");
    assert!(often_error > never_error, "roulette must cost variance, or it does nothing");
}

#[test]
fn lanes_and_repeats_change_nothing() {
    let parameters = json!({"photons": 50_003, "grid": [20, 20, 20]});
    let wide = simulate(House::shared(), &parameters);
    assert_eq!(wide["ledger"], simulate(House::shared(), &parameters)["ledger"], "the same request twice");
    let narrow = simulate(House::of_lanes(1), &parameters);
    for name in FRACTIONS {
        let difference = (fraction(&wide, name).0 - fraction(&narrow, name).0).abs();
        // The photons are the same. A few meet a wall or a collision differently because of a last bit.
        assert!(
            difference < 2e-4,
            "{name}: {} with 16 lanes, {} with 1",
            fraction(&wide, name).0,
            fraction(&narrow, name).0
        );
    }
}
