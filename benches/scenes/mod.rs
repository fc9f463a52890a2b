//! The common part of the benchmarks of views: the synthetic volume, its views, and a client that times frames.

#![allow(dead_code, reason = "each benchmark uses its own part of this")]

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::{Value, json};

use super::common::Server;

/// The number of frames of a full turn.
pub const FRAMES: usize = 12;
/// The voxels along a side of the volume that is compared with VTK.
pub const SIDE: usize = 256;

/// exp(−4r²)(0.6 + 0.4 sin 14x sin 14y sin 14z) on [−1, 1]³ as bytes.
pub fn synthetic(side: usize) -> Vec<u8> {
    let place = |i: usize| (i as f64 + 0.5) / side as f64 * 2.0 - 1.0;
    let mut voxels = Vec::with_capacity(side.pow(3));
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                let [x, y, z] = [x, y, z].map(place);
                let waves = 0.6 + 0.4 * (14.0 * x).sin() * (14.0 * y).sin() * (14.0 * z).sin();
                let value = (-4.0 * (x * x + y * y + z * z)).exp() * waves;
                voxels.push((value * 255.0).round().clamp(0.0, 255.0) as u8);
            }
        }
    }
    voxels
}

/// Numbers with commas between them.
pub fn list<T: ToString>(of: [T; 3]) -> String {
    of.map(|v| v.to_string()).join(",")
}

/// The seconds of a frame of VTK's, of a volume of bytes seen from a distance; `None` without VTK. Its first picture goes to `out`.
pub fn vtk(
    raw: &Path,
    dims: [usize; 3],
    spacing: [f64; 3],
    distance: f64,
    mode: &str,
    out: Option<&Path>,
) -> Option<f64> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(root.join("target/bench-venv/bin/python"));
    command.arg(root.join("benches/vtk_views.py")).arg(raw).args([list(dims), list(spacing), distance.to_string()]);
    let output = command.args(["6", mode]).args(out).output().ok()?;
    serde_json::from_slice(&output.stdout).ok()
}

/// The measured modes: the name here and in `vtk_views.py`, the technique, its parameters.
pub fn modes() -> Vec<(&'static str, &'static str, Value)> {
    // VTK's opacities are for four voxels. VTK ends a ray when 0.8 % gets through, and takes its samples without jitter.
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
    let composite = json!({"transfer_function": {"points": points}, "opacity_threshold": 0.992, "jitter": false});
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

/// Frame `i` of a full turn around the volume.
pub fn scene(volume: &str, i: usize, technique: &str, parameters: &Value) -> Value {
    let angle = i as f64 / FRAMES as f64 * std::f64::consts::TAU;
    let mut scene = json!({
        "technique": technique, "volume": {"id": volume}, "image": {"width": 512, "height": 512}, "budget": {"samples": 1},
        "camera": {"eye": [3.6 * angle.sin(), -3.6 * angle.cos(), 1.2], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 30},
    });
    scene[technique] = parameters.clone();
    scene
}

/// A delivered frame.
pub struct Frame {
    pub wall_s: f64,
    pub device_s: f64,
    pub png: Vec<u8>,
}

pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// A server and a client that waits for each frame.
pub struct Client {
    pub server: Server,
    runtime: tokio::runtime::Runtime,
    client: reqwest::Client,
}

impl Client {
    pub fn new(flags: &[&str]) -> Self {
        Self {
            server: Server::start_with(flags).once_compiled(),
            runtime: tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap(),
            client: reqwest::Client::builder().no_proxy().build().unwrap(),
        }
    }

    /// Uploads bytes on [−1, 1]³ and returns the volume's id.
    pub fn upload(&self, voxels: Vec<u8>, side: usize) -> String {
        let spacing = 2.0 / side as f64;
        let query = format!("dims={side},{side},{side}&type=u8&spacing={spacing},{spacing},{spacing}");
        let url = format!("{}/v1/volumes?{query}", self.server.url());
        let upload = self.client.post(url).header("Content-Type", "application/octet-stream").body(voxels);
        let reply: Value = self.runtime.block_on(async { upload.send().await.unwrap().json().await.unwrap() });
        reply["id"].as_str().unwrap_or_else(|| panic!("{reply}")).to_owned()
    }

    pub fn frame(&self, scene: &Value) -> Frame {
        let post =
            self.client.post(format!("{}/v1/renders", self.server.url())).header("Accept", "image/png").json(scene);
        let started = Instant::now();
        let (headers, png) = self.runtime.block_on(async {
            let reply = post.send().await.unwrap().error_for_status().unwrap();
            (reply.headers().clone(), reply.bytes().await.unwrap().to_vec())
        });
        let wall_s = started.elapsed().as_secs_f64();
        let device_s = headers["x-cloudchamber-device-ms"].to_str().unwrap().parse::<f64>().unwrap() / 1e3;
        Frame { wall_s, device_s, png }
    }
}
