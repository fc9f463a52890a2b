//! The cases that tests run of `photon_transport`.

use serde_json::{Value, json};

use super::TECHNIQUE;
use crate::technique::case::{Case, Cases};
use crate::technique::draw::Draw;

pub(super) fn cases() -> Cases {
    let light = json!({"mu_a_per_mm": 1, "mu_s_per_mm": 9});
    let gammas = json!({"phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}});
    let mut all: Vec<Case> = Vec::new();
    for (medium, trackers) in [(light, &["exact", "march", "delta", "weighted"][..]), (gammas, &["exact"])] {
        for tracking in trackers {
            all.extend(places(&medium).map(|mut own| {
                (own["tracking"], own["photons"]) = (json!(tracking), json!(200));
                own.into()
            }));
        }
    }
    Cases { all, tiny: tiny(), draw, ..Cases::default() }
}

/// The chamber, a cube of one medium, or a cloud: a field at random. The chamber and the cube have a side of 1 mm.
fn draw(draw: &mut Draw<'_>) -> Value {
    let mut own = json!({"photons": draw.logarithmic(2e4, 2e5).round(), "seed": draw.between(0.0, 1e6).round()});
    let (absorption, scattering) = (draw.extinction(0.1, 3.0), draw.extinction(2.0, 40.0));
    let phase = json!({"type": "henyey_greenstein", "g": draw.between(0.0, 0.9)});
    match draw.one_of(&["chamber", "cube", "cloud"]) {
        "cube" => {
            own["size_mm"] = json!([1, 1, 1]);
            own["medium"] = json!({"mu_a_per_mm": absorption, "mu_s_per_mm": scattering, "phase": phase});
        }
        "cloud" => {
            own["density"] = json!({"builtin": draw.one_of(&["smoke", "gaussian"]), "resolution": 32});
            // A built-in has a side of 2.
            own["medium"] = json!({"mu_a_per_mm": 0.5 * absorption, "mu_s_per_mm": 0.5 * scattering, "phase": phase});
        }
        _ => own["albedo"] = json!(draw.between(0.3, 0.95)),
    }
    if own.get("density").is_none() {
        own["grid"] = json!([draw.one_of(&[16, 24, 32])].repeat(3));
    }
    if own.get("medium").is_some() {
        own["source"] = json!({"type": draw.one_of(&["pencil", "isotropic", "planar"])});
    }
    draw.maybe(&mut own, "tally", 0.3, |_| json!("absorbed"));
    own
}

/// Parameters with the medium in each place that may have one.
fn places(medium: &Value) -> [Value; 4] {
    let mut layer = medium.clone();
    layer["thickness_mm"] = json!(0.5);
    [
        json!({"medium": medium, "size_mm": [1, 1, 1], "grid": [8, 8, 8]}),
        json!({"layers": [layer, layer], "grid": [4, 4, 4]}),
        json!({"labels": {"test": "labels"}, "media": [medium, medium, medium]}),
        json!({"density": {"test": "labels"}, "medium": medium}),
    ]
}

/// The chamber; layers that refract, with a table, a histogram and the gather; delta tracking of a density by track length; gamma photons.
fn tiny() -> Vec<Value> {
    let table = json!({"type": "tabulated", "cosines": [-1, 0, 1], "densities": [1, 0, 2]});
    let layers = json!([{"thickness_mm": 0.5, "index": 1.2, "phase": table},
        {"thickness_mm": "infinite", "mu_a_per_mm": 1, "index": 1.5, "phase": {"type": "rayleigh"}}]);
    let own = [
        json!({"photons": 70, "grid": [6, 5, 4]}),
        json!({"photons": 40, "grid": [3, 3, 4], "size_mm": [2, 2, 2], "layers": layers, "boundary": {"fresnel": true},
            "exit_histogram": {"radius_edges_mm": [0, 1, 5], "angle_edges_deg": [0, 45, 90]}, "tally": "radiance_gather"}),
        json!({"photons": 30, "density": {"builtin": "gaussian", "resolution": 9}, "tracking": "delta", "estimator": "track_length",
            "medium": {"mu_a_per_mm": 1, "mu_s_per_mm": 2}, "boundary": {"x": "cyclic", "y": "mirror"}}),
        json!({"photons": 30, "grid": [3, 2, 4], "size_mm": [50, 50, 50], "source": {"type": "disk"},
            "medium": {"phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}}}),
    ];
    let request = |own| {
        json!({"technique": "slice", "volume": {TECHNIQUE.name: own}, "image": {"width": 5, "height": 4},
            "budget": {"samples": 1}})
    };
    own.map(request).to_vec()
}
