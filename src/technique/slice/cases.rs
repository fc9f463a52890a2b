//! The cases that tests run of `slice`.

use serde_json::{Value, json};

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};
use crate::technique::draw::Draw;

pub(super) fn cases() -> Cases {
    Cases {
        all: interpolated(&["nearest", "trilinear", "b_spline", "catmull_rom"], &[json!({})]),
        tiny: vec![tiny(TECHNIQUE.name, "sphere", 8, 2, &json!({"thickness": 0.3, "mode": "maximum"}))],
        draw,
        ..Cases::default()
    }
}

/// Parameters at random.
fn draw(draw: &mut Draw<'_>) -> Value {
    let point: [f64; 3] = std::array::from_fn(|_| draw.length(-0.2, 0.2));
    let mut own = json!({"plane": {"point": point, "normal": draw.direction()}});
    draw.interpolation(&mut own);
    draw.window(&mut own);
    draw.maybe(&mut own, "thickness", 0.4, |draw| json!(draw.length(0.0, 0.3)));
    draw.maybe(&mut own, "mode", 0.4, |draw| json!(draw.one_of(&["maximum", "minimum", "mean"])));
    own
}
