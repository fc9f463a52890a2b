//! Light scattered once against the whole path, in slabs of rising optical depth, up to depths at which light scattered once is not enough.

use glam::dvec3;
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::Eye;
use crate::study::{Case, Scale, Setting, Trial, Truth, view};
use crate::technique::slab::reflected;

/// The thin slab's entry in the list.
pub const THIN: Case = Case {
    name: "scattering_thin",
    title: "Light scattered once or often in a slab of optical depth 0.1",
    when: "a thin haze (optical depth 0.1)",
    choose: "`single_scatter` if 15 % too dark will do; two scatterings are within 2 %",
    trial: |b, s| trial(b, s, 0.1),
};
/// The entry in the list of a slab of one mean free path.
pub const MEDIUM: Case = Case {
    name: "scattering_medium",
    title: "Light scattered once or often in a slab of optical depth 1",
    when: "a haze of optical depth 1",
    choose: "`volume_path`: light scattered once is half of it",
    trial: |b, s| trial(b, s, 1.0),
};
/// The thick slab's entry in the list.
pub const THICK: Case = Case {
    name: "scattering_thick",
    title: "Light scattered once or often in a slab of optical depth 10",
    when: "fog that one cannot see through",
    choose: "`volume_path` without a limit: even 8 scatterings lack a seventh",
    trial: |b, s| trial(b, s, 10.0),
};

const ALBEDO: f64 = 0.9;
/// A slab has no sides; those of this one are this many times its thickness away.
const WIDE: f64 = 2000.0;

/// The value of a request's `volume`: an even slab of thickness 1 around the origin, wide in x and y.
pub fn slab(bench: &Bench) -> Result<Value> {
    bench.floats([1, 1, 1], [WIDE, WIDE, 1.0], |_| 1.0)
}

/// A request that looks along the beam of a sun of irradiance 1 at right angles to a slab.
pub fn request(technique: &str, volume: &Value, [depth, albedo]: [f64; 2], samples: u64, more: &Value) -> Value {
    let eye = Eye { eye: dvec3(0.0, 0.0, 10.0), wide: 1.0 };
    let mut own = json!({"medium": {"sigma_t_per_unit": depth, "albedo": albedo, "phase": {"type": "isotropic"}},
        "lights": [{"type": "sun", "direction": [0, 0, 1], "irradiance": 1}]});
    for (key, value) in more.as_object().into_iter().flatten() {
        own[key] = value.clone();
    }
    view(technique, volume, &eye.json(), 32, samples, &own)
}

fn trial(bench: &Bench, scale: Scale, depth: f64) -> Result<std::result::Result<Trial, String>> {
    let volume = slab(bench)?;
    let most = scale.pick(64, 1024);
    let mut settings = Vec::new();
    for (line, technique, more, slope) in [
        ("single_scatter", "single_scatter", json!({}), None),
        ("volume_path, at most 2 scatterings", "volume_path", json!({"max_scatterings": 2}), None),
        ("volume_path, at most 8 scatterings", "volume_path", json!({"max_scatterings": 8}), None),
        ("volume_path", "volume_path", json!({}), Some(-0.5)),
    ] {
        for samples in [1, 4, 16, 64, 256, 1024].into_iter().filter(|n| *n <= most) {
            let request = request(technique, &volume, [depth, ALBEDO], samples, &more);
            let setting = Setting::random(line, "samples", samples as f64, request).reading(Reads::Mean);
            settings.push(Setting { expected_slope: slope, ..setting });
        }
    }
    let truth = Truth {
        words: format!(
            "the radiance back along the beam, by the integral equation of an even slab (Chandrasekhar 1950), at albedo {ALBEDO}"
        ),
        values: vec![reflected(depth, ALBEDO, None, 400).radiance],
        centres: None,
        size: None,
        known_to: 1e-4,
    };
    Ok(Ok(Trial { truth, settings }))
}
