//! # `fbp`
//!
//! Filtered backprojection: f(x, y) = ∫₀^π q(θ, x cosθ + y sinθ) dθ, where q is the view filtered by the ramp |ω| (Kak & Slaney, "Principles of Computerized
//! Tomographic Imaging", 1988, 3.3). A view's weight is the angle that it stands for, so views may lie anywhere, from both sides, and at any distances.
//! Values have the unit of the phantom's, whatever the sizes of bins and voxels: attenuation per mm. Between bins q is interpolated linearly, so a
//! smooth object has an error of second order in the bin's size; edges ring (Gibbs), which a window damps at the price of sharpness.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `sinogram` | | the `id` of an upload, or a `projection` `of` a `phantom` by a `geometry` | Shepp and Logan's head of 100 mm; 360 parallel views of 256 bins of 1 mm |
//! | `grid` | voxels, mm | `dims`, `spacing_mm`, `center_mm` | the bins' |
//! | `filter` | | `ram_lak`, `shepp_logan`, `cosine`, `hamming`, `hann` | `ram_lak` |
//! | `cutoff` | of the highest frequency | above 0, at most 1 | 1 |
//!
//! Example: see [`example`], which a test runs.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::analytic::{self, GridRequest, Method, Reconstruction, SinogramRequest};
use super::{Field, Kind, Technique};
use crate::asset::Assets;
use crate::device::program::Variant;
use crate::error::Result;
use crate::request;
use crate::tomography::Filter;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "fbp",
    summary: "Filtered backprojection: a volume from its projections, by the ramp filter",
    schema: request::schema_of::<Parameters>,
    example,
    source: || analytic::source(TECHNIQUE.name, || vec![Variant::new(TECHNIQUE.name, None, &[])]),
    shares: &[],
    cases: || analytic::cases(TECHNIQUE.name),
    kind: Kind::Field { parse, work: None },
};

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// What is reconstructed.
    #[serde(default)]
    sinogram: SinogramRequest,
    /// The voxels.
    #[serde(default)]
    grid: GridRequest,
    /// The window of the ramp filter.
    #[serde(default)]
    filter: Filter,
    /// The window's end, as a part of the highest frequency.
    #[serde(default = "default_cutoff")]
    #[schemars(range(min = 0.01, max = 1))]
    cutoff: f64,
}

fn default_cutoff() -> f64 {
    1.0
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "slice",
        "volume": {"fbp": {"sinogram": {"projection": {
            "of": {"phantom": {"name": "shepp_logan", "radius_mm": 100}},
            "geometry": {"type": "parallel", "angles_deg": {"to": 180, "count": 180}, "detector": {"count": [256, 1], "spacing_mm": [1, 1]}}}},
            "filter": "ram_lak"}},
        "slice": {"window": {"low": 0, "high": 0.4}},
        "image": {"width": 256, "height": 256},
        "budget": {"samples": 4}
    })
}

fn parse(parameters: &Value, at: &str, assets: &Assets) -> Result<Arc<dyn Field>> {
    let Parameters { sinogram, grid, filter, cutoff } = request::read(parameters, at)?;
    let method = Method::Filtered(filter, cutoff);
    Ok(Arc::new(Arc::new(Reconstruction::new(TECHNIQUE.name, &sinogram, &grid, method, assets, at)?)))
}
