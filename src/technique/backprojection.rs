//! # `backprojection`
//!
//! Plain backprojection: b(x, y) = ∫₀^π p(θ, x cosθ + y sinθ) dθ. It smears each view over the rays that it was measured along. A point becomes 1/r: b is the
//! object blurred by that, in value · mm. `fbp` is the same with filtered views. Deblurred afterwards, values have the unit of the phantom's, and change
//! slowly by what the tails of 1/r beyond the grid are missing.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `sinogram`, `grid` | | as those of `fbp` | |
//! | `deconvolve` | | times \|ω\| afterwards, on twice the grid | false |
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

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "backprojection",
    summary: "Plain backprojection: projections smeared back along their rays, which blurs a point to 1/r",
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
    /// Deblur it afterwards: times |ω| in the Fourier transform of its planes.
    #[serde(default)]
    deconvolve: bool,
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "slice",
        "volume": {"backprojection": {"sinogram": {"projection": {
            "of": {"phantom": {"name": "shepp_logan", "radius_mm": 100}},
            "geometry": {"type": "parallel", "angles_deg": {"to": 180, "count": 180}, "detector": {"count": [256, 1], "spacing_mm": [1, 1]}}}}}},
        "image": {"width": 256, "height": 256},
        "budget": {"samples": 4}
    })
}

fn parse(parameters: &Value, at: &str, assets: &Assets) -> Result<Arc<dyn Field>> {
    let Parameters { sinogram, grid, deconvolve } = request::read(parameters, at)?;
    let method = if deconvolve { Method::Deconvolved } else { Method::Plain };
    Ok(Arc::new(Arc::new(Reconstruction::new(TECHNIQUE.name, &sinogram, &grid, method, assets, at)?)))
}
