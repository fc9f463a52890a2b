//! The cases that tests run of `emission_absorption`.

use serde_json::json;

use super::TECHNIQUE;
use super::draw::{draw, truth};
use crate::technique::case::{Cases, interpolated, tiny};

pub(super) fn cases() -> Cases {
    let plain = [json!({}), json!({"shading": true}), json!({"silhouette": {}})];
    let mut all = interpolated(&["nearest", "trilinear", "b_spline", "catmull_rom"], &plain);
    for shading in [false, true] {
        all.push(json!({"shading": shading, "order": "back_to_front"}).into());
        all.push(json!({"shading": shading, "pre_integrated": true}).into());
    }
    let tiny = vec![tiny(TECHNIQUE.name, "sphere", 12, 2, &json!({"shading": true}))];
    Cases { all, tiny, draw, truth }
}
