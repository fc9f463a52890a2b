//! The reflectance of a half-space of albedo 0.9 (P8), by photons from the light and by paths from the eye.

use serde_json::json;

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::{Case, Scale, Setting, Trial, Truth, simulation, view};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "half_space",
    title: "What a half-space reflects, by photons and by paths",
    when: "something so thick that nothing comes out behind",
    choose: "`volume_path` for a few percent, `photon_transport` for less",
    trial,
};

const ALBEDO: f64 = 0.9;
const REFLECTED: f64 = 0.414_947;
/// For paths, a box of 800 mean free paths a side stands for a half-space.
const DENSE: f64 = 400.0;

fn trial(_: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let mut settings = Vec::new();
    let most = scale.pick(1e6, 1e7);
    for photons in [1e3, 1e4, 1e5, 1e6, 1e7].into_iter().filter(|n| *n <= most) {
        let layer = json!({"thickness_mm": "infinite", "mu_a_per_mm": 1.0 - ALBEDO, "mu_s_per_mm": ALBEDO, "index": 1,
            "phase": {"type": "isotropic"}});
        let request = simulation(&json!({"photons": photons as u64, "grid": [1, 1, 1], "layers": [layer]}));
        let reads = Reads::Ledger(&["exit_minus_z"]);
        settings.push(Setting::random("photon_transport", "photons", photons, request).reading(reads));
    }
    // By reciprocity, the radiance at right angles under a sky of radiance 1 is the reflectance for light at right angles.
    let camera = json!({"eye": [0, 0, 6], "up": [0, 1, 0], "fov_y_deg": 0.2, "projection": "orthographic"});
    let volume = json!({"builtin": "constant", "resolution": 8});
    for (line, scatterings) in [("volume_path", None), ("volume_path, at most 4 scatterings", Some(4))] {
        for samples in scale.pick(vec![1, 4, 16, 64], vec![1, 4, 16, 64, 256, 1024]) {
            let own = json!({"medium": {"sigma_t_per_unit": DENSE, "albedo": ALBEDO, "phase": {"type": "isotropic"}},
                "lights": [{"type": "sky", "radiance": 1, "visible": false}], "max_scatterings": scatterings});
            let request = view("volume_path", &volume, &camera, 32, samples, &own);
            let mut setting = Setting::random(line, "samples", samples as f64, request).reading(Reads::Mean);
            setting.expected_slope = scatterings.is_none().then_some(-0.5);
            settings.push(setting);
        }
    }
    let truth = Truth {
        words: format!("Chandrasekhar: 1 − √(1−ω) H(1) = {REFLECTED} at ω = {ALBEDO}"),
        values: vec![REFLECTED],
        centres: None,
        size: None,
        known_to: 1e-6,
    };
    Ok(Ok(Trial { truth, settings }))
}
