//! The parameters of scattering views in a request.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::scene::interpolation::Interpolation;
use crate::scene::lights::LightSource;
use crate::scene::medium::MediumRequest;
use crate::technique::majorant::Majorant;

/// How free paths and transmittances are found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Tracking {
    /// The cheapest that is unbiased for the scene.
    #[default]
    Auto,
    /// From voxel to voxel in closed form, where voxels are the nearest ones.
    Exact,
    /// Steps of one length: biased, for comparison.
    March,
    /// Woodcock's, with majorants; transmittances by ratio tracking.
    Delta,
    /// The same with weights, for majorants that may be too small.
    Weighted,
}

/// The parameters of both views; each leaves out of its schema what is not its own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// What the volume is made of.
    #[serde(default)]
    pub medium: MediumRequest,
    /// Up to eight lights. Default: a sun in a blue sky.
    pub lights: Option<Vec<LightSource>>,
    /// How densities lie between voxels: `trilinear` (default) or `nearest`.
    #[schemars(extend("enum" = ["trilinear", "nearest", null]))]
    pub interpolation: Option<Interpolation>,
    /// How free paths and transmittances are found.
    #[serde(default)]
    pub tracking: Tracking,
    /// Of delta and weighted tracking.
    #[serde(default)]
    pub majorant: Majorant,
    /// Step of the march, in sides of the smallest voxel.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 16))]
    pub march_step_voxels: f64,
    /// Samples of more luminance than this are scaled down to it, and what that takes away is reported. Default: none are.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub clamp_luminance: Option<f64>,
    /// Sample those parts of the picture more often that have more noise, from the 16th sample on: less error for the same time, and a
    /// small bias.
    #[serde(default)]
    pub adaptive: bool,
    /// Paths end at the collision after so many scatterings; none are cut off by default.
    #[schemars(range(min = 0, max = 1_000_000))]
    pub max_scatterings: Option<u32>,
    /// Aim at a light at every scattering. Without, only lights that have a size are found.
    #[serde(default = "yes")]
    pub next_event: bool,
    /// Light that is fainter than this when it leaves a scattering meets the roulette.
    #[serde(default = "default_roulette")]
    #[schemars(range(min = 0, max = 1))]
    pub roulette_threshold: f64,
    /// Also choose places on a ray by the angle under which they see a point, sphere or quad.
    #[serde(default = "yes")]
    pub equiangular: bool,
}

fn one() -> f64 {
    1.0
}
fn yes() -> bool {
    true
}
fn default_roulette() -> f64 {
    0.25
}

impl Parameters {
    /// Checks the rules that the schema cannot express.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn check(&self, at: &str) -> Result<()> {
        self.medium.check(&format!("{at}/medium"))?;
        let nearest = self.interpolation() == Interpolation::Nearest;
        if self.tracking == Tracking::Exact && !nearest && self.interpolation.is_some() {
            let detail = "between voxels that are interpolated there is no closed form";
            return Err(Error::invalid(format!("{at}/tracking"), detail, "another, or interpolation nearest"));
        }
        Ok(())
    }

    /// The interpolation of densities. Exact tracking takes the nearest voxel.
    pub fn interpolation(&self) -> Interpolation {
        let otherwise =
            if self.tracking == Tracking::Exact { Interpolation::Nearest } else { Interpolation::Trilinear };
        self.interpolation.unwrap_or(otherwise)
    }
}
