//! Trackers and majorants, for the techniques that follow light through media.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::device_enum;

device_enum! {
    /// The ways to find free paths (`kernels/shared/dda.h`).
    pub enum Tracking: "TRACKING" {
        /// In closed form from one change of the extinction to the next.
        Exact,
        /// In steps of one length.
        March,
        /// Woodcock's method, with majorants.
        Delta,
        /// The same with weights, for majorants that may be too small.
        Weighted,
    }
}

impl Tracking {
    /// Its name in requests and replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::March => "march",
            Self::Delta => "delta",
            Self::Weighted => "weighted",
        }
    }
}

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

/// The relative excess of the mean free path of a march whose step has the optical depth h: h / (1 − exp(−h)) − 1.
pub fn march_bias(depth: f64) -> f64 {
    if depth > 0.0 { depth / -(-depth).exp_m1() - 1.0 } else { 0.0 }
}
