//! A camera in odd places: within the volume, on its faces, behind it, a million units away, exactly along an axis.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::{Experiment, mean, sample};
use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::inside;
use crate::study::verdict::{Findings, Sweep};
use crate::study::{Scale, view};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "cameras",
    title: "Cameras in odd places: 1 oblique, 2 along an axis, 3 within, 4 within along an axis, 5 on a face, 6 on a face outwards, \
        7 behind, 8 along a diagonal, 9 a million units away along an axis, 10 a million units away, oblique",
    codes: &[],
    expected: "finite, right or empty, never garbage",
    run,
};

const SIGMA: f64 = 0.7;
const SIDE: usize = 32;
/// The angle of the picture, so small that rays hardly differ.
const FOV_DEG: f64 = 0.1;

/// The positions of the eye, each with its direction of view.
fn places() -> Vec<[DVec3; 2]> {
    let oblique = dvec3(2.0, 1.3, 3.0);
    vec![
        [oblique, -oblique],
        [dvec3(0.3, 0.2, 4.0), -DVec3::Z],
        [dvec3(0.1, 0.2, 0.3), dvec3(0.5, -0.3, 1.0)],
        [dvec3(0.1, 0.2, 0.3), DVec3::X],
        [dvec3(1.0, 0.2, 0.1), -DVec3::X],
        [dvec3(1.0, 0.2, 0.1), DVec3::X],
        [dvec3(0.0, 0.0, 3.0), DVec3::Z],
        [dvec3(2.0, 2.0, 2.0), dvec3(-1.0, -1.0, -1.0)],
        [dvec3(0.3, 0.2, 1e6), -DVec3::Z],
        [oblique.normalize() * 1e6, -oblique],
    ]
}

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let volume = json!({"builtin": "constant", "resolution": 32});
    let ends = [0, 1].map(|v| json!({"value": v, "color": [1, 1, 1], "opacity_per_unit": SIGMA}));
    let methods: [(&str, &str, Value, Reads); 3] = [
        (
            "emission_absorption",
            "emission_absorption",
            json!({"transfer_function": {"points": ends}, "jitter": false, "opacity_threshold": 1}),
            Reads::Transmittance,
        ),
        (
            "projection, xray",
            "projection",
            json!({"mode": "xray", "sigma_per_value": SIGMA, "zero_value": 0, "output": "value"}),
            Reads::Luminance,
        ),
        (
            "volume_path",
            "volume_path",
            json!({"medium": {"sigma_t_per_unit": SIGMA, "albedo": 0}, "lights": [{"type": "sky", "radiance": 1}]}),
            Reads::Luminance,
        ),
    ];
    let mut sweeps = Vec::new();
    for (name, technique, own, reads) in methods {
        let samples = if technique == "volume_path" { scale.pick(16, 256) } else { 1 };
        let mut found = Vec::new();
        for (i, [eye, forward]) in places().into_iter().enumerate() {
            let forward = forward.normalize();
            let up = if forward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
            let camera = json!({"eye": eye.to_array(), "target": (eye + forward).to_array(), "up": up.to_array(), "fov_y_deg": FOV_DEG,
                "projection": if i < 8 { "perspective" } else { "orthographic" }});
            let run = bench.run(&view(technique, &volume, &camera, SIDE, samples, &own), reads)?;
            let length = inside(eye, forward, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
            let mut sample = sample(&run, (i + 1) as f64, mean(&run.values), (-SIGMA * length).exp());
            sample.predicted = Some(sample.truth);
            // Over so small an angle lengths differ by thousandths.
            sample.permitted = 2e-3;
            found.push(sample);
        }
        sweeps.push(Sweep { method: name.into(), tolerance: 5e-3, samples: found });
    }
    Ok(Findings {
        of: "place".into(),
        quantity: "what gets through a box of one medium".into(),
        sweeps,
        heat_map: None,
    })
}
