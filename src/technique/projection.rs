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
//! The greatest and least value are exact where `exact` is set. Otherwise they are taken at samples `step_voxels` apart, always at
//! the middle of a step: the mean of several jittered maxima would lie below the maximum. Then parts of a beam that cannot show
//! more than was seen are left out, those with the greatest bound are looked at first, and the error is that of the step.
//! NaN voxels are empty. Rays past the volume are transparent; of an X-ray, all the light gets through.
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

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::steps::coarse_step;
use super::{CellUse, Kind, Technique, View, ViewPlan, view_text};
use crate::device::enums::DeviceEnum;
use crate::device::program::{Source, Variant, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::{Error, Result};
use crate::request;
use crate::scene;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::presets::is_hounsfield;
use crate::scene::window::{ColorMap, Output, Window, WindowRequest};
use crate::volume::{Volume, VoxelType};
use crate::{device_enum, device_struct};

/// The optical depth of a bright ray in an X-ray by default: an eighth gets through.
const XRAY_OPTICAL_DEPTH: f64 = 2.0;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "projection",
    summary: "Greatest, least, mean or summed value along each ray, or what gets through of X-rays",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    kind: Kind::View(parse),
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Projection {
        /// A [`DeviceMode`].
        pub mode: i32,
        /// 1 to look for the greatest raw value, −1 for the least.
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
        /// Whether values go to the film instead of colours.
        pub raw_values: i32,
        /// Whether the cells' ranges are looked at.
        pub skipping: i32,
    }
}

device_enum! {
    /// What the kernel makes of the values along a ray.
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
    /// The values from the first to the last colour. Default: what suits the volume; for `xray`, 0 to 1.
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

type Features = [(&'static str, i32); 2];

const fn features(interpolation: Interpolation, walked: bool) -> Features {
    [("INTERPOLATION", interpolation.code()), ("WALKED", walked as i32)]
}

/// Every set of features that may be built; the first two are built before the service is ready.
static FEATURES: [Features; 8] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        features(Trilinear, false),
        features(Trilinear, true),
        features(Nearest, false),
        features(Nearest, true),
        features(BSpline, false),
        features(BSpline, true),
        features(CatmullRom, false),
        features(CatmullRom, true),
    ]
};

fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

fn variant(voxel: VoxelType, features: &'static Features) -> Variant {
    Variant::new(TECHNIQUE.name, Some(voxel), features)
}

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        structs: || view_text() + &Projection::opencl_text() + &DeviceMode::opencl_text(),
        variants: || FEATURES.iter().flat_map(|f| VoxelType::ALL.map(|t| variant(t, f))).collect(),
        common: 2 * VoxelType::ALL.len(),
    }
}

fn parse(parameters: &Value, at: &str) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::parse(parameters, (TECHNIQUE.schema)(), at)?;
    if let Some(window) = &parameters.window {
        window.check(&format!("{at}/window"))?;
    }
    if parameters.exact == Some(true) && parameters.peaks() && parameters.is_spline() {
        let detail = "the greatest and least value of a spline are only known at samples";
        return Err(Error::invalid(format!("{at}/exact"), detail, "false, or nearest or trilinear interpolation"));
    }
    Ok(Arc::new(parameters))
}

impl Parameters {
    fn peaks(&self) -> bool {
        matches!(self.mode, Mode::Maximum | Mode::Minimum)
    }

    fn interpolation(&self) -> Interpolation {
        self.interpolation.unwrap_or(Interpolation::Trilinear)
    }

    fn is_spline(&self) -> bool {
        matches!(self.interpolation(), Interpolation::BSpline | Interpolation::CatmullRom)
    }

    fn walked(&self) -> bool {
        !self.peaks() || self.exact.unwrap_or(self.interpolation() == Interpolation::Nearest)
    }

    fn zero_value(&self, volume: &Volume) -> f64 {
        let suits = if is_hounsfield(volume.range()) { -1000.0 } else { volume.range()[0].min(0.0) };
        self.zero_value.unwrap_or(suits)
    }

    fn sigma_per_value(&self, volume: &Volume) -> f64 {
        self.sigma_per_value.unwrap_or_else(|| {
            let mean = (volume.bright_mean() - self.zero_value(volume)).abs();
            let mean = if mean > 0.0 { mean } else { 1.0 };
            XRAY_OPTICAL_DEPTH / (mean * scene::mean_side(volume))
        })
    }

    fn window(&self, volume: &Volume) -> Result<Window> {
        if let Some(window) = &self.window {
            return window.check("/projection/window");
        }
        let (low, side) = (volume.range()[0], scene::mean_side(volume));
        Ok(match self.mode {
            Mode::Maximum | Mode::Minimum => Window::range(volume),
            Mode::Mean => Window::of(low, volume.bright_mean()),
            Mode::Sum => Window::of(low.min(0.0) * side, volume.bright_mean().max(0.0) * side),
            Mode::Xray => Window::of(0.0, 1.0),
        })
    }
}

impl View for Parameters {
    fn warnings(&self, _: &Volume) -> Vec<Value> {
        coarse_step(self.step_voxels).filter(|_| !self.walked()).into_iter().collect()
    }

    /// Half an entry of the table of colours, where samples are taken and not written to the film as they are.
    fn resolution(&self, volume: &Volume) -> Result<Option<f64>> {
        let plain = !self.walked() && self.interpolation() == Interpolation::Trilinear && self.output != Output::Value;
        let [per_value, _] = self.window(volume)?.scale_and_offset();
        Ok(plain.then(|| 0.5 / f64::from(per_value).abs()))
    }

    fn plan(&self, volume: &Volume) -> Result<ViewPlan> {
        let wanted = features(self.interpolation(), self.walked());
        let features = permitted(wanted)?;
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let mut reasons = vec![format!("window: {}", self.window(volume)?)];
        reasons.push(match (self.walked(), self.empty_space_skipping) {
            (true, _) => "exact for the interpolant: the step plays no part".into(),
            (_, true) => "what cannot show more than was seen is left out".into(),
            (_, false) => "every sample is taken: skipping is off".into(),
        });
        if self.mode == Mode::Xray {
            let (sigma, zero) = (self.sigma_per_value(volume), self.zero_value(volume));
            reasons.push(format!("extinction {sigma:.4e} per unit and value above {zero}"));
        }
        Ok(ViewPlan {
            variant: variant(volume.voxel_type(), features),
            cells: CellUse::Ranges,
            step: (if self.walked() { 1.0 } else { self.step_voxels } * smallest) as f32,
            stepless: self.walked(),
            opacity_threshold: 1.0,
            reasons,
        })
    }

    fn parameters(&self, volume: &Volume, _camera: &Camera) -> Result<Vec<u8>> {
        let [window_scale, window_offset] = self.window(volume)?.scale_and_offset();
        let wanted = if self.mode == Mode::Minimum { -1.0 } else { 1.0 };
        let device = Projection {
            mode: self.mode.on_device().code(),
            sign: (wanted * volume.slope().signum()) as f32,
            slope: volume.slope() as f32,
            inter: volume.inter() as f32,
            sigma_per_value: self.sigma_per_value(volume) as f32,
            zero_value: self.zero_value(volume) as f32,
            window_scale,
            window_offset,
            raw_values: i32::from(self.output == Output::Value),
            skipping: i32::from(self.empty_space_skipping),
        };
        Ok(bytemuck::bytes_of(&device).to_vec())
    }

    fn table(&self, _volume: &Volume, _step: f32) -> Result<Vec<u32>> {
        Ok(self.color_map.table(self.invert))
    }

    fn look(&self, _camera: &Camera, view: &mut DeviceView) {
        view.jittered = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted(features(Interpolation::BSpline, true)).is_ok());
        let said = permitted([("INTERPOLATION", 7), ("WALKED", 0)]).expect_err("not listed").to_string();
        assert!(said.contains("projection INTERPOLATION=7 WALKED=0"), "{said}");
    }
}
