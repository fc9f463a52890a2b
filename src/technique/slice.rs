//! # `slice`
//!
//! The volume cut by a plane (multi-planar reformatting), or the greatest, least or mean value of a slab around it, taken along
//! the plane's normal. The camera sees the plane where it is in the volume; beside it the picture is transparent. An
//! orthographic camera that looks along the normal shows it undistorted.
//!
//! The mean over the slab is exact for the interpolant, as are its greatest and least value for `nearest` and `trilinear` (see
//! `kernels/shared/walk.h`); for the splines they are those of five points between two planes of voxels. The part of the slab outside the volume does
//! not count. NaN voxels are empty. Nothing depends on a step.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `plane` | | `point` and `normal`; or `axis` with `position` or `fraction` | through the centre, facing the camera |
//! | `plane.point`, `plane.normal` | world units | | |
//! | `plane.axis` | world axis | `x`, `y`, `z` | |
//! | `plane.position` | world units | | 0 |
//! | `plane.fraction` | of the volume's extent along the axis | 0–1 | |
//! | `thickness` | world units | 0–10¹³ | 0: the plane itself |
//! | `mode` | | `maximum`, `minimum`, `mean`: of the slab | `mean` |
//! | `interpolation` | | `nearest`, `trilinear`, `b_spline`, `catmull_rom` | `trilinear` |
//! | `window` | values | `level` and `width`, or `low` and `high` | most of the volume's values |
//! | `color_map`, `invert` | | see the schema | `grey`, false |
//! | `output` | | `color`, or `value`: the value itself in the EXR | `color` |
//!
//! Example: see [`example`], which a test runs.

mod cases;
mod plan;

use std::sync::Arc;

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Kind, Technique, View};
use crate::asset::Assets;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::interpolation::Interpolation;
use crate::scene::window::{ColorMap, Output, WindowRequest};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "slice",
    summary: "An oblique plane through the volume, or the greatest, least or mean value of a slab around it",
    schema: request::schema_of::<Parameters>,
    example,
    source: plan::source,
    shares: &[],
    cases: cases::cases,
    kind: Kind::View { parse, complete: "slice", calibration: None },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Slice {
        /// a x + b y + c z + d is the world distance from the plane of a point in index units.
        pub plane_index: [f32; 4],
        /// The unit normal, index units per world unit.
        pub normal_index: [f32; 3],
        /// Half the slab, world units.
        pub half_thickness: f32,
        /// 1 if the slab shows its greatest or least value instead of its mean.
        pub peaks: i32,
        /// 1 to search for the greatest raw value, −1 for the least.
        pub sign: f32,
        /// value = raw × slope + inter.
        pub slope: f32,
        /// See `slope`.
        pub inter: f32,
        /// Entry of the colour table = value × scale + offset.
        pub window_scale: f32,
        /// See `window_scale`.
        pub window_offset: f32,
        /// 1 if values go to the film instead of colours.
        pub raw_values: i32,
    }
}

/// A plane: a point and a normal, or a place on one of the world's axes.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// A point of the plane, world units. Default: the volume's centre.
    #[schemars(inner(range(min = -1e13, max = 1e13)))]
    point: Option<[f64; 3]>,
    /// Across the plane, of any length but 0. Default: towards the camera.
    #[schemars(inner(range(min = -1e13, max = 1e13)))]
    normal: Option<[f64; 3]>,
    /// The world axis that the plane is across, instead of `point` and `normal`.
    #[schemars(extend("enum" = ["x", "y", "z"]))]
    axis: Option<String>,
    /// Where on the axis, world units; 0 is the volume's centre.
    #[schemars(range(min = -1e13, max = 1e13))]
    position: Option<f64>,
    /// Where on the axis, from the one end of the volume's extent to the other.
    #[schemars(range(min = 0, max = 1))]
    fraction: Option<f64>,
}

/// What is shown of a slab.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Its greatest value.
    Maximum,
    /// Its least value.
    Minimum,
    /// Its mean.
    #[default]
    Mean,
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Where the volume is cut.
    #[serde(default)]
    plane: Plane,
    /// Thickness of the slab around the plane, world units.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e13))]
    thickness: f64,
    /// What is shown of the slab.
    #[serde(default)]
    mode: Mode,
    /// How values lie between voxels. Default: `trilinear`.
    interpolation: Option<Interpolation>,
    /// The values from the first to the last colour. Default: most of the volume's values, without outliers and what stands for no data; the reply
    /// says which.
    window: Option<WindowRequest>,
    /// The colours.
    #[serde(default)]
    color_map: ColorMap,
    /// Turn the colours round.
    #[serde(default)]
    invert: bool,
    /// `value` writes the value itself to the film.
    #[serde(default)]
    output: Output,
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "slice",
        "volume": {"builtin": "shepp_logan", "resolution": 64},
        "camera": {"eye": [0, 0, 3], "up": [0, 1, 0], "projection": "orthographic"},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 4},
        "slice": {"plane": {"axis": "z", "fraction": 0.45}, "window": {"level": 0.25, "width": 0.5}}
    })
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    if let Some(window) = &parameters.window {
        window.check(&format!("{at}/window"))?;
    }
    parameters.plane.check(&format!("{at}/plane"))?;
    Ok(Arc::new(parameters))
}

impl Plane {
    fn check(&self, at: &str) -> Result<()> {
        let wrong = |field: &str, detail: &str, permitted: &str| {
            Err(Error::invalid(format!("{at}/{field}"), detail, permitted))
        };
        let either = "either axis with position or fraction, or point and normal";
        if self.normal.is_some_and(|n| DVec3::from(n).length() < 1e-9) {
            return wrong("normal", "the normal is zero", "a direction, at least 1e-9 long");
        }
        if self.axis.is_some() {
            for (given, field) in [(self.point.is_some(), "point"), (self.normal.is_some(), "normal")] {
                if given {
                    return wrong(field, "given beside axis", either);
                }
            }
            if self.position.is_some() && self.fraction.is_some() {
                return wrong("fraction", "given beside position", "one of position and fraction");
            }
            return Ok(());
        }
        for (given, field) in [(self.position.is_some(), "position"), (self.fraction.is_some(), "fraction")] {
            if given {
                return wrong(field, "given without axis", either);
            }
        }
        Ok(())
    }
}
