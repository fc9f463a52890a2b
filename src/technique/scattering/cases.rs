//! The cases that tests run of scattering views.

use serde_json::{Map, Value, json};

use crate::technique::case::{Case, Cases, interpolated};
use crate::technique::draw::{Draw, set};

/// All variants, and the given tiny requests.
pub(in crate::technique) fn cases(tiny: Vec<Value>) -> Cases {
    let trackers = ["march", "delta", "weighted"].map(|tracking| json!({"tracking": tracking}));
    let mut all = interpolated(&["nearest", "trilinear"], &trackers);
    all.push(Case { is_even_too: true, own: json!({"tracking": "exact", "interpolation": "nearest"}) });
    Cases { all, tiny, draw, truth }
}

fn lights(draw: &mut Draw<'_>) -> Value {
    let sun = json!({"type": "sun", "direction": draw.direction(), "irradiance": draw.between(1.0, 4.0)});
    let sky = json!({"type": "sky", "radiance": draw.between(0.1, 0.6)});
    let position: [f64; 3] = std::array::from_fn(|_| draw.length(0.5, 0.9));
    let radius = draw.length(0.05, 0.15);
    let lamp = json!({"type": "sphere", "position": position, "radius": radius, "radiance": draw.between(2.0, 20.0)});
    let point = json!({"type": "point", "position": position, "intensity": draw.between(0.5, 3.0)});
    draw.one_of(&[json!([sun, sky]), json!([sky]), json!([lamp, sky]), json!([sun]), json!([point, sky])])
}

/// Parameters at random.
fn draw(draw: &mut Draw<'_>) -> Value {
    let albedo = draw.one_of(&[0.0, 0.3, 0.6, 0.9, 0.98]);
    let phase = json!({"type": "henyey_greenstein", "g": draw.between(0.0, 0.9)});
    let mut own = json!({"medium": {"sigma_t_per_unit": draw.extinction(0.1, 30.0), "albedo": albedo, "phase": phase},
        "lights": lights(draw)});
    draw.maybe(&mut own, "interpolation", 0.3, |draw| json!(draw.one_of(&["nearest", "trilinear"])));
    draw.maybe(&mut own, "tracking", 0.4, |draw| json!(draw.one_of(&["delta", "weighted", "exact", "march"])));
    draw.maybe(&mut own, "adaptive", 0.15, |_| json!(true));
    draw.maybe(&mut own, "equiangular", 0.15, |_| json!(false));
    own
}

/// Weights have less noise than collisions by chance.
fn truth(own: &mut Map<String, Value>) {
    // Of the nearest voxel is the default of exact tracking alone.
    if own.get("tracking").is_some_and(|tracking| tracking == "exact") {
        set(own, &[("interpolation", json!("nearest"))]);
    }
    set(own, &[("tracking", json!("weighted")), ("adaptive", json!(false)), ("clamp_luminance", Value::Null)]);
}
