//! The study on the real device, in its quick form: cases reach their truth as theory says, and no method is wrong in silence.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

use std::sync::{Mutex, PoisonError};

use clap::Parser;
use cloudchamber::config::{DeviceArgs, Limits};
use cloudchamber::study::bench::{Bench, Reads};
use cloudchamber::study::experiments::EXPERIMENTS;
use cloudchamber::study::record::{Line, Record};
use cloudchamber::study::stability::stability;
use cloudchamber::study::verdict::Verdict;
use cloudchamber::study::{CASES, Scale, study};
use serde_json::{Value, json};

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: Limits,
}

/// Calls `work` with an engine of its own, one at a time.
fn on_a_bench(work: impl FnOnce(&Bench)) {
    static ONE: Mutex<()> = Mutex::new(());
    let _one_at_a_time = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    cloudchamber::device::keep_compiled_kernels_in(&common::kernel_cache()).unwrap();
    let data = tempfile::tempdir().unwrap();
    let flags = Flags::parse_from(["test", "--data-dir", data.path().to_str().unwrap()]);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    let guard = runtime.enter();
    work(&Bench::new(&flags.device, flags.limits).unwrap());
    drop(guard);
}

#[test]
fn every_method_that_leaves_its_domain_says_so() {
    on_a_bench(|bench| {
        let found = stability(bench, Scale::Quick, &|_| true, &mut |line| eprintln!("{line}")).unwrap();
        assert_eq!(found.experiments.len(), EXPERIMENTS.len());
        for outcome in &found.experiments {
            let silent = outcome.findings.samples().filter(|(_, s)| !s.verdict().is_told());
            let silent: Vec<_> = silent.map(|(method, s)| format!("{method}: {s:?}")).collect();
            assert!(silent.is_empty(), "{} is wrong and silent:\n{}", outcome.name, silent.join("\n"));
            assert!(outcome.surprises.is_empty(), "{}: {:?}", outcome.name, outcome.surprises);
        }
        // An experiment that no longer reaches where a method fails shows nothing.
        for name in ["march_step", "majorant", "opacity_step", "single_scattering"] {
            let outcome = found.experiments.iter().find(|o| o.name == name).unwrap();
            assert_eq!(outcome.verdict, Verdict::BiasedAndFlagged, "{name}");
        }
    });
}

fn case(bench: &Bench, name: &str) -> Record {
    let case = CASES.iter().find(|c| c.name == name).unwrap();
    let record = study(bench, case, Scale::Quick, &mut |_| ()).unwrap().unwrap_or_else(|why| panic!("{name}: {why}"));
    assert!(record.lines.iter().flat_map(|l| &l.points).any(|p| p.front), "{name}: something is on the front");
    record
}

fn slope(record: &Record, line: &Line, within: f64) {
    let (found, expected) = (line.slope, line.expected_slope);
    let (Some(found), Some(expected)) = (found, expected) else {
        panic!("{}, {}: slope {found:?}, expected {expected:?}", record.name, line.name)
    };
    assert!((found - expected).abs() <= within, "{}, {}: slope {found}, expected {expected}", record.name, line.name);
}

#[test]
fn errors_follow_the_order_of_their_method() {
    on_a_bench(|bench| {
        for name in ["isosurface_sphere", "composite"] {
            let record = case(bench, name);
            record.lines.iter().filter(|l| l.expected_slope.is_some()).for_each(|line| slope(&record, line, 0.35));
        }
        let slab = case(bench, "slab");
        slab.lines.iter().for_each(|line| slope(&slab, line, 0.3));
        let exact = case(bench, "beer_lambert");
        let steps = exact.lines.iter().find(|l| l.name == "emission_absorption").unwrap();
        assert!(steps.points.iter().all(|p| p.error.rmse < 2e-4), "no step is wrong in one medium: {steps:?}");
    });
}

#[test]
fn a_bias_is_told_from_noise() {
    on_a_bench(|bench| {
        let record = case(bench, "scattering_medium");
        let last = |line: &str| {
            let line = record.lines.iter().find(|l| l.name == line).unwrap();
            let point = line.points.last().unwrap();
            (point.error.bias, point.error.bias_within.unwrap())
        };
        let (bias, within) = last("volume_path");
        assert!(bias.abs() <= 2.0 * within, "the whole path is unbiased: {bias} ± {within}");
        let (bias, within) = last("single_scatter");
        assert!(bias < -0.5 && within < 0.02, "light scattered once is half of it: {bias} ± {within}");
        let cheap = &record.equal_error[0];
        assert!(cheap.rmse.is_some_and(|e| e <= 0.1), "{cheap:?}");
    });
}

/// What a plan's picture is wrong by, against the reference with many samples, and what was asked for.
fn planned(bench: &Bench, request: &Value, samples: u64) -> [f64; 2] {
    let plan = bench.plan(request).unwrap();
    let (_, mut reference) = bench.settings(request).unwrap().swap_remove(0);
    // What is random in the truth is independent of the plan's: what two seeds of it differ by.
    reference["budget"] = json!({"samples": samples / 2});
    let [a, b] = [98, 99].map(|seed| {
        reference["seed"] = json!(seed);
        bench.run(&reference, Reads::Luminance).unwrap().values
    });
    let truth: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
    let found = bench.run(&plan.request, Reads::Luminance).unwrap().values;
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let squares = found.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / truth.len() as f64;
    eprintln!("{}: {} samples, {}", plan.technique, plan.samples, plan.options);
    let own = a.iter().zip(&truth).map(|(a, t)| (a - t).powi(2)).sum::<f64>() / truth.len() as f64;
    [((squares - own) / mean.powi(2)).max(0.0).sqrt(), request["budget"]["max_error"].as_f64().unwrap()]
}

#[test]
fn what_is_small_thin_or_sharp_is_not_dropped() {
    on_a_bench(|bench| {
        let image = json!({"width": 128, "height": 128});
        let points = json!([{"value": 0, "color": [0.3, 0.3, 0.3], "opacity_per_unit": 0}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": 60}]);
        let looked_at = |volume: &Value, error: f64| {
            json!({"technique": "auto", "volume": volume, "image": image, "budget": {"max_error": error},
                "camera": {"eye": [0.3, 0.4, 3], "up": [0, 1, 0], "fov_y_deg": 36}, "emission_absorption": {"transfer_function": {"points": points}}})
        };
        let bright = |p: [f64; 3]| if p.iter().all(|v| v.abs() < 0.03) { 1.0 } else { 0.004 };
        let detail = bench.floats([48; 3], [2.0; 3], bright).unwrap();
        let shell = |p: [f64; 3]| f64::from(u8::from((p.iter().map(|v| v * v).sum::<f64>().sqrt() - 0.7).abs() < 0.03));
        let shell = bench.floats([48; 3], [2.0; 3], shell).unwrap();
        let mut peak = looked_at(&json!({"builtin": "smoke", "resolution": 48}), 0.15);
        peak.as_object_mut().unwrap().remove("emission_absorption");
        peak["medium"] =
            json!({"sigma_t_per_unit": 8, "albedo": 0.95, "phase": {"type": "henyey_greenstein", "g": 0.93}});
        // The sun is behind the cloud: what comes through is the forward peak, scattered a few times.
        peak["lights"] =
            json!([{"type": "sun", "direction": [-0.3, -0.4, -3], "irradiance": 3}, {"type": "sky", "radiance": 0.05}]);
        // A lamp of a few pixels, seen past the cloud: hardly one of them is a pilot's.
        let mut lamp = looked_at(&json!({"builtin": "gaussian", "resolution": 32}), 0.05);
        lamp.as_object_mut().unwrap().remove("emission_absorption");
        lamp["medium"] = json!({"sigma_t_per_unit": 1, "albedo": 0.5});
        lamp["lights"] = json!([{"type": "sphere", "position": [0.73, 0.8, -0.3], "radius": 0.03, "radiance": 60}, {"type": "sky", "radiance": 0.2}]);
        for (name, request, samples) in [
            ("detail", looked_at(&detail, 0.02), 256),
            ("shell", looked_at(&shell, 0.03), 256),
            ("peak", peak, 1500),
            ("lamp", lamp, 1500),
        ] {
            let [error, asked] = planned(bench, &request, samples);
            assert!(error <= asked, "{name}: {error} for {asked}");
        }
    });
}
