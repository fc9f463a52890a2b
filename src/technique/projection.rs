//! # `projection`
//!
//! One number a ray, from all the values along it, shown by window and colour map.
//!
//! | `mode` | the number |
//! |---|---|
//! | `maximum`, `minimum` | the greatest or least value along the ray |
//! | `sum` | ∫ v ds, world units |
//! | `mean` | ∫ v ds / ∫ ds, over the ray within the volume |
//! | `xray` | exp(−∫ σ ds), σ = `sigma_per_value` · (v − `zero_value`): Beer and Lambert's law |
//!
//! The integrals are exact for the interpolant, to rounding: between the planes at which it changes its polynomial it is
//! integrated by Gauss-Legendre with as many points as its degree asks for, and for `nearest` voxel by voxel (Siddon, Medical
//! Physics 12(2), 1985). σ is not clamped at 0, so that this holds: values below `zero_value` count as negative extinction.
//! The greatest and least value are exact if `exact` is set. Otherwise they are taken at samples `step_voxels` apart, always at the middle of a step:
//! the mean of several jittered maxima would lie below the maximum. Parts of a beam that cannot exceed the value found so far are skipped, those with
//! the greatest bound are sampled first, and the error is that of the step. NaN voxels are empty. Rays past the volume are transparent; in an X-ray
//! they have a transmittance of 1.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `mode` | | see above | `maximum` |
//! | `interpolation` | | `nearest`, `trilinear`, `b_spline`, `catmull_rom` | `trilinear` |
//! | `window` | values of the number | `level` and `width`, or `low` and `high` | what suits the volume |
//! | `color_map`, `invert` | | see the schema | `grey`, false |
//! | `output` | | `color`, or `value`: the number itself in the EXR | `color` |
//! | `sigma_per_value` | 1 / (world unit · value) | 10⁻¹²–10¹² | an optical depth of 2 for a bright ray |
//! | `zero_value` | value | | −1000 in Hounsfield units, else the least value or 0 |
//! | `exact` | | not for splines | true for `nearest` |
//! | `step_voxels` | smallest voxel side | 0.05–16 | 1 |
//! | `empty_space_skipping` | | | true |
//!
//! Example: see [`example`], which a test runs.

mod cases;
mod plan;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Kind, Technique, View};
use crate::asset::Assets;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::interpolation::Interpolation;
use crate::scene::window::{ColorMap, Output, WindowRequest};
use crate::{device_enum, device_struct};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "projection",
    summary: "Greatest, least, mean or summed value along each ray, or what gets through of X-rays",
    schema: request::schema_of::<Parameters>,
    example,
    source: plan::source,
    shares: &[],
    cases: cases::cases,
    kind: Kind::View { parse, complete: "projection", calibration: None },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Projection {
        /// A [`DeviceMode`].
        pub mode: i32,
        /// 1 to search for the greatest raw value, −1 for the least.
        pub sign: f32,
        /// value = raw × slope + inter.
        pub slope: f32,
        /// See `slope`.
        pub inter: f32,
        /// Extinction per value.
        pub sigma_per_value: f32,
        /// The value without extinction.
        pub zero_value: f32,
        /// Entry of the colour table = value × scale + offset.
        pub window_scale: f32,
        /// See `window_scale`.
        pub window_offset: f32,
        /// 1 if values go to the film instead of colours.
        pub raw_values: i32,
        /// 1 if the cells' ranges are used to skip.
        pub skipping: i32,
    }
}

device_enum! {
    /// The number that the kernel computes from the values along a ray.
    pub enum DeviceMode: "PROJECTION" {
        /// The greatest of sign times the value.
        Peak,
        /// The mean.
        Mean,
        /// The integral.
        Sum,
        /// The transmittance.
        Xray,
    }
}

impl Mode {
    fn on_device(self) -> DeviceMode {
        match self {
            Self::Maximum | Self::Minimum => DeviceMode::Peak,
            Self::Mean => DeviceMode::Mean,
            Self::Sum => DeviceMode::Sum,
            Self::Xray => DeviceMode::Xray,
        }
    }
}

/// What is made of the values along a ray.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The greatest.
    #[default]
    Maximum,
    /// The least.
    Minimum,
    /// Their mean.
    Mean,
    /// Their integral over the ray's length in world units.
    Sum,
    /// What gets through of light that is absorbed in proportion to them.
    Xray,
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// What is made of the values along a ray.
    #[serde(default)]
    mode: Mode,
    /// How values lie between voxels. Default: `trilinear`.
    interpolation: Option<Interpolation>,
    /// The values from the first to the last colour. Default: what suits the volume, without outliers and what stands for no data; for `xray`, 0
    /// to 1.
    window: Option<WindowRequest>,
    /// The colours.
    #[serde(default)]
    color_map: ColorMap,
    /// Turn the colours round.
    #[serde(default)]
    invert: bool,
    /// `value` writes the number itself to the film.
    #[serde(default)]
    output: Output,
    /// `xray`: extinction per world unit and value.
    #[schemars(range(min = 1e-12, max = 1e12))]
    sigma_per_value: Option<f64>,
    /// `xray`: the value of no extinction.
    #[schemars(range(min = -1e30, max = 1e30))]
    zero_value: Option<f64>,
    /// `maximum`, `minimum`: that of the interpolant itself rather than of samples. Default: only for `nearest`.
    exact: Option<bool>,
    /// `maximum`, `minimum`: step along the ray, in sides of the smallest voxel.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 16))]
    step_voxels: f64,
    /// `maximum`, `minimum`: leave out what cannot show more. The picture is the same without.
    #[serde(default = "yes")]
    empty_space_skipping: bool,
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
        "technique": "projection",
        "volume": {"builtin": "shepp_logan", "resolution": 64},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 4},
        "projection": {"mode": "xray", "sigma_per_value": 1.5, "color_map": "bone", "invert": true}
    })
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    if let Some(window) = &parameters.window {
        window.check(&format!("{at}/window"))?;
    }
    if parameters.exact == Some(true) && parameters.peaks() && parameters.is_spline() {
        let detail = "the greatest and least value of a spline are only known at samples";
        return Err(Error::invalid(format!("{at}/exact"), detail, "false, or nearest or trilinear interpolation"));
    }
    Ok(Arc::new(parameters))
}
