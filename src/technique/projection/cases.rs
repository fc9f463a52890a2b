//! The cases that tests run of `projection`.

use serde_json::json;

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};

pub(super) fn cases() -> Cases {
    let own = [json!({"mode": "maximum", "exact": false}), json!({"mode": "mean"})];
    Cases {
        all: interpolated(&["nearest", "trilinear", "b_spline", "catmull_rom"], &own),
        tiny: vec![
            tiny(TECHNIQUE.name, "sphere", 12, 2, &json!({})),
            tiny(TECHNIQUE.name, "sphere", 8, 1, &json!({"mode": "xray"})),
        ],
        ..Cases::default()
    }
}
