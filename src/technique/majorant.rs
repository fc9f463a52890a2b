//! What the techniques share that follow light by delta tracking, or by the lecture's march.

use schemars::JsonSchema;
use serde::Deserialize;

/// The majorants of delta and weighted tracking.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Majorant {
    /// One for the whole volume (`global`), or one for each block of voxels (`local`).
    #[schemars(extend("enum" = ["local", "global"]))]
    pub grid: String,
    /// Times the greatest extinction. Below 1 delta tracking is biased, and says so.
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub scale: f64,
}

impl Default for Majorant {
    fn default() -> Self {
        Self { grid: "local".into(), scale: 1.0 }
    }
}

/// By what part the mean free path of a march is too long whose step has the optical depth h: h / (1 − exp(−h)) − 1.
pub fn march_bias(depth: f64) -> f64 {
    if depth > 0.0 { depth / -(-depth).exp_m1() - 1.0 } else { 0.0 }
}
