//! The composite of a scanned head against one of 64 times finer steps.

use std::path::PathBuf;

use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::Bench;
use crate::study::oracle::{Eye, Grid, inside};
use crate::study::{Case, Scale, Setting, Trial, Truth, view};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "composite",
    title: "The composite of an MRI head, by step and by what is known of a step",
    when: "a scan, and want a picture",
    choose: "`emission_absorption` with a step of two voxels for 1 %, half a voxel for 0.1 %",
    trial,
};

const SIDE: usize = 96;
/// The points as value, red, green, blue, opacity per mm: skin, brain, and bright tissue in between.
const POINTS: [[f64; 5]; 5] = [
    [20.0, 0.8, 0.5, 0.4, 0.0],
    [60.0, 0.9, 0.6, 0.4, 0.03],
    [90.0, 0.9, 0.8, 0.7, 0.02],
    [130.0, 1.0, 0.9, 0.8, 0.3],
    [255.0, 1.0, 1.0, 1.0, 1.0],
];
/// The steps per voxel of the reference.
const STEPS_PER_VOXEL: f64 = 64.0;

/// The MRI head of Debian's `mricron-data`, or the file that CLOUDCHAMBER_TEST_MRI names.
fn file() -> PathBuf {
    std::env::var_os("CLOUDCHAMBER_TEST_MRI")
        .map_or_else(|| "/usr/share/mricron/templates/ch2.nii.gz".into(), Into::into)
}

fn trial(bench: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let path = file();
    let Ok(bytes) = std::fs::read(&path) else {
        return Ok(Err(format!("needs {}, of Debian's mricron-data", path.display())));
    };
    let id = bench.assets().volumes().insert(bytes, "head", None)?.1;
    let volume = bench.assets().volumes().get(&id)?;
    let grid = Grid::of_volume(&volume)?;
    let voxel = volume.smallest_side();
    let eye = Eye { eye: DVec3::new(300.0, 190.0, 140.0), wide: 240.0 };
    let truth = reference(&grid, eye, voxel / STEPS_PER_VOXEL);
    let points: Vec<Value> = POINTS
        .iter()
        .map(|[value, r, g, b, opacity]| json!({"value": value, "color": [r, g, b], "opacity_per_unit": opacity}))
        .collect();
    let mut settings = Vec::new();
    for (line, pre_integrated, threshold, order) in [
        ("a sample a step", false, 1.0, Some(2.0)),
        ("pre-integrated", true, 1.0, Some(2.0)),
        ("a sample a step, to opacity 0.999", false, 0.999, None),
        ("pre-integrated, to opacity 0.99", true, 0.99, None),
    ] {
        for step in scale.pick(vec![4.0, 2.0, 1.0, 0.5], vec![8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125]) {
            let own = json!({"transfer_function": {"points": points}, "step_voxels": step, "jitter": false,
                "opacity_threshold": threshold, "pre_integrated": pre_integrated});
            let request = view("emission_absorption", &json!({"id": id}), &eye.json(), SIDE, 1, &own);
            settings.push(Setting::stepped(line, "step / voxel", step, order, request));
        }
    }
    let truth = Truth {
        words: format!("the host's composite in double precision, {STEPS_PER_VOXEL} steps a voxel"),
        values: truth.clone(),
        centres: Some(truth),
        size: Some([SIDE; 2]),
        known_to: 1e-5,
    };
    Ok(Ok(Trial { truth, settings }))
}

/// The luminance and the opacity per mm of a value, linear between the points.
fn classified(value: f64) -> [f64; 2] {
    let at = POINTS.iter().position(|p| p[0] > value);
    let row = match at {
        Some(0) => POINTS[0],
        None => POINTS[POINTS.len() - 1],
        Some(i) => {
            let (a, b) = (POINTS[i - 1], POINTS[i]);
            let part = (value - a[0]) / (b[0] - a[0]);
            std::array::from_fn(|k| a[k] + part * (b[k] - a[k]))
        }
    };
    [0.2126 * row[1] + 0.7152 * row[2] + 0.0722 * row[3], row[4]]
}

/// I = Σ c (1 − e^(−σ h)) Π e^(−σ h), front to back at the middles of steps of `step`, at the pixels' centres.
fn reference(grid: &Grid, eye: Eye, step: f64) -> Vec<f64> {
    let forward = eye.forward();
    let pixel = |i: usize| {
        let place = |v: usize| (v as f64 + 0.5) / SIDE as f64;
        let origin = eye.origin(place(i % SIDE), place(i / SIDE));
        let Some((near, far)) = inside(origin, forward, grid.half) else { return 0.0 };
        let steps = ((far - near) / step).ceil();
        let h = (far - near) / steps;
        let (mut light, mut through) = (0.0, 1.0);
        for k in 0..steps as usize {
            let [luminance, sigma] = classified(grid.trilinear(origin + forward * (near + (k as f64 + 0.5) * h)));
            let alpha = -(-sigma * h).exp_m1();
            light += through * alpha * luminance;
            through *= 1.0 - alpha;
        }
        light
    };
    (0..SIDE * SIDE).into_par_iter().map(pixel).collect()
}
