//! # `isosurface`
//!
//! The surfaces on which the volume has given values, where the rays first meet them.
//!
//! A ray looks at the value at the ends of its steps; where the isovalue lies between the two, the crossing is refined by regula
//! falsi in the Illinois form (Dowell & Jarratt, BIT 11, 1971) to a ten-thousandth of a voxel. No surface is missed around
//! anything that is thicker than a step. Macro-cells whose values are all on one side cost nothing.
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

pub mod surfaces;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{CellUse, Kind, Technique, View, ViewPlan};
use crate::device::program::{Source, Variant};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::light::LightRequest;
use crate::volume::{Volume, VoxelType};
use surfaces::{MOST_SURFACES, Surface};

/// How closely a crossing is located, in voxels.
const TOLERANCE_VOXELS: f64 = 1e-4;
/// The same in parts of the way through the volume: what single precision can tell apart, a few times over.
const TOLERANCE_OF_WAY: f64 = 3e-7;
/// A ray through transparent surfaces ends at this opacity.
const OPACITY_THRESHOLD: f64 = 0.999;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "isosurface",
    summary: "Surfaces of equal value, met to a ten-thousandth of a voxel and lit by their gradient",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    kind: Kind::View(parse),
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Isosurface {
        /// −1 where values fall as raw values rise, else 1.
        pub sign: f32,
        /// How many surfaces there are.
        pub surfaces: i32,
        /// Raw values, ascending.
        pub isovalue: [f32; MOST_SURFACES],
        /// Linear colours.
        pub color: [f32; 3 * MOST_SURFACES],
        /// Opacities.
        pub opacity: [f32; MOST_SURFACES],
        /// A ray ends when less than this gets through.
        pub transmittance_floor: f32,
        /// Width at which a bracket of a crossing is narrow enough, world units.
        pub tolerance: f32,
        /// Whether the normal is the interpolant's own gradient.
        pub analytic: i32,
        /// Whether the distance from the eye goes to the film instead of a colour.
        pub depth: i32,
        /// Rays that look for what hides the sky; 0 for none.
        pub occlusion_rays: i32,
        /// How far they look, world units.
        pub occlusion_radius: f32,
        /// How far above the surface they start, world units.
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
    #[schemars(range(min = -1e30, max = 1e30))]
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
        "budget": {"samples": 4},
        "isosurface": {"isovalue": 0.5, "color": [0.8, 0.5, 0.3], "ambient_occlusion": {"radius": 0.2}}
    })
}

type Features = [(&'static str, i32); 2];

const fn features(interpolation: Interpolation, layered: bool) -> Features {
    [("INTERPOLATION", interpolation.code()), ("LAYERED", layered as i32)]
}

/// Every set of features that may be built; the first is built before the service is ready.
static FEATURES: [Features; 7] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        features(Trilinear, false),
        features(Trilinear, true),
        features(Nearest, false),
        features(BSpline, false),
        features(BSpline, true),
        features(CatmullRom, false),
        features(CatmullRom, true),
    ]
};

const TYPES: [VoxelType; 4] = [VoxelType::U8, VoxelType::I16, VoxelType::U16, VoxelType::F32];

fn variant(voxel: VoxelType, features: &'static Features) -> Variant {
    Variant { kernel: TECHNIQUE.name, voxel: Some(voxel), features }
}

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        headers: &[
            "shared/lanes.h",
            "shared/rng.h",
            "shared/camera.h",
            "shared/voxel.h",
            "shared/volume.h",
            "shared/inner.h",
            "shared/block.h",
            "shared/packet.h",
            "shared/shade.h",
            "shared/crossing.h",
            "shared/film.h",
        ],
        structs: || DeviceView::opencl_text() + &Isosurface::opencl_text(),
        arguments: 7,
        volume: Some(2),
        variants: || FEATURES.iter().flat_map(|f| TYPES.map(|t| variant(t, f))).collect(),
        common: TYPES.len(),
    }
}

fn parse(parameters: &Value, at: &str) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::parse(parameters, &(TECHNIQUE.schema)(), at)?;
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

impl Parameters {
    fn interpolation(&self) -> Interpolation {
        match self.sampling {
            Sampling::Nearest => Interpolation::Nearest,
            Sampling::Refined => self.interpolation.unwrap_or(Interpolation::Trilinear),
        }
    }

    /// The surfaces by ascending raw value.
    fn surfaces(&self, volume: &Volume) -> Vec<Surface> {
        let mut surfaces = self.surfaces.clone().unwrap_or_else(|| {
            let isovalue = self.isovalue.unwrap_or_else(|| surfaces::default_isovalue(volume));
            vec![Surface::new(isovalue, self.color, self.opacity)]
        });
        surfaces.sort_by(|a, b| (a.isovalue * volume.slope()).total_cmp(&(b.isovalue * volume.slope())));
        surfaces
    }

    fn layered(&self, surfaces: &[Surface]) -> bool {
        surfaces.len() > 1 || self.output == Output::Color && surfaces[0].opacity < 1.0
    }

    /// Values that a cell has to have for a crossing in it.
    fn wanted(&self, surfaces: &[Surface]) -> Vec<[f64; 2]> {
        let least = surfaces.iter().map(|s| s.isovalue).fold(f64::INFINITY, f64::min);
        match self.sampling {
            Sampling::Nearest => vec![[least, f64::MAX]],
            Sampling::Refined => surfaces.iter().map(|s| [s.isovalue; 2]).collect(),
        }
    }
}

impl View for Parameters {
    fn plan(&self, volume: &Volume) -> Result<ViewPlan> {
        let surfaces = self.surfaces(volume);
        let wanted = features(self.interpolation(), self.layered(&surfaces));
        let features = FEATURES.iter().find(|f| **f == wanted).unwrap_or(&FEATURES[0]);
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let values: Vec<String> = surfaces.iter().map(|s| format!("{:.4}", s.isovalue)).collect();
        let mut reasons = vec![format!("isovalues: {}", values.join(", "))];
        if !self.empty_space_skipping {
            reasons.push("every sample is taken: skipping is off".into());
        }
        Ok(ViewPlan {
            variant: variant(volume.voxel_type(), features),
            cells: if self.empty_space_skipping { CellUse::Distances(self.wanted(&surfaces)) } else { CellUse::None },
            step: (self.step_voxels * smallest) as f32,
            opacity_threshold: if self.layered(&surfaces) { OPACITY_THRESHOLD } else { 1.0 },
            reasons,
        })
    }

    fn parameters(&self, volume: &Volume, _camera: &Camera) -> Result<Vec<u8>> {
        let surfaces = self.surfaces(volume);
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let occlusion = self.ambient_occlusion.as_ref();
        let mut device = Isosurface {
            sign: volume.slope().signum() as f32,
            surfaces: surfaces.len() as i32,
            transmittance_floor: (1.0 - OPACITY_THRESHOLD) as f32,
            tolerance: (TOLERANCE_VOXELS * smallest).max(TOLERANCE_OF_WAY * scene::radius(volume)) as f32,
            analytic: i32::from(self.normals == Normals::Analytic),
            depth: i32::from(self.output == Output::Depth),
            occlusion_rays: occlusion.map_or(0, |o| o.rays as i32),
            occlusion_radius: occlusion.and_then(|o| o.radius).unwrap_or(0.1 * scene::mean_side(volume)) as f32,
            occlusion_start: (0.5 * smallest) as f32,
            ..Isosurface::default()
        };
        for (i, surface) in surfaces.iter().enumerate() {
            device.isovalue[i] = ((surface.isovalue - volume.inter()) / volume.slope()) as f32;
            device.color[3 * i..3 * i + 3].copy_from_slice(&surface.color.map(|c| c as f32));
            device.opacity[i] = if self.output == Output::Depth { 1.0 } else { surface.opacity as f32 };
        }
        Ok(bytemuck::bytes_of(&device).to_vec())
    }

    fn look(&self, camera: &Camera, view: &mut DeviceView) {
        // Surfaces are looked for from one end of a step to the other, not at a place within it.
        (view.jittered, view.place) = (0, 0.0);
        let shadowed = self.ambient_occlusion.is_some();
        let light =
            self.light.clone().unwrap_or(if shadowed { LightRequest::diffuse_sky() } else { Default::default() });
        light.apply(camera, view);
    }

    fn warnings(&self, volume: &Volume) -> Vec<Value> {
        let [low, high] = volume.range();
        let outside = |s: &&Surface| !(low..=high).contains(&s.isovalue);
        let warning = |s: &Surface| {
            let message =
                format!("no voxel is on the other side of {}: the values go from {low} to {high}", s.isovalue);
            json!({"code": "isovalue_outside_range", "message": message, "measured": s.isovalue, "bound": [low, high]})
        };
        self.surfaces(volume).iter().filter(outside).map(warning).collect()
    }
}
