//! `./dev bench scattering`: light in a volume against Mitsuba 3's volpath, in turns in one run; the error of each of our methods in the same time;
//! and the time to a first picture. Prints Markdown. `DEVICE=gpu` measures another device.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod posts;

use std::process::Command;

use common::with;
use posts::{Bench, median};
use serde_json::{Value, json};

/// The outcome of a render: its relative error, its mean luminance, and the seconds on the device and until it was done.
struct Run {
    error: f64,
    mean: f64,
    device_s: f64,
    elapsed_s: f64,
    first_frame_ms: f64,
}

/// Uploads n³ floats on [-1, 1]³.
fn upload(bench: &Bench, n: usize, value: impl Fn(f64, f64, f64) -> f64) -> Value {
    let at = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let values = (0..n * n * n).map(|i| value(at(i % n), at(i / n % n), at(i / n / n)) as f32);
    json!({"id": bench.upload(values.flat_map(f32::to_le_bytes).collect(), n, "f32", 2.0)})
}

fn run(bench: &Bench, request: &Value) -> Run {
    let (place, exr) = bench.picture(request, "exr");
    let resource = bench.resource(&place);
    let ms = |name: &str| resource["timings"][name].as_f64().unwrap();
    Run {
        error: resource["error"].as_f64().unwrap(),
        mean: mean_luminance(&exr),
        device_s: ms("device_ms") / 1e3,
        elapsed_s: ms("elapsed_ms") / 1e3,
        first_frame_ms: ms("first_frame_ms"),
    }
}

fn mean_luminance(bytes: &[u8]) -> f64 {
    use exr::prelude::{ReadChannels, ReadLayers};
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = reader.all_attributes().from_buffered(std::io::Cursor::new(bytes)).unwrap();
    let mean = |name: &str| {
        let channel = image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name)).unwrap();
        let values: Vec<f64> = channel.sample_data.values_as_f32().map(f64::from).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    0.2126 * mean("R") + 0.7152 * mean("G") + 0.0722 * mean("B")
}

fn lights() -> Value {
    json!([{"type": "sun", "direction": [0.5, -0.6, 0.8], "irradiance": 3}, {"type": "sky", "radiance": 0.3}])
}

fn scene(volume: &Value, own: &Value, samples: u32) -> Value {
    json!({"technique": "volume_path", "volume": volume, "volume_path": own, "image": {"width": 256, "height": 256},
        "camera": {"eye": [2.6, -3.0, 2.2], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 40}, "budget": {"samples": samples}})
}

/// The volume on which VTK and Mitsuba are compared.
fn ripples(x: f64, y: f64, z: f64) -> f64 {
    (-4.0 * (x * x + y * y + z * z)).exp() * (0.6 + 0.4 * (14.0 * x).sin() * (14.0 * y).sin() * (14.0 * z).sin())
}

fn mitsuba(scene: &str, samples: u32) -> Option<Value> {
    let python = concat!(env!("CARGO_MANIFEST_DIR"), "/target/bench-venv/bin/python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/mitsuba_cloud.py");
    // A library that hides the processor's features from PoCL's LLVM (tests/physics/levels) is not for Mitsuba's LLVM.
    let command = |python| {
        Command::new(python).env_remove("LD_PRELOAD").args([script, scene, &samples.to_string(), "4"]).output()
    };
    let output = command(python).ok()?;
    serde_json::from_slice(output.stdout.trim_ascii_end().rsplit(|b| *b == b'\n').next()?).ok()
}

fn against_mitsuba(bench: &Bench) {
    println!(
        "| RMSE × √s | device | delivered | Mitsuba | Mitsuba against delivered | as a speed at equal error | mean, ours | mean, Mitsuba | z |\n|---|---|---|---|---|---|---|---|---|"
    );
    let cloud = scene(
        &upload(bench, 64, ripples),
        &json!({"medium": {"sigma_t_per_unit": 20, "albedo": 0.9}, "lights": lights()}),
        256,
    );
    let constant = json!({"builtin": "constant", "resolution": 8});
    let cube = scene(&constant, &json!({"medium": {"sigma_t_per_unit": 2, "albedo": 0.9}, "lights": lights()}), 512);
    for (name, request) in [("cloud", cloud), ("cube", cube)] {
        run(bench, &with(&request, &json!({"budget": {"samples": 2}})));
        let (mut device, mut delivered, mut theirs, mut means, mut peers) = (vec![], vec![], vec![], vec![], vec![]);
        for seed in 0..5 {
            let run = run(bench, &with(&request, &json!({"seed": seed})));
            let rmse = run.error * run.mean;
            device.push(rmse * run.device_s.sqrt());
            delivered.push(rmse * run.elapsed_s.sqrt());
            means.push(run.mean);
            if seed < 3
                && let Some(peer) = mitsuba(name, 16)
            {
                theirs.push(peer["rmse"].as_f64().unwrap() * peer["seconds"].as_f64().unwrap().sqrt());
                peers.push(peer);
            }
        }
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let error = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        let (device, delivered) = (median(device), median(delivered));
        let Some(peer) = peers.first() else {
            println!("| {name} | {device:.4} | {delivered:.4} | | | | {mean:.5} ± {error:.5} | | |");
            continue;
        };
        let (theirs, their_mean, their_error) =
            (median(theirs), peer["mean"].as_f64().unwrap(), peer["mean_error"].as_f64().unwrap());
        println!(
            "| {name} | {device:.4} | {delivered:.4} | {theirs:.4} | {:.1}× | {:.0}× | {mean:.5} ± {error:.5} | {their_mean:.5} ± {their_error:.5} | {:.1} |",
            theirs / delivered,
            (theirs / delivered).powi(2),
            (mean - their_mean) / error.hypot(their_error)
        );
    }
}

const SETTINGS: [(&str, &str); 9] = [
    ("default", "{}"),
    ("no next event", r#"{"next_event": false}"#),
    ("one majorant", r#"{"tracking": "delta", "majorant": {"grid": "global"}}"#),
    ("weighted", r#"{"tracking": "weighted"}"#),
    ("nearest, delta", r#"{"interpolation": "nearest", "tracking": "delta"}"#),
    ("nearest, exact", r#"{"tracking": "exact"}"#),
    ("roulette 0.05", r#"{"roulette_threshold": 0.05}"#),
    ("roulette 0.6", r#"{"roulette_threshold": 0.6}"#),
    ("adaptive", r#"{"adaptive": true}"#),
];

/// The variance × time of each setting, relative to the default.
fn settings(bench: &Bench) {
    let names: Vec<&str> = SETTINGS.iter().map(|s| s.0).collect();
    println!("\n| variance × device time, relative | {} |\n|{}", names.join(" | "), "---|".repeat(1 + SETTINGS.len()));
    // The suns have some width, so that they can also be met by chance.
    let wide = json!([{"type": "sun", "direction": [0.5, -0.6, 0.8], "irradiance": 3, "angular_diameter_deg": 30}, {"type": "sky", "radiance": 0.3}]);
    let lamp = json!([{"type": "sphere", "position": [1, -1, 1], "radius": 0.3, "radiance": 10}]);
    let shell =
        upload(bench, 64, |x, y, z| if ((x * x + y * y + z * z).sqrt() - 0.8).abs() < 0.05 { 1.0 } else { 0.01 });
    for (name, volume, own) in [
        (
            "cloud",
            upload(bench, 64, ripples),
            json!({"medium": {"sigma_t_per_unit": 20, "albedo": 0.9}, "lights": wide}),
        ),
        (
            "white smoke, forward",
            json!({"builtin": "smoke", "resolution": 128}),
            json!({"medium": {"sigma_t_per_unit": 30, "albedo": 1, "phase": {"type": "henyey_greenstein", "g": 0.8}}, "lights": wide}),
        ),
        ("thin shell under a lamp", shell, json!({"medium": {"sigma_t_per_unit": 60, "albedo": 0.8}, "lights": lamp})),
        (
            "fog",
            json!({"builtin": "constant", "resolution": 8}),
            json!({"medium": {"sigma_t_per_unit": 2, "albedo": 0.9}, "lights": wide}),
        ),
    ] {
        let mut rows = vec![Vec::new(); SETTINGS.len()];
        for seed in 0..3 {
            for (i, (_, setting)) in SETTINGS.iter().enumerate() {
                let setting: Value = serde_json::from_str(setting).unwrap();
                let request = with(&scene(&volume, &with(&own, &setting), 96), &json!({"seed": seed}));
                if seed == 0 {
                    // This run builds the kernel, and its time does not count.
                    run(bench, &request);
                }
                let run = run(bench, &request);
                rows[i].push((run.error * run.mean).powi(2) * run.device_s);
            }
        }
        let medians: Vec<f64> = rows.into_iter().map(median).collect();
        let shown: Vec<String> = medians.iter().map(|v| format!("{:.2}", v / medians[0])).collect();
        println!("| {name} | {} |", shown.join(" | "));
    }
}

fn first_frames(bench: &Bench) {
    println!("\n| 512², time until the first picture, ms, median (longest) of 9 | |\n|---|---|");
    for technique in ["single_scatter", "volume_path"] {
        let request = json!({"technique": technique, "budget": {"samples": 16}});
        run(bench, &request);
        let times: Vec<f64> = (0..9).map(|_| run(bench, &request).first_frame_ms).collect();
        let longest = times.iter().copied().fold(0.0, f64::max);
        println!("| {technique} | {:.0} ({longest:.0}) |", median(times));
    }
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let asked = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let bench = Bench::new(&[]);
    if asked("mitsuba") {
        against_mitsuba(&bench);
    }
    if asked("settings") {
        settings(&bench);
    }
    if asked("first") {
        first_frames(&bench);
    }
}
