//! `./dev bench photons`: photon transport against MCX's OpenCL version on the same PoCL, in turns in one run; the error of each tracker and
//! estimator in the same time; and the growth with threads. Prints Markdown. `DEVICE=gpu` measures another device.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod posts;

use std::process::Command;
use std::time::Instant;

use common::with;
use posts::{Bench, median};
use serde_json::{Value, json};

/// The outcome of a simulation.
struct Run {
    result: Value,
    photons_per_ms: f64,
    wall_per_ms: f64,
}

/// Posts the simulation and waits for its picture, then asks for the result, and for the grid if it is wanted.
fn run_with_field(bench: &Bench, scene: &Value, wanted: bool) -> (Run, Vec<f32>) {
    let body = json!({"technique": "emission_absorption", "volume": {"photon_transport": scene},
        "image": {"width": 8, "height": 8}, "budget": {"samples": 1}});
    let started = Instant::now();
    let (place, _) = bench.picture(&body, "png");
    let wall_s = started.elapsed().as_secs_f64();
    let mut grid = Vec::new();
    if wanted {
        let nrrd = bench.get(&format!("{place}/field"));
        let start = nrrd.windows(2).position(|w| w == b"\n\n").unwrap() + 2;
        grid.extend(nrrd[start..].chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())));
    }
    let resource = bench.resource(&place);
    let result = resource["result"].clone();
    let photons = result["photons"].as_f64().unwrap_or_else(|| panic!("{resource}"));
    let photons_per_ms = result["photons_per_ms"].as_f64().unwrap();
    (Run { photons_per_ms, wall_per_ms: photons / wall_s / 1e3, result }, grid)
}

fn run(bench: &Bench, scene: &Value) -> Run {
    run_with_field(bench, scene, false).0
}

fn cube60() -> Value {
    json!({"size_mm": [60, 60, 60], "grid": [60, 60, 60], "time_gate_ns": 5, "tally": "absorbed",
        "medium": {"mu_a_per_mm": 0.005, "mu_s_per_mm": 1, "index": 1.37, "phase": {"type": "henyey_greenstein", "g": 0.01}},
        "source": {"type": "pencil", "position_mm": [29, 29, 0], "direction": [0, 0, 1]}})
}

/// MCX's nested spheres, by labels.
fn spheres(bench: &Bench) -> Value {
    let mut voxels = Vec::new();
    for i in 0..216_000 {
        let away = |c: i32| (f64::from(c) - 29.5).powi(2);
        let r = (away(i % 60) + away(i / 60 % 60) + away(i / 3600)).sqrt();
        voxels.push(if r < 10.0 {
            3
        } else if r < 23.0 {
            2
        } else {
            u8::from(r < 25.0)
        });
    }
    let medium = |a: f64, s: f64, g: f64| json!({"mu_a_per_mm": a, "mu_s_per_mm": s, "index": 1.37, "phase": {"type": "henyey_greenstein", "g": g}});
    json!({"labels": {"id": bench.upload(voxels, 60, "u8", 60.0)}, "time_gate_ns": 5, "tally": "absorbed", "boundary": {"fresnel": true, "specular_entry": false},
        "media": [medium(0.02, 7.0, 0.89), medium(0.004, 0.009, 0.89), medium(0.02, 9.0, 0.89), medium(0.05, 0.5, 0.9)],
        "source": {"type": "pencil", "position_mm": [30, 30.1, 0]}})
}

/// The cube as a grid of labels, so that voxels are traversed one by one.
fn voxel_cube(bench: &Bench) -> Value {
    let mut scene = with(
        &cube60(),
        &json!({"labels": {"id": bench.upload(vec![0; 216_000], 60, "u8", 60.0)}, "media": [cube60()["medium"]]}),
    );
    scene.as_object_mut().unwrap().remove("medium");
    scene
}

fn mcx(scene: &str, photons: u64) -> Option<Value> {
    let python = concat!(env!("CARGO_MANIFEST_DIR"), "/target/bench-venv/bin/python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/mcx_photons.py");
    let output = Command::new(python).args([script, scene, &photons.to_string()]).output().ok()?;
    // The module prints a greeting before the line with the result.
    serde_json::from_slice(output.stdout.trim_ascii_end().rsplit(|b| *b == b'\n').next()?).ok()
}

fn against_mcx(bench: &Bench) {
    println!(
        "| photons/ms | device | delivered | MCX, kernel | MCX, wall | device against kernel | delivered against wall | absorbed, ours and MCX |\n|---|---|---|---|---|---|---|---|"
    );
    let bent = json!({"boundary": {"fresnel": true, "specular_entry": false}});
    for (name, theirs, scene, photons, their_photons) in [
        ("cube60", "cube60", cube60(), 8_000_000, 400_000),
        ("cube60b", "cube60b", with(&cube60(), &bent), 4_000_000, 200_000),
        ("cube60 by voxels", "cube60", voxel_cube(bench), 2_000_000, 400_000),
        ("nested spheres", "spheres", spheres(bench), 400_000, 40_000),
        ("chamber", "", json!({}), 8_000_000, 0),
    ] {
        let scene = with(&scene, &json!({"photons": photons}));
        let (mut device, mut wall, mut kernel, mut their_wall, mut absorbed) =
            (vec![], vec![], vec![], vec![], json!([null, null]));
        run(bench, &with(&scene, &json!({"photons": 10_000})));
        for _ in 0..3 {
            let ours = run(bench, &scene);
            device.push(ours.photons_per_ms);
            wall.push(ours.wall_per_ms);
            absorbed[0] = ours.result["ledger"]["absorbed"]["value"].clone();
            if let Some(peer) = (!theirs.is_empty()).then(|| mcx(theirs, their_photons)).flatten() {
                kernel.push(peer["kernel"].as_f64().unwrap());
                their_wall.push(peer["wall"].as_f64().unwrap());
                absorbed[1] = peer["absorbed"].clone();
            }
        }
        let (device, wall) = (median(device), median(wall));
        if kernel.is_empty() {
            println!("| {name} | {device:.0} | {wall:.0} | | | | | |");
            continue;
        }
        let (kernel, their_wall) = (median(kernel), median(their_wall));
        println!(
            "| {name} | {device:.0} | {wall:.0} | {kernel:.1} | {their_wall:.1} | {:.0}× | {:.0}× | {:.4}, {:.4} |",
            device / kernel,
            wall / their_wall,
            absorbed[0].as_f64().unwrap(),
            absorbed[1].as_f64().unwrap_or(f64::NAN)
        );
    }
}

/// The efficiency of a setting: the variance of a voxel times the time, relative to the first setting.
fn settings(bench: &Bench) {
    println!(
        "\n| variance × time, relative to the default | {} |\n|---|---|---|---|---|---|---|",
        SETTINGS.map(|s| s.0).join(" | ")
    );
    let shell = json!({"density": {"builtin": "sphere", "resolution": 48}, "size_mm": [20, 20, 20], "medium": {"mu_a_per_mm": 0.05, "mu_s_per_mm": 3, "index": 1}});
    let cloud = json!({"density": {"builtin": "smoke", "resolution": 64}, "size_mm": [20, 20, 20], "medium": {"mu_a_per_mm": 0.02, "mu_s_per_mm": 4, "index": 1, "phase": {"type": "henyey_greenstein", "g": 0.8}}});
    for (name, scene, photons) in [
        ("chamber", json!({}), 400_000),
        ("cube60 by voxels", with(&voxel_cube(bench), &json!({"tally": "fluence"})), 100_000),
        ("ball in a void", shell, 200_000),
        ("cloud", cloud, 200_000),
    ] {
        let mut row = Vec::new();
        for (_, setting) in SETTINGS {
            let setting: Value = serde_json::from_str(setting).unwrap();
            let fields = 6;
            let mut per_photon_s = Vec::new();
            let grids: Vec<Vec<f32>> = (0..fields)
                .map(|seed| {
                    let scene = with(&with(&scene, &setting), &json!({"photons": photons, "seed": seed}));
                    let run = run_with_field(bench, &scene, true);
                    per_photon_s.push(1e-3 / run.0.photons_per_ms);
                    run.1
                })
                .collect();
            // The variance of each voxel over the seeds, relative to the mean of the field, averaged over the voxels.
            let n = grids[0].len();
            let mean_at = |i: usize| grids.iter().map(|g| f64::from(g[i])).sum::<f64>() / f64::from(fields);
            let mean = (0..n).map(mean_at).sum::<f64>() / n as f64;
            let variance = (0..n)
                .map(|i| {
                    grids.iter().map(|g| (f64::from(g[i]) - mean_at(i)).powi(2)).sum::<f64>() / f64::from(fields - 1)
                })
                .sum::<f64>()
                / n as f64;
            row.push(variance / (mean * mean) * median(per_photon_s) * f64::from(photons));
        }
        let shown: Vec<String> = row.iter().map(|v| format!("{:.2}", v / row[0])).collect();
        println!("| {name} | {} |", shown.join(" | "));
    }
}

const SETTINGS: [(&str, &str); 6] = [
    ("default", "{}"),
    ("exact, track length", r#"{"tracking": "exact", "estimator": "track_length"}"#),
    ("exact, collision", r#"{"tracking": "exact", "estimator": "collision"}"#),
    ("delta, track length", r#"{"tracking": "delta", "estimator": "track_length"}"#),
    ("delta, collision", r#"{"tracking": "delta", "estimator": "collision"}"#),
    (
        "delta, global majorant, collision",
        r#"{"tracking": "delta", "estimator": "collision", "majorant": {"grid": "global"}}"#,
    ),
];

fn threads() {
    println!("\n| photons/ms on cube60 | 1 thread | all threads | ratio |\n|---|---|---|---|");
    let (one, all) = (Bench::new(&[("POCL_MAX_PTHREAD_COUNT", "1")]), Bench::new(&[]));
    let scene = with(&cube60(), &json!({"photons": 2_000_000}));
    let (mut single, mut every, mut ratio) = (vec![], vec![], vec![]);
    for _ in 0..5 {
        let (a, b) = (run(&one, &scene).photons_per_ms, run(&all, &scene).photons_per_ms);
        single.push(a);
        every.push(b);
        ratio.push(b / a);
    }
    println!("| | {:.0} | {:.0} | {:.2}× |", median(single), median(every), median(ratio));
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let asked = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let bench = Bench::new(&[]);
    if asked("mcx") {
        against_mcx(&bench);
    }
    if asked("settings") {
        settings(&bench);
    }
    drop(bench);
    if asked("threads") {
        threads();
    }
}
