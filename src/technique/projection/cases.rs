//! The cases that tests run of `projection`.

use serde_json::{Value, json};

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};
use crate::technique::draw::{Draw, set};

pub(super) fn cases() -> Cases {
    let own = [json!({"mode": "maximum", "exact": false}), json!({"mode": "mean"})];
    Cases {
        all: interpolated(&["nearest", "trilinear", "b_spline", "catmull_rom"], &own),
        tiny: vec![
            tiny(TECHNIQUE.name, "sphere", 12, 2, &json!({})),
            tiny(TECHNIQUE.name, "sphere", 8, 1, &json!({"mode": "xray"})),
        ],
        draw,
        truth: |own| {
            let is_spline = own.get("interpolation").is_some_and(|i| i == "b_spline" || i == "catmull_rom");
            set(
                own,
                &[("exact", json!(!is_spline)), ("step_voxels", json!(FINE)), ("empty_space_skipping", json!(false))],
            );
        },
    }
}

/// The step of a truth that is not exact, in voxels.
const FINE: f64 = 0.05;

/// Parameters at random.
fn draw(draw: &mut Draw<'_>) -> Value {
    let mut own = json!({"mode": draw.one_of(&["maximum", "minimum", "mean", "sum", "xray"])});
    draw.interpolation(&mut own);
    draw.window(&mut own);
    draw.maybe(&mut own, "exact", 0.4, |draw| json!(draw.chance(0.5)));
    draw.maybe(&mut own, "step_voxels", 0.5, |draw| json!(draw.logarithmic(0.25, 4.0)));
    draw.maybe(&mut own, "empty_space_skipping", 0.1, |_| json!(false));
    own
}
