//! `./dev bench tomography`: filtered backprojection of Shepp and Logan's head, 512² voxels from 360 views of 729 bins, beside scikit-image and ASTRA on the
//! same threads where they are there. Prints Markdown. `DEVICE=gpu` measures another device.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod posts;

use std::process::Command;
use std::time::Instant;

use glam::DVec3;
use posts::{Bench, median};
use serde_json::json;

const SIDE: usize = 512;
const REPEATS: usize = 7;

/// The root mean square error within the circle, against means over 4 × 4 points of each voxel.
fn rmse(nrrd: &[u8]) -> f64 {
    let start = nrrd.windows(2).position(|w| w == b"\n\n").unwrap() + 2;
    let values: Vec<f32> = nrrd[start..].chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap())).collect();
    let head: cloudchamber::tomography::PhantomRequest =
        serde_json::from_value(json!({"name": "shepp_logan", "radius_mm": 1})).unwrap();
    let head = head.resolve("").unwrap();
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let (mut squares, mut count) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let (x, y) = (i % SIDE, i / SIDE);
        if place(x, SIDE).hypot(place(y, SIDE)) >= 1.0 {
            continue;
        }
        let point = |p: usize| head.at(DVec3::new(place(4 * x + p % 4, 4 * SIDE), place(4 * y + p / 4, 4 * SIDE), 0.0));
        let mean = (0..16).map(point).sum::<f64>() / 16.0;
        (squares, count) = (squares + (f64::from(*value) - mean).powi(2), count + 1.0);
    }
    f64::sqrt(squares / count)
}

fn main() {
    let bench = Bench::new(&[]);
    let spacing = 2.0 / SIDE as f64;
    let own = json!({"sinogram": {"projection": {"of": {"phantom": {"name": "shepp_logan", "radius_mm": 1}},
        "geometry": {"angles_deg": {"count": 360}, "detector": {"count": [729, 1], "spacing_mm": [spacing, spacing]}}}},
        "grid": {"dims": [SIDE, SIDE, 1], "spacing_mm": [spacing, spacing, spacing]}});
    let body = json!({"technique": "slice", "volume": {"fbp": own}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}});
    let (mut wall, mut device, mut error) = (Vec::new(), Vec::new(), 0.0);
    for repeat in 0..=REPEATS {
        let started = Instant::now();
        let (place, _) = bench.picture(&body, "png");
        let grid = bench.get(&format!("{place}/field"));
        let took = 1e3 * started.elapsed().as_secs_f64();
        let resource = bench.resource(&place);
        // The first one compiles.
        if repeat > 0 {
            wall.push(took);
            device.push(resource["result"]["device_ms"].as_f64().unwrap_or_else(|| panic!("{resource}")));
        }
        error = rmse(&grid);
    }
    println!(
        "| filtered backprojection, 512², 360 views of 729 bins | request to grid, ms | device, ms | RMSE in the circle |"
    );
    println!("|---|---|---|---|");
    println!("| cloudchamber | {:.0} | {:.1} | {error:.4} |", median(wall), median(device));
    let script = "benches/fbp_peers.py";
    match Command::new("target/bench-venv/bin/python").arg(script).output() {
        Ok(done) if done.status.success() => print!("{}", String::from_utf8_lossy(&done.stdout)),
        _ => println!("<!-- {script}: not here -->"),
    }
}
