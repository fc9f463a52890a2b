//! The limits of the methods: the ledger closes and nothing is lost in silence, whatever the scene.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use serde_json::{Value, json};

use super::run::{fraction, request, simulate, with};
use super::trackers::LEDGER;
use crate::common::engine::House;

/// The ledger's sum, with every part finite.
fn sum(result: &Value) -> f64 {
    LEDGER.iter().map(|name| fraction(result, name).0).sum()
}

fn closes(scene: &Value) -> Value {
    let job = House::shared().finish(&request(scene));
    let result = job.resource()["result"].clone();
    assert!((sum(&result) - 1.0).abs() < 1e-6, "{scene}: the ledger adds up to {}", sum(&result));
    let field = job.field().unwrap();
    assert!(
        (0..field.voxel_count()).all(|i| field.voxels().unwrap().get_f32(i).is_finite()),
        "{scene}: a voxel is not finite"
    );
    result
}

#[test]
fn no_extreme_loses_energy() {
    let base = json!({"photons": 3000, "size_mm": [1, 1, 1], "grid": [4, 4, 4]});
    let medium = |a: f64, s: f64, index: f64, g: f64| json!({"medium": {"mu_a_per_mm": a, "mu_s_per_mm": s, "index": index, "phase": {"type": "henyey_greenstein", "g": g}}});
    for (a, s, index, g) in [
        (0.0, 0.0, 1.0, 0.0),
        (0.0, 0.0, 1.5, 0.0),
        (1e-6, 1e-6, 1.0, 0.0),
        (0.0, 5.0, 1.0, 0.9),
        (5.0, 0.0, 1.0, 0.0),
        (200.0, 0.0, 1.5, 0.0),
        (0.1, 200.0, 1.0, 0.0),
        (100.0, 100.0, 3.0, 0.999),
        (1.0, 100.0, 3.0, -0.999),
        (1.0, 10.0, 1.4, 1.0),
        (1.0, 10.0, 1.4, -1.0),
        (1e6, 1e6, 1.0, 0.0),
    ] {
        for fresnel in [false, true] {
            let result =
                closes(&with(&with(&base, &medium(a, s, index, g)), &json!({"boundary": {"fresnel": fresnel}})));
            // Only light that total reflection traps may be given up.
            let trapped = fresnel && index > 1.0 && a == 0.0;
            assert!(trapped || result["faults"] == 0, "{a} {s} {index} {g}: {result}");
        }
    }
}

#[test]
fn sources_on_faces_edges_corners_and_along_axes_are_sources() {
    let medium = json!({"mu_a_per_mm": 0.5, "mu_s_per_mm": 1.5, "index": 1.3});
    let directions = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1, 1, 0], [1, 1, 1], [-1, 2, -3]];
    let constant = json!({"builtin": "constant", "resolution": 8});
    for place in
        [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.5, 0.0], [0.25, 0.5, 0.75], [0.5, 0.5, 1.0]]
    {
        for direction in directions {
            for more in [
                json!({"grid": [4, 4, 4]}),
                json!({"density": constant}),
                json!({"density": constant, "tracking": "delta"}),
            ] {
                let scene = with(
                    &json!({"photons": 500, "size_mm": [1, 1, 1], "medium": medium, "boundary": {"fresnel": more.get("density").is_none()},
                    "source": {"type": "cone", "half_angle_deg": 30, "position_mm": place, "direction": direction}}),
                    &more,
                );
                assert_eq!(closes(&scene)["faults"], 0, "{scene}");
            }
        }
    }
}

#[test]
fn a_slab_of_optical_depth_200_lets_through_what_it_should() {
    // Diffusion theory for a thick lossless slab of index 1: T = 4/3 / (tau + 2 z0), z0 = 0.7104 (Milne).
    let scene = json!({"photons": 40_000, "grid": [1, 1, 1], "layers": [{"thickness_mm": 200, "mu_a_per_mm": 0, "mu_s_per_mm": 1, "index": 1}]});
    let result = closes(&scene);
    let (through, error) = fraction(&result, "exit_plus_z");
    // At normal incidence the beam enters like a source at depth z0 + 1, exactly 5/3 in the limit of isotropic scattering.
    let truth = (1.0 + 0.7104) / (200.0 + 2.0 * 0.7104);
    assert!((through - truth).abs() < 4.0 * error + 0.02 * truth, "{through} ± {error} for {truth}");
}

#[test]
fn two_hundred_random_scenes_keep_their_energy() {
    let house = House::shared();
    let labels = house.floats([6, 5, 7], |x, y, _| {
        if x > 0.0 {
            2.0
        } else if y > 0.0 {
            1.0
        } else {
            0.0
        }
    });
    let density = house.floats([9, 6, 5], |x, y, z| (3.0 * (x * y + z)).max(0.0));
    let phases = [
        json!({"type": "isotropic"}),
        json!({"type": "henyey_greenstein", "g": 0.97}),
        json!({"type": "henyey_greenstein", "g": -0.6}),
        json!({"type": "rayleigh"}),
        json!({"type": "two_term_henyey_greenstein"}),
        json!({"type": "tabulated", "cosines": [-1, 0.2, 1], "densities": [0, 1, 5]}),
    ];
    let medium = (0f64..3.0, 0f64..6.0, prop::sample::select(vec![1.0, 1.33, 2.4]), 0..phases.len());
    let ends = || prop::sample::select(vec!["absorbing", "cyclic", "mirror"]);
    let sources = prop::sample::select(vec!["pencil", "isotropic", "planar", "disk", "cone", "diffuse"]);
    let trackers = prop::sample::select(vec!["auto", "exact", "march", "delta", "weighted"]);
    let tallies = prop::sample::select(vec!["fluence", "absorbed", "radiance_gather"]);
    let all = (
        prop::collection::vec(medium, 3),
        0..4,
        (ends(), ends()),
        sources,
        trackers,
        tallies,
        any::<(bool, bool, u16)>(),
        0.01f64..1.0,
    );
    let mut runner = TestRunner::new_with_rng(
        Config { cases: 200, failure_persistence: None, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(Default::default()),
    );
    let run = runner.run(&all, |(media, shape, (bx, by), source, tracking, tally, (fresnel, gated, seed), survival)| {
        let one = |m: &(f64, f64, f64, usize), index: f64| json!({"mu_a_per_mm": m.0, "mu_s_per_mm": m.1, "index": index, "phase": phases[m.3]});
        // Trackers that do not see interfaces get a single index.
        let index = |i: usize| if tracking == "auto" || tracking == "exact" { media[i].2 } else { media[0].2 };
        let every: Vec<Value> = (0..3).map(|i| one(&media[i], index(i))).collect();
        let shape = match shape {
            0 => json!({"medium": every[0], "grid": [5, 4, 3]}),
            1 => json!({"layers": every.iter().map(|m| with(m, &json!({"thickness_mm": 0.4}))).collect::<Vec<_>>(), "grid": [3, 3, 9]}),
            2 => json!({"media": every, "labels": labels}),
            _ => json!({"medium": every[0], "density": density}),
        };
        let mut scene = with(&shape, &json!({"photons": 400, "size_mm": [1.5, 2, 1.2], "seed": seed, "tracking": tracking, "tally": tally,
            "source": {"type": source, "position_mm": [0.7, 0.9, if source == "isotropic" { 0.5 } else { 0.0 }], "direction": [0.3, -0.2, 1]},
            "boundary": {"x": bx, "y": by, "fresnel": fresnel}, "roulette": {"threshold": 0.05, "survival": survival}}));
        if source == "planar" {
            scene["source"]["position_mm"] = json!([-0.5, 0.1, -0.3]);
        }
        if gated {
            scene["time_gate_ns"] = json!(0.05);
        }
        let result = simulate(&scene);
        let total = sum(&result);
        prop_assert!((total - 1.0).abs() < 1e-6, "{scene}: the ledger adds up to {total}");
        prop_assert!(!result["overflow"].as_bool().unwrap());
        Ok(())
    });
    run.unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn the_error_falls_with_the_root_of_the_photons_and_has_no_floor() {
    // From ten thousand to forty million photons, each factor of sixteen gives a fourth of the spread, as far as eight seeds can tell.
    let spread = |photons: u64| {
        let scene = json!({"photons": photons, "grid": [1, 1, 1], "layers": [{"thickness_mm": 1, "mu_a_per_mm": 0.2, "mu_s_per_mm": 1, "index": 1}]});
        let runs: Vec<f64> =
            (0..12).map(|seed| fraction(&simulate(&with(&scene, &json!({"seed": seed}))), "exit_plus_z").0).collect();
        super::run::spread(&runs).1
    };
    let spreads: Vec<f64> = [10_000, 160_000, 2_560_000].into_iter().map(spread).collect();
    let slope = (spreads[2] / spreads[0]).ln() / 256f64.ln();
    assert!((slope + 0.5).abs() < 0.12, "the spread goes with the power {slope:.3}: {spreads:?}");
}
