//! The wire type of a transfer function.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A transfer function in a request: a preset, or control points.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferRequest {
    /// `ramp`, `hls` (hue by value, opacity by power), `ct_bone`, `mri_head`, `bone_flesh` (ivory bone in translucent flesh),
    /// `blue_yellow` (blue and transparent, then yellow and opaque), `signed` (blue below 0, red above) or `labels` (a colour a whole number,
    /// 0 is empty). Default: what suits the volume.
    #[schemars(extend("enum" = ["ramp", "hls", "ct_bone", "mri_head", "bone_flesh", "blue_yellow", "signed", "labels"]))]
    pub preset: Option<String>,
    /// `hls`: turns the hue, in turns.
    #[schemars(range(min = 0, max = 1))]
    pub rotation: Option<f64>,
    /// `hls`: opacity = pow(v / vmax, exponent).
    #[schemars(range(min = 0.01, max = 20))]
    pub exponent: Option<f64>,
    /// The values that a preset spans. Default: the volume's window, without outliers and without what stands for no data; for a computed field, 0
    /// to what 99.8 % of its voxels stay below.
    pub value_range: Option<[f64; 2]>,
    /// Control points in rising order of value, linear between them, constant outside. Two points at one value are a step. Instead of a preset.
    #[schemars(length(min = 1, max = 256))]
    pub points: Option<Vec<ControlPoint>>,
    /// The colours of a label volume, whose voxels are whole numbers. Instead of a preset.
    #[schemars(length(min = 1, max = 4096))]
    pub labels: Option<Vec<Label>>,
}

impl TransferRequest {
    /// True if the request asks for a label volume's colours.
    pub fn is_labels(&self) -> bool {
        self.labels.is_some() || self.preset.as_deref() == Some("labels")
    }
}

/// The look of one label.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Label {
    /// The voxels' value.
    #[schemars(range(min = 0, max = 4_294_967_295_u32))]
    pub label: u32,
    /// Linear red, green, blue. Default: one of its own.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub color: Option<[f64; 3]>,
    /// Extinction per world unit.
    #[schemars(range(min = 0, max = 1e18))]
    pub opacity_per_unit: f64,
}

/// One control point.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlPoint {
    /// The volume's value here.
    pub value: f64,
    /// Linear red, green, blue, each from 0 to 1.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub color: [f64; 3],
    /// Extinction per world unit (per mm for a scan).
    #[schemars(range(min = 0, max = 1e18))]
    pub opacity_per_unit: f64,
}
