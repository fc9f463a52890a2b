//! `./dev bench views`: every view on the synthetic 256³ volume against VTK's CPU ray caster, side by side in one run.
//! Prints Markdown. `DEVICE=gpu` measures another device, `NO_VTK=1` leaves VTK out, `PICTURES=folder` keeps a frame of each.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod scenes;

use scenes::{Client, FRAMES, SIDE, median, modes, scene, synthetic, vtk};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let no_vtk = std::env::var_os("NO_VTK").is_some();
    let device = std::env::var("DEVICE").unwrap_or_else(|_| "pocl".into());
    let client = Client::new(&["--device", &device]);
    let voxels = synthetic(SIDE);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("synthetic.raw");
    std::fs::write(&path, &voxels).unwrap();
    let volume = client.upload(voxels, SIDE);
    println!(
        "| 256³ u8, 512², one voxel a step | device | delivered | VTK | device against VTK | delivered against VTK |\n|---|---|---|---|---|---|"
    );
    for (mode, technique, parameters) in modes() {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == mode) {
            continue;
        }
        let mut theirs = Vec::new();
        let mut ours = Vec::new();
        client.frame(&scene(&volume, 0, technique, &parameters));
        // The two take turns, so that a noisy neighbour troubles both.
        for _ in 0..3 {
            ours.extend((0..FRAMES).map(|i| client.frame(&scene(&volume, i, technique, &parameters))));
            theirs.extend((!no_vtk).then(|| vtk(&path, [SIDE; 3], [2.0 / SIDE as f64; 3], 3.6, mode, None)).flatten());
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
