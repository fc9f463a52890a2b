//! The cases that tests run of `isosurface`.

use serde_json::json;

use super::TECHNIQUE;
use crate::technique::case::{Cases, interpolated, tiny};

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
    Cases { all, tiny, ..Cases::default() }
}
