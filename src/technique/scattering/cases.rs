//! The cases that tests run of scattering views.

use serde_json::{Value, json};

use crate::technique::case::{Case, Cases, interpolated};

/// All variants, and the given tiny requests.
pub(in crate::technique) fn cases(tiny: Vec<Value>) -> Cases {
    let trackers = ["march", "delta", "weighted"].map(|tracking| json!({"tracking": tracking}));
    let mut all = interpolated(&["nearest", "trilinear"], &trackers);
    all.push(Case { is_even_too: true, own: json!({"tracking": "exact", "interpolation": "nearest"}) });
    Cases { all, tiny, ..Cases::default() }
}
