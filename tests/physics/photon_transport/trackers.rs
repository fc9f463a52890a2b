//! Trackers and estimators against each other and against the theory of their bias.

use serde_json::{Value, json};

use super::published::slab;
use super::run::{chi_squared_excess, fraction, judge, request, simulate, spread, with};
use crate::common::engine::House;

/// A medium that only absorbs, 1 per mm, and that is so deep that nothing gets through. The mean path is the mean free path.
fn free_paths(tracking: &str, more: &Value) -> Value {
    let layers = json!([{"thickness_mm": 60, "mu_a_per_mm": 1, "mu_s_per_mm": 0, "index": 1}]);
    with(&json!({"photons": 100_000, "grid": [1, 1, 1], "layers": layers, "tracking": tracking}), more)
}

#[test]
fn the_march_is_as_wrong_as_theory_says() {
    for step in [0.01, 0.1, 0.5, 2.0f64] {
        let scene = free_paths("march", &json!({"march_step_mm": step}));
        let truth = step / -(-step).exp_m1();
        judge(&format!("step {step}"), &scene, truth, 1e-7, |r| r["mean_path_mm"].as_f64().unwrap());
    }
    let job = House::shared().finish(&request(&free_paths("march", &json!({"march_step_mm": 0.5, "photons": 1000}))));
    let warned = job.resource()["warnings"].as_array().unwrap().iter().find(|w| w["code"] == "march_bias").cloned();
    let measured = warned.and_then(|w| w["measured"].as_f64()).unwrap_or(0.0);
    assert!((measured - (0.5 / -(-0.5f64).exp_m1() - 1.0)).abs() < 1e-9, "the reply says {measured}");
    for tracking in ["exact", "delta", "weighted"] {
        judge(tracking, &free_paths(tracking, &json!({})), 1.0, 1e-7, |r| r["mean_path_mm"].as_f64().unwrap());
    }
}

#[test]
fn a_majorant_that_is_too_small_biases_delta_tracking_and_says_so() {
    for scale in [0.25, 0.5, 0.9, 1.0, 2.0, 16.0] {
        let more = json!({"majorant": {"scale": scale}, "layers": [{"thickness_mm": 2, "mu_a_per_mm": 1, "mu_s_per_mm": 0, "index": 1}]});
        let truth = (-2.0 * f64::min(scale, 1.0)).exp();
        let scene = free_paths("delta", &more);
        judge(&format!("delta, {scale}"), &scene, truth, 1e-7, |r| fraction(r, "unscattered_plus_z").0);
        let result = simulate(&scene);
        let broken = result["broken_majorants"].as_u64().unwrap();
        let codes: Vec<&Value> = result["warnings"].as_array().unwrap().iter().map(|w| &w["code"]).collect();
        assert_eq!(broken > 0, scale < 1.0, "{scale}: {broken} broken majorants");
        assert_eq!(codes.contains(&&json!("broken_majorant")), scale < 1.0, "{scale}: {codes:?}");
        // The weights compensate for it.
        judge(&format!("weighted, {scale}"), &free_paths("weighted", &more), (-2f64).exp(), 1e-7, |r| {
            fraction(r, "exit_plus_z").0
        });
    }
}

/// The names of the ledger whose sum is 1.
pub const LEDGER: [&str; 10] = [
    "exit_minus_x",
    "exit_plus_x",
    "exit_minus_y",
    "exit_plus_y",
    "exit_minus_z",
    "exit_plus_z",
    "absorbed",
    "lost",
    "specular",
    "gated",
];

/// Compares two ledgers, both with their standard errors.
fn same_ledger(what: &str, a: &Value, b: &Value) {
    for name in &LEDGER[..7] {
        let ((va, ea), (vb, eb)) = (fraction(a, name), fraction(b, name));
        let z = (va - vb) / ea.hypot(eb).max(1e-12);
        assert!(z.abs() <= 3.9, "{what}: {name} is {va} ± {ea} and {vb} ± {eb}, z = {z:.2}");
    }
}

#[test]
fn one_dense_voxel_and_a_thin_shell_are_the_same_to_every_tracker() {
    let house = House::shared();
    let outlier = house
        .floats([24, 24, 24], |x, y, z| if x.abs() < 0.05 && y.abs() < 0.05 && z.abs() < 0.05 { 400.0 } else { 0.3 });
    let shell = house.floats([32, 32, 32], |x, y, z| {
        let r = (x * x + y * y + z * z).sqrt();
        if (0.6..0.68).contains(&r) { 60.0 } else { 0.0 }
    });
    for (name, density) in [("outlier", outlier), ("shell", shell)] {
        let medium = json!({"mu_a_per_mm": 0.3, "mu_s_per_mm": 0.7, "index": 1, "phase": {"type": "henyey_greenstein", "g": 0.5}});
        let scene = json!({"photons": 400_000, "density": density, "size_mm": [2, 2, 2], "medium": medium,
            "source": {"type": "isotropic", "position_mm": [1, 1, 0.9]}});
        let exact = simulate(&with(&scene, &json!({"tracking": "exact"})));
        for (i, more) in [
            json!({"tracking": "delta"}),
            json!({"tracking": "delta", "majorant": {"grid": "global"}, "photons": 100_000}),
            json!({"tracking": "weighted"}),
        ]
        .iter()
        .enumerate()
        {
            let seeded = with(more, &json!({"seed": 7 + i}));
            same_ledger(&format!("{name}, {more}"), &exact, &simulate(&with(&scene, &seeded)));
        }
    }
}

#[test]
fn a_box_of_one_medium_is_the_same_said_in_four_ways() {
    let medium = json!({"mu_a_per_mm": 0.1, "mu_s_per_mm": 1.4, "index": 1, "phase": {"type": "rayleigh"}});
    let common = json!({"photons": 400_000, "size_mm": [2, 2, 2], "source": {"type": "disk", "radius_mm": 0.5, "direction": [0.2, 0.1, 1]}});
    let constant = json!({"builtin": "constant", "resolution": 16});
    let house = House::shared();
    let zeros = house.floats([12, 10, 8], |_, _, _| 0.0);
    let homogeneous = simulate(&with(&common, &json!({"medium": medium, "grid": [16, 16, 16]})));
    let ends = json!({"x": "absorbing", "y": "absorbing"});
    let layer = with(&medium, &json!({"thickness_mm": 1}));
    for (i, (name, more)) in [
        ("labels", json!({"labels": zeros, "media": [medium]})),
        ("density", json!({"density": constant, "medium": medium})),
        ("layers", json!({"layers": [layer, layer], "boundary": ends})),
    ]
    .into_iter()
    .enumerate()
    {
        for tracking in ["exact", "delta"] {
            let seeded = with(&more, &json!({"seed": 20 + i, "tracking": tracking}));
            same_ledger(&format!("{name}, {tracking}"), &homogeneous, &simulate(&with(&common, &seeded)));
        }
    }
}

#[test]
fn how_far_around_a_medium_is_the_same_changes_no_path() {
    let blobs = House::shared().floats([20, 26, 23], |x, y, z| {
        if (x - 0.3).powi(2) + y * y + (z + 0.2).powi(2) < 0.3 {
            2.0
        } else {
            f64::from(u8::from(x + 0.5 * y > 0.75 || z > 0.8))
        }
    });
    let medium = |a: f64, s: f64, index: f64| json!({"mu_a_per_mm": a, "mu_s_per_mm": s, "index": index, "phase": {"type": "henyey_greenstein", "g": 0.6}});
    for (indices, more_media) in [([1.4, 1.4, 1.4], 0), ([1.4, 1.0, 1.5], 0), ([1.4, 1.4, 1.4], 297)] {
        let mut media = vec![medium(0.1, 0.5, indices[0]), medium(0.3, 0.1, indices[1]), medium(0.05, 1.2, indices[2])];
        media.extend(vec![medium(9.0, 9.0, 1.4); more_media]);
        for ends in
            [json!({"x": "cyclic", "y": "mirror", "fresnel": true}), json!({"x": "mirror", "z": "cyclic"}), json!({})]
        {
            let scene = json!({"photons": 100_000, "labels": blobs, "media": media, "size_mm": [2, 1.6, 1.8], "tracking": "exact",
                "time_gate_ns": 0.2, "boundary": ends, "source": {"type": "disk", "radius_mm": 0.5, "position_mm": [1, 0.8, 0], "direction": [0.4, 0.2, 1]}});
            // Tracks are scored voxel by voxel, so their photons stop at every wall.
            let [near, far] = ["track_length", "collision"]
                .map(|estimator| simulate(&with(&scene, &json!({"tally": "absorbed", "estimator": estimator}))));
            for name in LEDGER {
                let (a, b) = (fraction(&near, name).0, fraction(&far, name).0);
                // A few paths in 100,000 differ because of rounding.
                assert!((a - b).abs() < 1e-4, "{indices:?}, {ends}: {name} is {a} voxel by voxel, else {b}");
            }
            for name in ["mean_scatterings", "mean_path_mm"] {
                let (a, b) = (near[name].as_f64().unwrap(), far[name].as_f64().unwrap());
                assert!((a / b - 1.0).abs() < 1e-4, "{indices:?}, {ends}: {name} is {a} voxel by voxel, else {b}");
            }
        }
    }
}

#[test]
fn what_leaves_the_slab_leaves_alike_for_every_tracker() {
    let bins = json!({"radius_edges_mm": [0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 1, 30], "angle_edges_deg": [0, 15, 30, 45, 60, 75, 90]});
    let scene = with(&slab(), &json!({"photons": 2_000_000, "exit_histogram": bins}));
    let profile = |tracking: &str, seed: u64| {
        simulate(&with(&scene, &json!({"tracking": tracking, "seed": seed, "majorant": {"scale": 1.5}})))["exit_histogram"].clone()
    };
    let exact = profile("exact", 1);
    for tracking in ["exact", "delta", "weighted"] {
        let other = profile(tracking, 2);
        let mut z = Vec::new();
        for side in ["minus_z", "plus_z"] {
            for ring in 0..10 {
                for cone in 0..6 {
                    let at = |h: &Value, what: &str| h[side][ring][cone][what].as_f64().unwrap();
                    let error = at(&exact, "standard_error").hypot(at(&other, "standard_error"));
                    // Only bins are used that have enough photons for their error to be known.
                    if at(&exact, "value") > 2e-5 {
                        z.push((at(&exact, "value") - at(&other, "value")) / error);
                    }
                }
            }
        }
        let (excess, count) = chi_squared_excess(z.into_iter());
        assert!(count > 60, "only {count} bins");
        // The errors come from 32 batches. The square of a t distribution is a little wider, by 31 / 29.
        assert!(excess < 4.5, "exact and {tracking}: chi² over {count} bins is {excess:.1} deviations too large");
    }
}

#[test]
fn first_collisions_follow_the_exponential_law() {
    let photons = 50_000.0;
    for tracking in ["exact", "delta", "weighted"] {
        let scene = json!({"photons": photons, "grid": [1, 1, 24], "tally": "absorbed", "tracking": tracking, "majorant": {"scale": 1.3},
            "layers": [{"thickness_mm": 3, "mu_a_per_mm": 1.5, "mu_s_per_mm": 0, "index": 1}], "size_mm": [60, 60, 3]});
        let run = |seed: u64| House::shared().finish(&request(&with(&scene, &json!({"seed": seed})))).field().unwrap();
        let runs: Vec<_> = (0..20).map(run).collect();
        let z = (0..24).map(|i| {
            let (from, to) = (1.5 * f64::from(i) / 8.0, 1.5 * f64::from(i + 1) / 8.0);
            let expected = photons * ((-from).exp() - (-to).exp());
            // The weights of weighted tracking spread more than counts do, so the spread of the seeds gives the error.
            let counts = runs.iter().map(|r| r.values().unwrap().at(0, 0, i as usize) * photons * 60.0 * 60.0 * 0.125);
            let (mean, error) = spread(&counts.collect::<Vec<_>>());
            (mean - expected) / error
        });
        let (excess, _) = chi_squared_excess(z);
        // The errors come from 20 seeds. The square of a t distribution is wider, by 19 / 17.
        assert!(excess < 4.5, "{tracking}: chi² is {excess:.1} deviations too large");
    }
}

#[test]
fn both_estimators_give_the_same_fluence_at_every_depth() {
    let layers = json!([{"thickness_mm": 1, "mu_a_per_mm": 0.2, "mu_s_per_mm": 2, "index": 1.3}, {"thickness_mm": 2, "mu_a_per_mm": 0.5, "mu_s_per_mm": 5, "index": 1.5}]);
    let scene = json!({"photons": 1_000_000, "grid": [1, 1, 30], "size_mm": [60, 60, 3], "layers": layers, "boundary": {"fresnel": true}});
    for tally in ["fluence", "absorbed"] {
        let runs = |estimator: &str, first: u64| -> Vec<Vec<f64>> {
            (0..8)
                .map(|seed| {
                    let more =
                        json!({"tally": tally, "estimator": estimator, "seed": first + seed, "photons": 100_000});
                    let field = House::shared().finish(&request(&with(&scene, &more))).field().unwrap();
                    (0..30).map(|i| field.values().unwrap().at(0, 0, i)).collect()
                })
                .collect()
        };
        let (track, collision) = (runs("track_length", 0), runs("collision", 100));
        let z = (0..30).map(|depth| {
            let column = |runs: &[Vec<f64>]| spread(&runs.iter().map(|r| r[depth]).collect::<Vec<_>>());
            let ((a, ea), (b, eb)) = (column(&track), column(&collision));
            (a - b) / ea.hypot(eb)
        });
        let (excess, _) = chi_squared_excess(z);
        // The errors come from eight runs each, and depths share photons.
        assert!(excess < 6.0, "{tally}: chi² is {excess:.1} deviations too large");
    }
}
