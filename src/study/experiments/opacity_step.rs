//! The step of a composite. Opacity must not depend on it at all in a slab of one medium. If density changes within a step, opacity may
//! depend on it by no more than the reply says.

use serde_json::{Value, json};

use super::{Experiment, mean, sample};
use crate::error::Result;
use crate::study::bench::{Bench, Reads, Run};
use crate::study::verdict::{Findings, HeatMap, Sample, Sweep};
use crate::study::{Scale, view};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "opacity_step",
    title: "The step of a composite",
    codes: &["coarse_step"],
    expected: "in a slab alpha within 1/255 of 1 − e^(−τ) over 16 times the step",
    run,
};

const GREY_LEVEL: f64 = 1.0 / 255.0;

/// The sampling of a ray. If there is more than one sample, they begin at random places within the first step.
#[derive(Clone, Copy)]
struct How {
    samples: u64,
    pre_integrated: bool,
}

const PLAIN: How = How { samples: 1, pre_integrated: false };

/// Looks along z at a volume with this opacity per unit at a value of 1.
fn alpha(bench: &Bench, volume: &Value, sigma_per_unit: f64, step: f64, how: How) -> Result<Run> {
    let points = json!([{"value": 0, "color": [1, 1, 1], "opacity_per_unit": 0},
        {"value": 1, "color": [1, 1, 1], "opacity_per_unit": sigma_per_unit}]);
    let own = json!({"transfer_function": {"points": points}, "step_voxels": step, "jitter": how.samples > 1, "opacity_threshold": 1,
        "pre_integrated": how.pre_integrated});
    let camera = json!({"eye": [0.13, 0.07, 5], "target": [0.13, 0.07, 0], "up": [0, 1, 0], "fov_y_deg": 0.1, "projection": "orthographic"});
    bench.run(&view("emission_absorption", volume, &camera, 16, how.samples, &own), Reads::Transmittance)
}

fn run(bench: &Bench, _: Scale) -> Result<Findings> {
    let constant = json!({"builtin": "constant", "resolution": 32});
    let mut sweeps = Vec::new();
    for (depth, how) in [(0.1, PLAIN), (1.0, PLAIN), (5.0, PLAIN), (1.0, How { pre_integrated: true, ..PLAIN })] {
        let mut samples = Vec::new();
        for step in [0.25, 0.5, 1.0, 2.0, 4.0] {
            let run = alpha(bench, &constant, depth / 2.0, step, how)?;
            let mut sample = sample(&run, step, [1.0 - mean(&run.values)[0], 0.0], -(-depth).exp_m1());
            sample.permitted = GREY_LEVEL;
            sample.predicted = Some(sample.truth);
            samples.push(sample);
        }
        let words = if how.pre_integrated { ", pre-integrated" } else { "" };
        sweeps.push(Sweep { method: format!("an even slab of depth {depth}{words}"), tolerance: GREY_LEVEL, samples });
    }
    let volume = edges(bench)?;
    for (words, how) in [
        ("", PLAIN),
        (", 64 samples", How { samples: 64, ..PLAIN }),
        (", pre-integrated", How { pre_integrated: true, ..PLAIN }),
    ] {
        let samples = STEPS.into_iter().map(|step| edge(bench, &volume, 1.0, step, how)).collect::<Result<_>>()?;
        sweeps.push(Sweep { method: format!("edges of a voxel, depth 1{words}"), tolerance: GREY_LEVEL, samples });
    }
    let depths = vec![0.1, 0.3, 1.0, 3.0, 10.0];
    let row = |depth: &f64| -> Result<Vec<Sample>> {
        STEPS.into_iter().map(|step| edge(bench, &volume, *depth, step, PLAIN)).collect()
    };
    let heat_map = HeatMap {
        title: "The opacity of a slab with edges of a voxel".into(),
        tolerance: 0.0,
        axes: ["step / voxel".into(), "optical depth".into()],
        across: STEPS.into(),
        samples: depths.iter().map(row).collect::<Result<_>>()?,
        up: depths,
    };
    Ok(Findings { of: "step / voxel".into(), quantity: "alpha".into(), sweeps, heat_map: Some(heat_map) })
}

const STEPS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// The slab's voxels of the 32 along the ray. Their number is no multiple of a long step.
const SLAB: std::ops::Range<f64> = 9.0..20.0;

/// A slab with soft edges, one voxel wide, in an empty box. Its depth is the sum over the voxels.
fn edges(bench: &Bench) -> Result<Value> {
    bench.floats([4, 4, 32], [2.0; 3], |p| f64::from(u8::from(SLAB.contains(&(16.0 * (p[2] + 1.0))))))
}

fn edge(bench: &Bench, volume: &Value, depth: f64, step: f64, how: How) -> Result<Sample> {
    let length = (SLAB.end - SLAB.start) / 16.0;
    let run = alpha(bench, volume, depth / length, step, how)?;
    let truth = -(-depth).exp_m1();
    let mut sample = sample(&run, step, [1.0 - mean(&run.values)[0], 0.0], truth);
    // The reply's error is relative to the picture's mean, and the picture is uniform. A grey level is not seen.
    sample.permitted = (run.stated_error.unwrap_or(0.0) * truth).max(GREY_LEVEL);
    Ok(sample)
}
