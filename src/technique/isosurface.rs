//! # `isosurface`
//!
//! The surfaces on which the volume has given values, at their first crossings with the rays.
//!
//! The value is sampled at the ends of a ray's steps. If the isovalue lies between the two, the crossing is refined by regula falsi in the Illinois
//! form (Dowell & Jarratt, BIT 11, 1971) to a ten-thousandth of a voxel. No surface is missed around anything that is thicker than a step.
//! Macro-cells whose values are all on one side cost nothing. If a GPU reads volumes as images, its sampler's weights have 8 fractional bits, and so
//! has the crossing (`/v1/device` tells).
//! The surface's normal is the gradient there, lit from both sides by Lambert's law and Blinn-Phong.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `isovalue` | value | | 300 in Hounsfield units, else Otsu's threshold of the histogram |
//! | `color`, `opacity` | linear; 1 | 0–1 | ivory, 1 |
//! | `surfaces` | | 1 to 8 of `isovalue`, `color`, `opacity`, instead | |
//! | `interpolation` | | `trilinear`, `b_spline`, `catmull_rom` | `trilinear` |
//! | `sampling` | | `refined`; `nearest`: the first sample whose voxel is at or above the isovalue, as it is | `refined` |
//! | `step_voxels` | smallest voxel side | 0.05–16 | 1 |
//! | `normals` | | `central` differences, or `analytic`: the interpolant's own gradient | `central` |
//! | `light` | | direction and Blinn-Phong weights | a headlight |
//! | `ambient_occlusion` | | rays and radius; darkens the light's `ambient` | none |
//! | `output` | | `color`, or `depth`: the distance from the eye, world units, in the EXR | `color` |
//! | `empty_space_skipping` | | | true |
//!
//! Example: see [`example`], which a test runs.

mod cases;
pub mod plan;
pub mod surfaces;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Kind, Technique, View};
use crate::asset::Assets;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::interpolation::Interpolation;
use crate::scene::light::LightRequest;
use surfaces::{MOST_SURFACES, Surface};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "isosurface",
    summary: "Surfaces of equal value, met to a ten-thousandth of a voxel and lit by their gradient",
    schema: request::schema_of::<Parameters>,
    example,
    source: plan::source,
    shares: &[],
    cases: cases::cases,
    kind: Kind::View { parse, complete: "isosurface", calibration: Some(super::smoke) },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Isosurface {
        /// −1 if values fall as raw values rise, else 1.
        pub sign: f32,
        /// The number of surfaces.
        pub surfaces: i32,
        /// Raw values, ascending.
        pub isovalue: [f32; MOST_SURFACES],
        /// Linear colours.
        pub color: [f32; 3 * MOST_SURFACES],
        /// Opacities.
        pub opacity: [f32; MOST_SURFACES],
        /// A ray ends if its transmittance is less than this.
        pub transmittance_floor: f32,
        /// The width at which the bracket of a crossing is narrow enough, world units.
        pub tolerance: f32,
        /// 1 if the normal is the interpolant's own gradient.
        pub analytic: i32,
        /// 1 if the distance from the eye goes to the film instead of a colour.
        pub depth: i32,
        /// The number of ambient occlusion rays; 0 for none.
        pub occlusion_rays: i32,
        /// Their length, world units.
        pub occlusion_radius: f32,
        /// The height above the surface at which they start, world units.
        pub occlusion_start: f32,
    }
}

/// How a surface is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Between two samples on different sides, to a ten-thousandth of a voxel.
    #[default]
    Refined,
    /// The first sample of fixed steps whose nearest voxel is at or above the isovalue: the plain form, for comparison.
    Nearest,
}

/// Where the normal comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// Central differences of the interpolated value, one voxel to each side: smooth.
    #[default]
    Central,
    /// The gradient of the interpolant itself; of `trilinear` it jumps from voxel to voxel.
    Analytic,
}

/// What goes on the film.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// The lit surfaces.
    #[default]
    Color,
    /// The distance from the eye to the first surface, world units.
    Depth,
}

/// The sky over a point of a surface that other surfaces hide takes away from the light's `ambient` (Zhukov, Iones, Kronin 1998).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmbientOcclusion {
    /// Surfaces further away than this hide nothing, world units. Default: a tenth of the volume's side.
    #[schemars(range(min = 1e-9, max = 1e9))]
    radius: Option<f64>,
    /// Rays of each sample of a pixel.
    #[serde(default = "default_rays")]
    #[schemars(range(min = 1, max = 64))]
    rays: u32,
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The value of the surface. Default: what suits the volume.
    #[schemars(range(min = -1e30, max = 1e30), extend("x-slider" = "values"))]
    isovalue: Option<f64>,
    /// Linear red, green, blue. Default: ivory.
    #[schemars(inner(range(min = 0, max = 1)))]
    color: Option<[f64; 3]>,
    /// What of the light behind the surface does not get through. Default: 1.
    #[schemars(range(min = 0.001, max = 1))]
    opacity: Option<f64>,
    /// Instead of `isovalue`, `color` and `opacity`: several surfaces.
    #[schemars(length(min = 1, max = 8))]
    surfaces: Option<Vec<Surface>>,
    /// How values lie between voxels. Default: `trilinear`.
    interpolation: Option<Interpolation>,
    /// How a surface is found.
    #[serde(default)]
    sampling: Sampling,
    /// Step along the ray, in sides of the smallest voxel.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 16))]
    step_voxels: f64,
    /// Where the normal comes from.
    #[serde(default)]
    normals: Normals,
    /// How the surfaces are lit.
    light: Option<LightRequest>,
    /// Darkens hollows; the light has more `ambient` then by default.
    ambient_occlusion: Option<AmbientOcclusion>,
    /// `depth` writes the distance from the eye to the film.
    #[serde(default)]
    output: Output,
    /// Leap over macro-cells without a crossing. The picture is the same without.
    #[serde(default = "yes")]
    empty_space_skipping: bool,
}

fn default_rays() -> u32 {
    4
}
fn one() -> f64 {
    1.0
}
fn yes() -> bool {
    true
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "isosurface",
        "volume": {"builtin": "marschner_lobb", "resolution": 64},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 16},
        "isosurface": {"isovalue": 0.5, "color": [0.8, 0.5, 0.3], "step_voxels": 0.5, "ambient_occlusion": {"radius": 0.2}}
    })
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    if let Some(light) = &parameters.light {
        light.check(&format!("{at}/light"))?;
    }
    if let Some(surfaces) = &parameters.surfaces {
        for (given, name) in [
            (parameters.isovalue.is_some(), "isovalue"),
            (parameters.color.is_some(), "color"),
            (parameters.opacity.is_some(), "opacity"),
        ] {
            if given {
                return Err(Error::invalid(format!("{at}/{name}"), "surfaces are given too", "not beside surfaces"));
            }
        }
        surfaces::check(surfaces, &format!("{at}/surfaces"))?;
    }
    let several = parameters
        .surfaces
        .as_ref()
        .map_or(parameters.opacity.unwrap_or(1.0) < 1.0, |s| s.len() > 1 || s[0].opacity < 1.0);
    if parameters.sampling == Sampling::Nearest && several {
        let detail = "the plain form has one opaque surface";
        return Err(Error::invalid(format!("{at}/sampling"), detail, "refined, or a single opaque surface"));
    }
    if parameters.interpolation == Some(Interpolation::Nearest) && parameters.sampling == Sampling::Refined {
        let detail = "between the nearest voxels there is no crossing to refine";
        return Err(Error::invalid(format!("{at}/interpolation"), detail, "another, or sampling nearest"));
    }
    if parameters.interpolation.is_some_and(|i| i != Interpolation::Nearest) && parameters.sampling == Sampling::Nearest
    {
        let detail = "the plain form takes the nearest voxel";
        return Err(Error::invalid(format!("{at}/interpolation"), detail, "nearest, or sampling refined"));
    }
    Ok(Arc::new(parameters))
}
