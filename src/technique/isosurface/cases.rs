//! The cases that tests run of `isosurface`.

use serde_json::{Map, Value, json};

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};
use crate::technique::draw::{Draw, set};

pub(super) fn cases() -> Cases {
    let two = json!([{"isovalue": 60, "opacity": 0.5}, {"isovalue": 120}]);
    let own = [json!({"isovalue": 90}), json!({"surfaces": two})];
    let mut all = interpolated(&["trilinear", "b_spline", "catmull_rom"], &own);
    all.push(json!({"isovalue": 90, "sampling": "nearest"}).into());
    let layers = json!({"surfaces": [{"isovalue": 0.3, "opacity": 0.5}, {"isovalue": 0.6}], "normals": "analytic"});
    let tiny = vec![
        tiny(TECHNIQUE.name, "sphere", 12, 2, &json!({"ambient_occlusion": {"rays": 2}})),
        tiny(TECHNIQUE.name, "gaussian", 8, 1, &layers),
    ];
    let truth = |own: &mut Map<String, Value>| {
        set(own, &[("step_voxels", json!(FINE)), ("empty_space_skipping", json!(false))]);
    };
    Cases { all, tiny, draw, truth }
}

/// The step of a truth, in voxels.
const FINE: f64 = 0.05;

/// Parameters at random.
fn draw(draw: &mut Draw<'_>) -> Value {
    let mut own = json!({"isovalue": draw.value(0.1, 0.9)});
    if draw.chance(0.25) {
        let surface = |draw: &mut Draw<'_>, least: f64, most: f64| json!({"isovalue": draw.value(least, most), "color": draw.color(), "opacity": draw.between(0.2, 1.0)});
        own = json!({"surfaces": [surface(draw, 0.1, 0.45), surface(draw, 0.5, 0.9)]});
    }
    draw.interpolation(&mut own);
    draw.maybe(&mut own, "sampling", 0.2, |_| json!("nearest"));
    draw.maybe(&mut own, "step_voxels", 0.5, |draw| json!(draw.logarithmic(0.25, 3.0)));
    draw.maybe(&mut own, "normals", 0.25, |_| json!("analytic"));
    draw.maybe(&mut own, "ambient_occlusion", 0.15, |draw| json!({"rays": draw.one_of(&[2, 4, 8])}));
    draw.maybe(&mut own, "output", 0.05, |_| json!("depth"));
    own
}
