//! Random parameters of `emission_absorption`, and those of its truth.

use serde_json::{Map, Value, json};

use crate::technique::draw::{Draw, set};

/// The step of a truth, in voxels.
const FINE: f64 = 0.05;

/// A transfer function: a preset, a thin shell, or a few control points.
fn transfer_function(draw: &mut Draw<'_>) -> Value {
    if draw.chance(0.3) {
        let preset = draw.one_of(&["ramp", "hls", "ct_bone", "mri_head", "bone_flesh", "blue_yellow"]);
        return json!({"preset": preset});
    }
    let opacity = draw.extinction(0.5, 60.0);
    if draw.chance(0.25) {
        let (middle, half) = (draw.value(0.2, 0.8), draw.difference(0.002, 0.05));
        let point =
            |value: f64, opacity: f64| json!({"value": value, "color": [1, 0.8, 0.5], "opacity_per_unit": opacity});
        return json!({"points": [point(middle - half, 0.0), point(middle, 3.0 * opacity), point(middle + half, 0.0)]});
    }
    let mut values: Vec<f64> = (0..draw.one_of(&[2, 3, 4])).map(|_| draw.value(0.0, 1.0)).collect();
    values.sort_by(f64::total_cmp);
    let points = values.into_iter().map(|value| {
        let part = if draw.chance(0.4) { 0.0 } else { draw.between(0.0, 1.0) };
        json!({"value": value, "color": draw.color(), "opacity_per_unit": opacity * part})
    });
    json!({"points": points.collect::<Vec<_>>()})
}

/// Parameters at random.
pub(super) fn draw(draw: &mut Draw<'_>) -> Value {
    let mut own = json!({});
    draw.maybe(&mut own, "transfer_function", 0.85, transfer_function);
    draw.interpolation(&mut own);
    draw.maybe(&mut own, "step_voxels", 0.5, |draw| json!(draw.logarithmic(0.25, 4.0)));
    draw.maybe(&mut own, "opacity_scale", 0.3, |draw| json!(draw.logarithmic(0.1, 5.0)));
    draw.maybe(&mut own, "opacity_threshold", 0.3, |draw| json!(draw.between(0.8, 1.0)));
    draw.maybe(&mut own, "shading", 0.3, |_| json!(true));
    draw.maybe(&mut own, "jitter", 0.25, |_| json!(false));
    draw.maybe(&mut own, "empty_space_skipping", 0.1, |_| json!(false));
    if draw.chance(0.25) {
        own["pre_integrated"] = json!(true);
    } else if draw.chance(0.1) {
        own["order"] = json!("back_to_front");
    } else {
        for style in ["gradient_opacity", "silhouette", "tone", "translucency", "curvature"] {
            draw.maybe(&mut own, style, 0.06, |_| json!({}));
        }
    }
    own
}

/// Short steps to the end of every ray, without integrals over steps.
pub(super) fn truth(own: &mut Map<String, Value>) {
    set(
        own,
        &[
            ("step_voxels", json!(FINE)),
            ("opacity_threshold", json!(1)),
            ("pre_integrated", json!(false)),
            ("jitter", json!(true)),
            ("order", json!("front_to_back")),
            ("empty_space_skipping", json!(false)),
        ],
    );
}
