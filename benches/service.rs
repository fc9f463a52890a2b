//! `./dev bench`: the numbers of the MRI head, all from one run on one machine, as medians and ratios. Prints Markdown.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::process::Command;
use std::time::Instant;

use common::Server;
use serde_json::{Value, json};

const FRAMES: usize = 24;

/// The benchmark's scene from place `i` of a full turn: the camera and transfer function of `benches/vtk_mri.py`.
fn scene(volume: &str, i: usize, samples: u32, parameters: Value) -> Value {
    let angle = i as f64 / FRAMES as f64 * std::f64::consts::TAU;
    let mut own = json!({"transfer_function": {"points": [
        {"value": 30, "color": [0.01, 0.01, 0.32], "opacity_per_unit": 0}, {"value": 200, "color": [1, 1, 0.8], "opacity_per_unit": 0.15}]}});
    own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
    json!({
        "technique": "emission_absorption", "volume": {"id": volume}, "image": {"width": 512, "height": 512},
        "camera": {"eye": [390.0 * angle.sin(), -390.0 * angle.cos(), 130], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 30},
        "budget": {"samples": samples}, "emission_absorption": own
    })
}

struct Bench {
    server: Server,
    client: reqwest::Client,
    runtime: tokio::runtime::Runtime,
    volume: String,
}

/// One delivered frame: the seconds until all bytes were here, the device's and the server's part of them, and the bytes.
struct Delivered {
    wall_s: f64,
    device_s: f64,
    server_s: f64,
    png: Vec<u8>,
}

impl Bench {
    fn new(flags: &[&str]) -> Self {
        let server = Server::start_with(flags).once_compiled();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let client = reqwest::Client::builder().no_proxy().build().unwrap();
        let upload = client.post(format!("{}/v1/volumes", server.url())).body(common::mri_head());
        let reply: Value = runtime.block_on(async { upload.send().await.unwrap().json().await.unwrap() });
        let volume = reply["id"].as_str().unwrap().to_owned();
        Self { server, client, runtime, volume }
    }

    fn frame(&self, scene: &Value) -> Delivered {
        let post =
            self.client.post(format!("{}/v1/renders", self.server.url())).header("Accept", "image/png").json(scene);
        let started = Instant::now();
        let (headers, png) = self.runtime.block_on(async {
            let reply = post.send().await.unwrap().error_for_status().unwrap();
            (reply.headers().clone(), reply.bytes().await.unwrap().to_vec())
        });
        let wall_s = started.elapsed().as_secs_f64();
        let header = |name: &str| headers[name].to_str().unwrap().parse::<f64>().unwrap() / 1e3;
        Delivered {
            wall_s,
            device_s: header("x-cloudchamber-device-ms"),
            server_s: header("x-cloudchamber-elapsed-ms"),
            png,
        }
    }

    /// A full turn, with one pass per frame, after one frame of warm-up.
    fn turn(&self, parameters: &Value) -> Vec<Delivered> {
        self.frame(&scene(&self.volume, 0, 1, parameters.clone()));
        (0..FRAMES).map(|i| self.frame(&scene(&self.volume, i, 1, parameters.clone()))).collect()
    }
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn row(what: &str, value: String) {
    println!("| {what} | {value} |");
}

/// The largest difference between two pictures, in grey levels.
fn difference(a: &[u8], b: &[u8]) -> u8 {
    let open = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().to_rgb8().into_raw();
    open(a).iter().zip(open(b)).map(|(a, b)| a.abs_diff(b)).max().unwrap()
}

/// The seconds for all samples of the frame's rays if eight loads each were all the work, at two a cycle on every core.
fn floor_s(device: &Value) -> f64 {
    let half = glam::dvec3(90.5, 108.5, 90.5);
    let eye = glam::dvec3(0.0, -390.0, 130.0);
    let forward = -eye.normalize();
    let right = forward.cross(glam::DVec3::Z).normalize();
    let up = right.cross(forward);
    let tangent = 15f64.to_radians().tan();
    let mut samples = 0.0;
    for pixel in 0..512 * 512 {
        let place = |i: usize| ((i as f64 + 0.5) / 256.0 - 1.0) * tangent;
        let inverse = 1.0 / (forward + right * place(pixel % 512) - up * place(pixel / 512)).normalize();
        let (a, b) = ((-half - eye) * inverse, (half - eye) * inverse);
        samples += (a.max(b).min_element() - a.min(b).max_element().max(0.0)).max(0.0).ceil();
    }
    let (cores, mhz) = (device["compute_units"].as_f64().unwrap(), device["clock_mhz"].as_f64().unwrap());
    samples * 8.0 / (2.0 * cores * mhz * 1e6)
}

fn vtk() -> Option<Value> {
    let python = concat!(env!("CARGO_MANIFEST_DIR"), "/target/bench-venv/bin/python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/vtk_mri.py");
    let mri =
        std::env::var("CLOUDCHAMBER_TEST_MRI").unwrap_or_else(|_| "/usr/share/mricron/templates/ch2.nii.gz".into());
    let output = Command::new(python).args([script, &mri, "12"]).output().ok()?;
    serde_json::from_slice(&output.stdout).ok()
}

fn main() {
    let (wide, narrow) = (Bench::new(&[]), Bench::new(&["--lanes", "1"]));
    let device: Value = wide.runtime.block_on(async {
        wide.client.get(format!("{}/v1/device", wide.server.url())).send().await.unwrap().json().await.unwrap()
    });
    let name = |v: &Value| v.as_str().unwrap_or_default().to_owned();
    println!(
        "{}, {}, {} lanes, {} cores\n",
        name(&device["platform_version"]),
        name(&device["device"]),
        device["lanes"],
        device["compute_units"]
    );
    println!("| MRI head 181×217×181, 512², one voxel a step | |\n|---|---|");
    let plain = json!({});
    let (unshaded, single) = (wide.turn(&plain), narrow.turn(&plain));
    let shaded = wide.turn(&json!({"shading": true}));
    let device_s = |d: &[Delivered]| median(d.iter().map(|f| f.device_s));
    let wall_s = |d: &[Delivered]| median(d.iter().map(|f| f.wall_s));
    row("device, a frame, unshaded", format!("{:.1} ms", 1e3 * device_s(&unshaded)));
    row("device, a frame, shaded", format!("{:.1} ms", 1e3 * device_s(&shaded)));
    row("lanes against LANES=1, unshaded, device", format!("{:.1}×", device_s(&single) / device_s(&unshaded)));
    let worst = unshaded.iter().zip(&single).map(|(a, b)| difference(&a.png, &b.png)).max().unwrap();
    row("their pictures differ by at most", format!("{worst} of 255"));
    row("delivered over HTTP, spinning, one pass a frame", format!("{:.1} frames/s", 1.0 / wall_s(&unshaded)));
    let server_s = median(unshaded.iter().map(|f| f.server_s));
    let share = |s: f64| format!("{:.0} %", 100.0 * s / wall_s(&unshaded));
    row("of that: device", share(device_s(&unshaded)));
    row("queue and reading the film", share(server_s - device_s(&unshaded)));
    row("error, PNG and network", share(wall_s(&unshaded) - server_s));
    let preset = wide.turn(&json!({"transfer_function": {"preset": "mri_head"}}));
    row("the same with the preset mri_head, which is opaque sooner", format!("{:.1} frames/s", 1.0 / wall_s(&preset)));
    let all = wide.turn(&json!({"empty_space_skipping": false, "opacity_threshold": 1}));
    row("every sample taken (no skipping, no early end), device", format!("{:.1} ms", 1e3 * device_s(&all)));
    row(
        "against the floor of 8 loads a sample at 2 a cycle",
        format!("{:.1}× ({:.1} ms)", device_s(&all) / floor_s(&device), 1e3 * floor_s(&device)),
    );
    row(
        "resident memory of that server",
        format!("{:.0} MiB", wide.server.resident_bytes() as f64 / f64::from(1 << 20)),
    );
    row(
        "allowed: three times the volume in floats and 200 MiB",
        format!("{:.0} MiB", 200.0 + 3.0 * 4.0 * 7_109_137.0 / f64::from(1 << 20)),
    );
    match vtk() {
        Some(vtk) => {
            for (what, ours) in [("unshaded", &unshaded), ("shaded", &shaded)] {
                let theirs = vtk[what].as_f64().unwrap();
                row(
                    &format!("VTK's CPU ray caster, {what}"),
                    format!("{:.2} frames/s; ours delivered {:.1}×", 1.0 / theirs, theirs / wall_s(ours)),
                );
            }
        }
        None => row("VTK's CPU ray caster", "not there".into()),
    }
}
