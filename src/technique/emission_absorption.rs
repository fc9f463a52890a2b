//! # `emission_absorption`
//!
//! Alpha-blended ray casting through a transfer function. Each ray sums the volume's emission towards the eye, attenuated by the absorption on its
//! way:
//!
//! I = Σ_k c_k α_k Π_{j<k} (1 − α_j),  α_k = 1 − exp(−σ_k Δs)   (Max, IEEE TVCG 1(2), 1995)
//!
//! σ is opacity per world unit, so that the picture depends on the step Δs only by the error that is reported. Each pass starts its rays at another
//! random place within the first step, so that banding becomes noise and averages out. Each pass goes through another place within the pixels, so
//! that edges are smooth.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `transfer_function` | | a preset, points or labels | what suits the volume |
//! | `regions` | | value × gradient magnitude, instead | |
//! | `cuda_sample` | | the CUDA sample `volumeRender`'s parameters, instead | |
//! | `opacity_scale` | | 0–10⁴ | 1 |
//! | `step_voxels` | smallest voxel side | 0.05–16 | 1 |
//! | `jitter` | | samples at random places within their steps | true |
//! | `opacity_threshold` | opacity | 0.5–1 | 0.999 |
//! | `interpolation` | | `nearest`, `trilinear`, `b_spline`, `catmull_rom` | `trilinear`; `nearest` for labels |
//! | `pre_integrated` | | second order in the step | false |
//! | `brightness` | | 0–100 | 1 |
//! | `shading` | | | false |
//! | `light` | | direction and Blinn-Phong weights | a headlight |
//! | `gradient_opacity`, `silhouette` | | opacity by gradient magnitude and angle | |
//! | `curvature`, `tone`, `translucency` | | colour and light beyond Blinn-Phong | |
//! | `order` | | `front_to_back`, `back_to_front` | `front_to_back` |
//! | `empty_space_skipping` | | | true |
//!
//! Example: see [`example`], which a test runs.

mod cases;
mod cuda_sample;
mod draw;
mod labels;
pub mod pieces;
pub mod plan;
pub mod regions;
pub mod style;
mod variants;

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
use crate::scene::transfer::TransferRequest;
pub use cuda_sample::CudaSample;
use regions::Region;
use style::{CurvatureStyle, GradientOpacity, Silhouette, Styles, Tone, Translucency};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "emission_absorption",
    summary: "Alpha-blended ray casting through a transfer function, front to back with early termination",
    schema: request::schema_of::<Parameters>,
    example,
    source: variants::source,
    shares: &[],
    cases: cases::cases,
    kind: Kind::View { parse, complete: "emission_absorption", calibration: Some(super::smoke) },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct EmissionAbsorption {
        /// Table entry = raw value × scale + offset.
        pub table_scale: f32,
        /// See `table_scale`.
        pub table_offset: f32,
        /// The knots of a table whose entries are not even; 0 if they are.
        pub knots: i32,
        /// A ray ends if its transmittance is less than this.
        pub transmittance_floor: f32,
        /// Multiplies the picture.
        pub brightness: f32,
        /// Row of a two-dimensional table = gradient magnitude (raw values per world unit) × this; 0 for a table of values only.
        pub gradient_scale: f32,
        /// The factor of extinction per gradient magnitude; 0 for off.
        pub gradient_gain: f32,
        /// The factor of extinction is base + gain (1 − |n·v|)^exponent; a gain of 0 for off.
        pub silhouette_base: f32,
        /// See `silhouette_base`.
        pub silhouette_gain: f32,
        /// See `silhouette_base`.
        pub silhouette_exponent: f32,
        /// Curvature of full colour, per world unit; 0 for off.
        pub curvature_full: f32,
        /// Colour of ridges.
        pub ridge: [f32; 3],
        /// Colour of valleys.
        pub valley: [f32; 3],
        /// Width of contours, world units.
        pub contour_width: f32,
        /// 1 if cool-to-warm shading replaces the light's.
        pub toned: i32,
        /// Colour away from the light.
        pub cool: [f32; 3],
        /// Colour towards the light.
        pub warm: [f32; 3],
        /// The part of the light that passes through a surface; 0 for off.
        pub translucency: f32,
        /// Exponent of its lobe.
        pub translucency_exponent: f32,
        /// 1 if a styled sample is lit.
        pub lit: i32,
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Value to colour and opacity per unit length.
    transfer_function: Option<TransferRequest>,
    /// Instead of `transfer_function`: regions of value and gradient magnitude.
    #[schemars(length(min = 1, max = 16))]
    regions: Option<Vec<Region>>,
    /// Instead of `transfer_function`: the parameters of NVIDIA's CUDA sample `volumeRender`, with its nine colours.
    cuda_sample: Option<CudaSample>,
    /// How values lie between voxels. Default: `trilinear`, for labels `nearest`.
    interpolation: Option<Interpolation>,
    /// Take the transfer function as integrated between the ends of each step: second order in the step instead of first.
    #[serde(default)]
    pre_integrated: bool,
    /// Multiplies the picture.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 100))]
    brightness: f64,
    /// Opacity times gradient magnitude.
    gradient_opacity: Option<GradientOpacity>,
    /// Opacity by how the surface is turned.
    silhouette: Option<Silhouette>,
    /// Colour by curvature.
    curvature: Option<CurvatureStyle>,
    /// Cool-to-warm shading.
    tone: Option<Tone>,
    /// Light through thin tissue.
    translucency: Option<Translucency>,
    /// Multiplies every opacity.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 10_000))]
    opacity_scale: f64,
    /// Whether every pixel and pass takes its samples at a random place within its steps, so that banding becomes noise that
    /// averages out. Without, they are taken in the middle: less noise in one pass, but bands that no number of passes removes.
    #[serde(default = "yes")]
    jitter: bool,
    /// Step along the ray, in sides of the smallest voxel.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 16))]
    step_voxels: f64,
    /// A ray ends at this opacity; 1 follows every ray to its end.
    #[serde(default = "default_threshold")]
    #[schemars(range(min = 0.5, max = 1))]
    opacity_threshold: f64,
    /// Diffuse and Blinn-Phong light on the gradient.
    #[serde(default)]
    shading: bool,
    /// The light of `shading`.
    light: Option<LightRequest>,
    /// `back_to_front` is the plain reference form: no early termination, no skipping.
    #[serde(default = "default_order")]
    #[schemars(extend("enum" = ["front_to_back", "back_to_front"]))]
    order: String,
    /// Leap over macro-cells that the transfer function leaves empty. The picture is the same without.
    #[serde(default = "yes")]
    empty_space_skipping: bool,
}

fn one() -> f64 {
    1.0
}
fn yes() -> bool {
    true
}
fn default_threshold() -> f64 {
    0.999
}
fn default_order() -> String {
    "front_to_back".into()
}
/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "emission_absorption",
        "volume": {"builtin": "marschner_lobb", "resolution": 64},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 4},
        "emission_absorption": {"transfer_function": {"preset": "hls", "rotation": 0.1, "exponent": 3}, "shading": true}
    })
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    if let Some(light) = &parameters.light {
        light.check(&format!("{at}/light"))?;
    }
    if let Some(regions) = &parameters.regions {
        regions::check(regions, &format!("{at}/regions"))?;
    }
    parameters.check_together(at)?;
    Ok(Arc::new(parameters))
}

impl Parameters {
    fn styles(&self) -> Styles<'_> {
        Styles {
            gradient_opacity: self.gradient_opacity.as_ref(),
            silhouette: self.silhouette.as_ref(),
            tone: self.tone.as_ref(),
            curvature: self.curvature.as_ref(),
            translucency: self.translucency.as_ref(),
        }
    }

    /// True if the kernel with all styles is needed.
    fn styled(&self) -> bool {
        self.styles().any() || self.regions.is_some()
    }

    fn labels(&self) -> bool {
        self.transfer_function.as_ref().is_some_and(TransferRequest::is_labels)
    }

    fn interpolation(&self) -> Interpolation {
        let sample = self.cuda_sample.as_ref().is_some_and(|c| !c.linear);
        let default = if self.labels() || sample { Interpolation::Nearest } else { Interpolation::Trilinear };
        self.interpolation.unwrap_or(default)
    }

    /// Refuses options that exclude each other.
    fn check_together(&self, at: &str) -> Result<()> {
        let labels = self.labels();
        let plain = self.interpolation() == Interpolation::Trilinear && !self.styled();
        let reversed = self.order == "back_to_front";
        let rules = [
            (self.regions.is_some() && self.transfer_function.is_some(), "regions", "not beside transfer_function"),
            (
                self.cuda_sample.is_some() && self.transfer_function.is_some(),
                "cuda_sample",
                "not beside transfer_function",
            ),
            (self.cuda_sample.is_some() && self.regions.is_some(), "cuda_sample", "not beside regions"),
            (labels && self.interpolation() != Interpolation::Nearest, "interpolation", "nearest, for labels"),
            (
                self.pre_integrated && (!plain || reversed),
                "pre_integrated",
                "only for trilinear interpolation, front to back, without regions and styles",
            ),
            (reversed && !plain, "order", "front_to_back, but for trilinear interpolation without regions and styles"),
            (
                self.curvature.is_some()
                    && self.interpolation() != Interpolation::BSpline
                    && self.interpolation.is_some(),
                "interpolation",
                "b_spline, beside curvature",
            ),
        ];
        match rules.into_iter().find(|(broken, ..)| *broken) {
            Some((_, field, permitted)) => Err(Error::invalid(
                format!("{at}/{field}"),
                "cannot be had together with what else is given",
                permitted,
            )),
            None => Ok(()),
        }
    }
}
