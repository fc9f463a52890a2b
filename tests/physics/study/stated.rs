//! Stated errors of pictures of the kinds in which a promise once failed: by steps across shells that are thinner, of one sample, of few pixels, of samples
//! that are spread evenly. The true error is at most what is stated, and no four times less.

use cloudchamber::study::bench::{Bench, Reads};
use cloudchamber::study::measure::measure;
use serde_json::{Value, json};

use super::on_a_bench;
use crate::common::with;

/// True errors above the stated one by less count as it: the truth has an error, too. Below the least, errors count as that.
const CLOSE: f64 = 1.05;
const LEAST: f64 = 1e-3;

/// Renders a request and compares what it states with the truth: so many samples of another seed, whose technique has the options `exact` as well.
fn check(bench: &Bench, name: &str, request: &Value, samples: u32, exact: &Value) {
    let run = bench.run(request, Reads::Luminance).unwrap();
    let technique = request["technique"].as_str().unwrap();
    let own = request.get(technique).cloned().unwrap_or(json!({}));
    let exact = json!({ technique: with(&own, exact), "budget": {"samples": samples}, "seed": 99 });
    let truth = bench.run(&with(request, &exact), Reads::Luminance).unwrap();
    let is = measure(&[run.values], &truth.values).unwrap().rmse.max(LEAST);
    let (stated, stopped) = (run.reply["error"].as_f64().unwrap_or(f64::INFINITY), &run.reply["stopped_by"]);
    println!("{name}: stated {stated:.4}, is {is:.4}, stopped by {stopped}");
    assert!(is <= CLOSE * stated, "{name}: stated {stated}, is {is}, {}", run.reply["error_parts"]);
    assert!(stated <= 4.0 * is, "{name}: stated {stated}, is {is}, {}", run.reply["error_parts"]);
    if stopped == "error" {
        let asked = request["budget"]["max_error"].as_f64().unwrap();
        assert!(is <= CLOSE * asked, "{name}: {is} where {asked} was asked for");
    }
}

/// A ball of smooth values whose level `at` is a shell of this half-width in values.
fn shell(resolution: u32, at: f64, half_width: f64, opacity: f64, step_voxels: f64, budget: &Value) -> Value {
    let point =
        |value: f64, opacity: f64| json!({"value": value, "color": [0.9, 0.6, 0.3], "opacity_per_unit": opacity});
    let points = [point(0.0, 0.0), point(at - half_width, 0.0), point(at, opacity), point(at + half_width, 0.0)];
    json!({"technique": "emission_absorption", "seed": 5, "image": {"width": 64, "height": 64}, "budget": budget,
        "volume": {"builtin": "gaussian", "resolution": resolution},
        "camera": {"eye": [2.1, -1.4, 1.7], "up": [0.1, 0.2, 1], "fov_y_deg": 30},
        "emission_absorption": {"transfer_function": {"points": points}, "pre_integrated": true, "step_voxels": step_voxels}})
}

#[test]
fn pre_integrated_steps_across_thin_shells_state_what_they_cost() {
    let exact = json!({"pre_integrated": false, "step_voxels": 0.1, "opacity_threshold": 1});
    let stops = json!({"max_error": 0.02});
    let of = |samples: u32| json!({ "samples": samples });
    on_a_bench(|bench| {
        for (name, scene, samples) in [
            ("a thin shell, to an error", shell(44, 0.7, 0.025, 12.0, 1.0, &stops), 1024),
            ("a thicker shell, to an error", shell(30, 0.5, 0.09, 28.0, 1.0, &stops), 512),
            ("a thicker shell", shell(30, 0.5, 0.09, 28.0, 1.0, &of(64)), 256),
            ("half a voxel", shell(26, 0.72, 0.07, 18.0, 0.5, &of(96)), 512),
            ("three voxels", shell(26, 0.72, 0.07, 18.0, 3.0, &of(16)), 64),
            ("three voxels, to an error", shell(26, 0.72, 0.07, 18.0, 3.0, &stops), 512),
        ] {
            check(bench, name, &scene, samples, &exact);
        }
    });
}

#[test]
fn few_samples_and_few_pixels_state_their_noise() {
    let scene = |technique: &str, volume: &Value, side: u32, samples: u32| {
        json!({"technique": technique, "volume": volume, "seed": 3, "image": {"width": side, "height": side},
            "budget": {"samples": samples}})
    };
    let whole = json!({"step_voxels": 0.125, "opacity_threshold": 1});
    let smoke = json!({"builtin": "smoke", "resolution": 24});
    let edges = json!({"builtin": "shepp_logan", "resolution": 28});
    let slab = json!({"slice": {"plane": {"point": [0.05, 0.3, 0], "normal": [1.4, -0.2, -0.6]}, "thickness": 0.35, "mode": "maximum"}});
    let ramp = json!({"emission_absorption": {"opacity_threshold": 0.9, "transfer_function": {"points": [
        {"value": 0, "color": [0, 0, 0], "opacity_per_unit": 0}, {"value": 0.2, "color": [0.5, 0.7, 0.2], "opacity_per_unit": 1.4},
        {"value": 1, "color": [0.9, 0.3, 0.1], "opacity_per_unit": 1.8}]}}});
    on_a_bench(|bench| {
        for (name, scene, samples, exact) in [
            ("the smallest scene", scene("emission_absorption", &json!({"builtin": "smoke"}), 32, 1), 128, &whole),
            ("a slice of one sample", scene("slice", &edges, 48, 1), 1024, &json!({})),
            ("a slice of 16 pixels", scene("slice", &smoke, 4, 512), 8192, &json!({})),
            (
                "a slab",
                with(&scene("slice", &json!({"builtin": "gaussian", "resolution": 80}), 80, 4), &slab),
                4096,
                &json!({}),
            ),
            ("an early end", with(&scene("emission_absorption", &edges, 64, 8), &ramp), 256, &whole),
        ] {
            check(bench, name, &scene, samples, exact);
        }
    });
}
