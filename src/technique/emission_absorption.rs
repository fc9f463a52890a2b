//! # `emission_absorption`
//!
//! Alpha-blended ray casting through a transfer function: each ray adds up what the volume emits on the way to the eye,
//! less what is absorbed before it gets there:
//!
//! I = Σ_k c_k α_k Π_{j<k} (1 − α_j),  α_k = 1 − exp(−σ_k Δs)   (Max, IEEE TVCG 1(2), 1995)
//!
//! σ is opacity per world unit, so the picture does not depend on the step Δs but for the error that is reported. Each
//! pass starts its rays at another random place within the first step, so that banding becomes noise and averages out;
//! each pass goes through another place within the pixels, so that edges are smooth.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `transfer_function` | | a preset or points | what suits the volume |
//! | `opacity_scale` | | 0–10⁴ | 1 |
//! | `step_voxels` | smallest voxel side | 0.05–16 | 1 |
//! | `opacity_threshold` | opacity | 0.5–1 | 0.999 |
//! | `shading` | | | false |
//! | `light` | | direction and Blinn-Phong weights | a headlight |
//! | `order` | | `front_to_back`, `back_to_front` | `front_to_back` |
//! | `empty_space_skipping` | | | true |
//!
//! Example: see [`example`], which a test runs.

use std::sync::Arc;

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Kind, Technique, View, ViewPlan};
use crate::device::program::{Source, Variant};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::camera::Camera;
use crate::scene::transfer::{TABLE_SIZE, TransferFunction, TransferRequest};
use crate::volume::{Volume, VoxelType};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "emission_absorption",
    summary: "Alpha-blended ray casting through a transfer function, front to back with early termination",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    kind: Kind::View(parse),
};

device_struct! {
    /// The kernel's own parameters.
    pub struct EmissionAbsorption {
        /// Table entry = raw value × scale + offset.
        pub table_scale: f32,
        /// See `table_scale`.
        pub table_offset: f32,
        /// A ray ends when less than this gets through.
        pub transmittance_floor: f32,
        /// Weight of light from everywhere.
        pub ambient: f32,
        /// Weight of Lambert's term.
        pub diffuse: f32,
        /// Weight of the highlight.
        pub specular: f32,
        /// Exponent of the highlight.
        pub shininess: f32,
        /// Towards the light, world space, unit length.
        pub light: [f32; 3],
        /// Row by row: world gradient = this × gradient in index units.
        pub world_gradient_from_index: [f32; 9],
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Value to colour and opacity per unit length.
    transfer_function: Option<TransferRequest>,
    /// Multiplies every opacity.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 10_000))]
    opacity_scale: f64,
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
    light: Option<Light>,
    /// `back_to_front` is the plain reference form: no early termination, no skipping.
    #[serde(default = "default_order")]
    #[schemars(extend("enum" = ["front_to_back", "back_to_front"]))]
    order: String,
    /// Leap over macro-cells that the transfer function leaves empty. The picture is the same without.
    #[serde(default = "yes")]
    empty_space_skipping: bool,
}

/// A light from infinity.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Towards the light in world space; null is a headlight at the eye.
    direction: Option<[f64; 3]>,
    /// Weight of light from everywhere.
    #[serde(default = "default_ambient")]
    #[schemars(range(min = 0, max = 1))]
    ambient: f64,
    /// Weight of Lambert's term.
    #[serde(default = "default_diffuse")]
    #[schemars(range(min = 0, max = 1))]
    diffuse: f64,
    /// Weight of the highlight.
    #[serde(default = "default_specular")]
    #[schemars(range(min = 0, max = 1))]
    specular: f64,
    /// Exponent of the highlight.
    #[serde(default = "default_shininess")]
    #[schemars(range(min = 1, max = 1000))]
    shininess: f64,
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
fn default_ambient() -> f64 {
    0.25
}
fn default_diffuse() -> f64 {
    0.75
}
fn default_specular() -> f64 {
    0.25
}
fn default_shininess() -> f64 {
    20.0
}

impl Default for Light {
    fn default() -> Self {
        Self {
            direction: None,
            ambient: default_ambient(),
            diffuse: default_diffuse(),
            specular: default_specular(),
            shininess: default_shininess(),
        }
    }
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

const FEATURES: [&[(&str, i32)]; 4] = [
    &[("SHADED", 0), ("BACK_TO_FRONT", 0)],
    &[("SHADED", 1), ("BACK_TO_FRONT", 0)],
    &[("SHADED", 0), ("BACK_TO_FRONT", 1)],
    &[("SHADED", 1), ("BACK_TO_FRONT", 1)],
];

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        headers: &["shared/lanes.h", "shared/rng.h", "shared/camera.h", "shared/volume.h", "shared/film.h"],
        structs: || DeviceView::opencl_text() + &EmissionAbsorption::opencl_text(),
        arguments: 7,
        variants: || {
            let types = [VoxelType::U8, VoxelType::I16, VoxelType::U16, VoxelType::F32];
            types.into_iter().flat_map(|t| FEATURES.iter().map(move |f| variant(t, f))).collect()
        },
    }
}

fn variant(voxel: VoxelType, features: &'static [(&'static str, i32)]) -> Variant {
    Variant { kernel: TECHNIQUE.name, voxel: Some(voxel), features }
}

fn parse(parameters: &Value, at: &str) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::parse(parameters, &(TECHNIQUE.schema)(), at)?;
    if let Some(direction) = parameters.light.as_ref().and_then(|l| l.direction)
        && DVec3::from(direction).try_normalize().is_none()
    {
        return Err(Error::invalid(
            format!("{at}/light/direction"),
            "the direction is zero",
            "a direction of any length",
        ));
    }
    Ok(Arc::new(parameters))
}

/// Which macro-cells hold a value with any opacity, by a running count over the table.
fn distances(volume: &Volume, table: &[f32], [low, high]: [f64; 2]) -> Vec<u8> {
    let mut solid_before = vec![0u32; TABLE_SIZE + 1];
    for i in 0..TABLE_SIZE {
        solid_before[i + 1] = solid_before[i] + u32::from(table[i] > 0.0);
    }
    let entry =
        |v: f32| ((f64::from(v) - low) / (high - low) * (TABLE_SIZE - 1) as f64).clamp(0.0, (TABLE_SIZE - 1) as f64);
    // One entry more on each side: the device rounds in single precision.
    let occupied = |min: f32, max: f32| {
        let from = (entry(min) as usize).saturating_sub(1);
        let to = (entry(max) as usize + 2).min(TABLE_SIZE);
        min <= max && solid_before[to] > solid_before[from]
    };
    volume.cells().empty_distance(&occupied)
}

impl Parameters {
    fn transfer_function(&self, volume: &Volume) -> Result<(TransferFunction, String)> {
        let request = self.transfer_function.clone().unwrap_or_default();
        TransferFunction::from_request(&request, volume, "/emission_absorption/transfer_function")
    }
}

impl View for Parameters {
    fn plan(&self, volume: &Volume) -> Result<ViewPlan> {
        let (function, named) = self.transfer_function(volume)?;
        let table = function.table(self.opacity_scale);
        let mut distances = distances(volume, &table, function.domain());
        let empty = distances.iter().filter(|d| **d > 0).count();
        let mut reasons = vec![
            format!("transfer function: {named}"),
            format!("{} of {} macro-cells are empty under it", empty, distances.len()),
        ];
        if !self.empty_space_skipping || self.order == "back_to_front" {
            distances.fill(0);
            reasons.push("every sample is taken: skipping is off".into());
        }
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let features = FEATURES[usize::from(self.shading) + 2 * usize::from(self.order == "back_to_front")];
        Ok(ViewPlan {
            variant: variant(volume.voxels().voxel_type(), features),
            distances,
            table,
            step: (self.step_voxels * smallest) as f32,
            opacity_threshold: self.opacity_threshold,
            reasons,
        })
    }

    fn parameters(&self, volume: &Volume, camera: &Camera) -> Result<Vec<u8>> {
        let light = self.light.clone().unwrap_or_default();
        let towards_light = light.direction.map_or(camera.towards_eye(), |d| DVec3::from(d).normalize());
        let [low, high] = self.transfer_function(volume)?.0.domain();
        let per_value = (TABLE_SIZE - 1) as f64 / (high - low);
        // A gradient is a covector: it goes to the world by the transpose of index-from-world. The sign of the slope does not
        // matter, since the light is two-sided.
        let covector = volume.world_from_index().matrix3.inverse().transpose();
        let row_major = covector.transpose().to_cols_array();
        let device = EmissionAbsorption {
            table_scale: (volume.slope() * per_value) as f32,
            // Half an entry, so that a value goes to the nearest.
            table_offset: ((volume.inter() - low) * per_value + 0.5) as f32,
            transmittance_floor: if self.opacity_threshold >= 1.0 {
                0.0
            } else {
                (1.0 - self.opacity_threshold) as f32
            },
            ambient: light.ambient as f32,
            diffuse: light.diffuse as f32,
            specular: light.specular as f32,
            shininess: light.shininess as f32,
            light: towards_light.as_vec3().to_array(),
            world_gradient_from_index: row_major.map(|v| v as f32),
        };
        Ok(bytemuck::bytes_of(&device).to_vec())
    }
}
