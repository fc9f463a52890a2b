//! `./dev bench views`: every view on the synthetic 256³ volume against VTK's CPU ray caster, side by side in one run.
//! Prints Markdown.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::process::Command;
use std::time::Instant;

use common::Server;
use serde_json::{Value, json};

const FRAMES: usize = 12;
const SIDE: usize = 256;

/// exp(−4r²)(0.6 + 0.4 sin 14x sin 14y sin 14z) on [−1, 1]³ as bytes.
fn synthetic() -> Vec<u8> {
    let place = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
    let mut voxels = Vec::with_capacity(SIDE.pow(3));
    for z in 0..SIDE {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let [x, y, z] = [x, y, z].map(place);
                let waves = 0.6 + 0.4 * (14.0 * x).sin() * (14.0 * y).sin() * (14.0 * z).sin();
                let value = (-4.0 * (x * x + y * y + z * z)).exp() * waves;
                voxels.push((value * 255.0).round().clamp(0.0, 255.0) as u8);
            }
        }
    }
    voxels
}

/// What is measured: its name here and in `vtk_synth.py`, the technique, its parameters.
fn modes() -> Vec<(&'static str, &'static str, Value)> {
    // VTK's opacities are for four voxels; it ends a ray when 0.8 % gets through.
    let unit = 4.0 * 2.0 / SIDE as f64;
    let point = |value: f64, color: [f64; 3], opacity: f64| json!({"value": value, "color": color, "opacity_per_unit": -(1.0 - opacity).ln() / unit});
    let points: Vec<Value> = (0..=50)
        .map(|i| {
            let f = f64::from(i) / 50.0;
            let mix = |a: [f64; 3], b: [f64; 3], f: f64| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * f);
            let (low, middle, high) = ([0.1, 0.1, 0.6], [0.9, 0.5, 0.2], [1.0, 1.0, 0.9]);
            let color = if f < 0.5 { mix(low, middle, 2.0 * f) } else { mix(middle, high, 2.0 * f - 1.0) };
            point(5.0 + 250.0 * f, color, 0.6 * f)
        })
        .collect();
    let light = json!({"ambient": 0.2, "diffuse": 0.7, "specular": 0.2, "shininess": 10});
    let composite = json!({"transfer_function": {"points": points}, "opacity_threshold": 0.992});
    let mut shaded = composite.clone();
    shaded["shading"] = true.into();
    shaded["light"] = light.clone();
    vec![
        ("composite", "emission_absorption", composite),
        ("shaded", "emission_absorption", shaded),
        ("maximum", "projection", json!({})),
        ("isosurface", "isosurface", json!({"isovalue": 76.5, "light": light})),
    ]
}

fn scene(volume: &str, i: usize, technique: &str, parameters: &Value) -> Value {
    let angle = i as f64 / FRAMES as f64 * std::f64::consts::TAU;
    let mut scene = json!({
        "technique": technique, "volume": {"id": volume}, "image": {"width": 512, "height": 512}, "budget": {"samples": 1},
        "camera": {"eye": [3.6 * angle.sin(), -3.6 * angle.cos(), 1.2], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 30},
    });
    scene[technique] = parameters.clone();
    scene
}

struct Frame {
    wall_s: f64,
    device_s: f64,
    png: Vec<u8>,
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn vtk(volume: &std::path::Path, mode: &str) -> Option<f64> {
    let python = concat!(env!("CARGO_MANIFEST_DIR"), "/target/bench-venv/bin/python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/vtk_synth.py");
    let output = Command::new(python).args([script.as_ref(), volume.as_os_str()]).args(["6", mode]).output().ok()?;
    serde_json::from_slice(&output.stdout).ok()
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let no_vtk = std::env::var_os("NO_VTK").is_some();
    let server = Server::start_with(&[]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let client = reqwest::Client::builder().no_proxy().build().unwrap();
    let voxels = synthetic();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("synthetic.raw");
    std::fs::write(&path, &voxels).unwrap();
    let url = format!("{}/v1/volumes?dims=256,256,256&type=u8&spacing=0.0078125,0.0078125,0.0078125", server.url());
    let upload = client.post(url).header("Content-Type", "application/octet-stream").body(voxels);
    let reply: Value = runtime.block_on(async { upload.send().await.unwrap().json().await.unwrap() });
    let volume = reply["id"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned();
    let frame = |scene: &Value| {
        let post = client.post(format!("{}/v1/renders", server.url())).header("Accept", "image/png").json(scene);
        let started = Instant::now();
        let (headers, png) = runtime.block_on(async {
            let reply = post.send().await.unwrap().error_for_status().unwrap();
            (reply.headers().clone(), reply.bytes().await.unwrap().to_vec())
        });
        let wall_s = started.elapsed().as_secs_f64();
        let device_s = headers["x-cloudchamber-device-ms"].to_str().unwrap().parse::<f64>().unwrap() / 1e3;
        Frame { wall_s, device_s, png }
    };
    println!(
        "| 256³ u8, 512², one voxel a step | device | delivered | VTK | device against VTK | delivered against VTK |\n|---|---|---|---|---|---|"
    );
    for (mode, technique, parameters) in modes() {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == mode) {
            continue;
        }
        let mut theirs = Vec::new();
        let mut ours = Vec::new();
        frame(&scene(&volume, 0, technique, &parameters));
        // In turns, so that a noisy neighbour troubles both.
        for _ in 0..3 {
            ours.extend((0..FRAMES).map(|i| frame(&scene(&volume, i, technique, &parameters))));
            theirs.extend((!no_vtk).then(|| vtk(&path, mode)).flatten());
        }
        if let Some(folder) = std::env::var_os("PICTURES") {
            std::fs::write(std::path::Path::new(&folder).join(format!("{mode}.png")), &ours[1].png).unwrap();
        }
        let (device, wall) = (median(ours.iter().map(|f| f.device_s)), median(ours.iter().map(|f| f.wall_s)));
        let least = 1e3 * ours.iter().map(|f| f.device_s).fold(f64::INFINITY, f64::min);
        let vtk = if theirs.is_empty() { f64::NAN } else { median(theirs) };
        println!(
            "| {mode} | {:.1} ms (least {least:.1}) | {:.1} ms, {:.1} frames/s | {:.0} ms, {:.2} frames/s | {:.1}× | {:.1}× |",
            1e3 * device,
            1e3 * wall,
            1.0 / wall,
            1e3 * vtk,
            1.0 / vtk,
            vtk / device,
            vtk / wall
        );
    }
}
