//! A smooth blob in finer and coarser voxels: the same picture but for the error of linear interpolation.

use glam::{DVec3, dvec3};
use serde_json::json;

use super::{Experiment, sample};
use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::{Eye, inside};
use crate::study::verdict::{Findings, Sweep};
use crate::study::{Scale, view};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "resampled",
    title: "A volume resampled finer or coarser",
    codes: &[],
    expected: "the same picture within the discretisation error",
    run,
};

const SIDE: usize = 48;
/// The width s of the blob e^(−r² / 2 s²), and its greatest extinction.
const WIDTH: f64 = 0.3;
const SIGMA: f64 = 3.0;
/// The greatest permitted error, relative, however coarse the voxels.
const COARSEST: f64 = 0.1;
/// Steps of the host's integral.
const STEPS: usize = 500;

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let blob = |p: DVec3| (-p.length_squared() / (2.0 * WIDTH * WIDTH)).exp();
    let eye = Eye { eye: dvec3(1.5, 0.8, 2.5), wide: 2.0 };
    let forward = eye.forward();
    let [centres, _] = eye.picture(SIDE, |origin| {
        let Some((near, far)) = inside(origin, forward, DVec3::ONE) else { return 0.0 };
        let h = (far - near) / STEPS as f64;
        let sum: f64 = (0..STEPS).map(|i| blob(origin + forward * (near + (i as f64 + 0.5) * h))).sum();
        -(-SIGMA * sum * h).exp_m1()
    });
    let truth = centres.iter().sum::<f64>() / centres.len() as f64;
    let points = json!([{"value": 0, "color": [1, 1, 1], "opacity_per_unit": 0}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": SIGMA}]);
    let mut sweeps = Vec::new();
    for interpolation in ["trilinear", "nearest", "b_spline", "catmull_rom"] {
        let mut samples = Vec::new();
        for n in scale.pick(vec![8, 16, 32, 64], vec![8, 12, 16, 24, 32, 48, 64, 96, 128]) {
            let volume = bench.floats([n; 3], [2.0; 3], |p| blob(DVec3::from(p)))?;
            let h = 2.0 / n as f64;
            // A step is a fixed length, so that only the voxels change.
            let own = json!({"transfer_function": {"points": points}, "jitter": false, "opacity_threshold": 1,
                "interpolation": interpolation, "step_voxels": (0.02 / h).max(0.05)});
            let run = bench.run(&view("emission_absorption", &volume, &eye.json(), SIDE, 1, &own), Reads::Luminance)?;
            let measured = run.values.iter().sum::<f64>() / run.values.len() as f64;
            let mut sample = sample(&run, h, [measured, 0.0], truth);
            // The greatest second derivative is 1 / s². Linear interpolation is wrong by up to 3 h²/8 of it, nearest by h/2 of the first
            // derivative, a spline's smoothing by h²/6 of three second ones. A path through the box is at most 2 √3 long. Different places
            // are wrong by different amounts, so the mean over the picture is wrong by a part of this.
            let [slope, bend] = [(-0.5f64).exp() / WIDTH, 1.0 / (WIDTH * WIDTH)];
            let density = match interpolation {
                "nearest" => 0.5 * h * 3f64.sqrt() * slope,
                "trilinear" => 3.0 / 8.0 * h * h * bend,
                _ => 0.5 * h * h * bend,
            };
            sample.permitted = (SIGMA * density * 4.0 * WIDTH).min(COARSEST) * truth;
            samples.push(sample);
        }
        sweeps.push(Sweep { method: interpolation.into(), tolerance: 0.0, samples });
    }
    Ok(Findings { of: "voxel side".into(), quantity: "mean luminance of the picture".into(), sweeps, heat_map: None })
}
