//! The transmittance of a box of one medium, at an angle: exp(−σ · length) (P19).

use glam::dvec3;
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::{Eye, inside};
use crate::study::{Case, Scale, Setting, Trial, Truth, view};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "beer_lambert",
    title: "What gets through a box of one medium",
    when: "a box of one medium that only absorbs",
    choose: "`emission_absorption` with the longest step, or an X-ray: both are exact; paths are only noise here",
    trial,
};

const SIGMA: f64 = 0.7;
const SIDE: usize = 64;

fn trial(_: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let eye = Eye { eye: dvec3(1.3, 0.9, 2.0), wide: 1.2 };
    let through = |origin| {
        let length = inside(origin, eye.forward(), dvec3(1.0, 1.0, 1.0)).map_or(0.0, |(near, far)| far - near);
        (-SIGMA * length).exp()
    };
    let [centres, values] = eye.picture(SIDE, through);
    let volume = json!({"builtin": "constant", "resolution": 32});
    let of = |technique: &str, samples: u64, own: &Value| view(technique, &volume, &eye.json(), SIDE, samples, own);
    let mut settings = Vec::new();
    for step in [16.0, 4.0, 1.0, 0.25] {
        let points = json!([{"value": 0, "color": [1, 1, 1], "opacity_per_unit": SIGMA}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": SIGMA}]);
        let own = json!({"transfer_function": {"points": points}, "step_voxels": step, "jitter": false, "opacity_threshold": 1});
        let request = of("emission_absorption", 1, &own);
        settings.push(
            Setting::stepped("emission_absorption", "step / voxel", step, None, request).reading(Reads::Transmittance),
        );
    }
    let xray = json!({"mode": "xray", "sigma_per_value": SIGMA, "zero_value": 0, "output": "value"});
    settings.push(Setting::stepped("projection, xray", "samples", 1.0, None, of("projection", 1, &xray)));
    for tracking in ["auto", "exact", "delta", "weighted", "march"] {
        for samples in scale.pick(vec![4, 16, 64], vec![4, 16, 64, 256]) {
            let own = json!({"medium": {"sigma_t_per_unit": SIGMA, "albedo": 0}, "tracking": tracking,
                "lights": [{"type": "sky", "radiance": 1}], "march_step_voxels": 4});
            let line = format!("volume_path, {tracking}");
            settings.push(Setting::random(&line, "samples", samples as f64, of("volume_path", samples, &own)));
        }
    }
    let words = format!("closed form: exp(−σ · length), σ = {SIGMA}");
    let truth = Truth { words, values, centres: Some(centres), size: Some([SIDE; 2]), known_to: 1e-5 };
    Ok(Ok(Trial { truth, settings }))
}
