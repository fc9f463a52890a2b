//! The parameters of NVIDIA's CUDA sample.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{one, yes};

/// The parameters of NVIDIA's CUDA sample `volumeRender`, under its names but for `linear`, which it calls linear filtering.
/// Values of bytes are taken as 0 to 255, others over the volume's range; its box from −1 to 1 is the volume's longest side.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CudaSample {
    /// Multiplies the table's alpha, which stands for a step of 0.01.
    #[serde(default = "default_density")]
    #[schemars(range(min = 0, max = 1))]
    pub(super) density: f64,
    /// Multiplies the picture.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 100))]
    pub(super) brightness: f64,
    /// Taken off a value before the table.
    #[serde(default)]
    #[schemars(range(min = -1, max = 1))]
    pub(super) transfer_offset: f64,
    /// Multiplies a value before the table.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 100))]
    pub(super) transfer_scale: f64,
    /// A ray ends at this opacity.
    #[serde(default = "default_sample_threshold")]
    #[schemars(range(min = 0.5, max = 1))]
    pub(super) opacity_threshold: f64,
    /// Whether values are interpolated between voxels.
    #[serde(default = "yes")]
    pub(super) linear: bool,
}

fn default_density() -> f64 {
    0.05
}
fn default_sample_threshold() -> f64 {
    0.95
}
