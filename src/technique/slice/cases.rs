//! The cases that tests run of `slice`.

use serde_json::json;

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};

pub(super) fn cases() -> Cases {
    Cases {
        all: interpolated(&["nearest", "trilinear", "b_spline", "catmull_rom"], &[json!({})]),
        tiny: vec![tiny(TECHNIQUE.name, "sphere", 8, 2, &json!({"thickness": 0.3, "mode": "maximum"}))],
        ..Cases::default()
    }
}
