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

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Kind, Technique, View, ViewPlan};
use crate::device::program::{Source, Variant};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::device_struct;
use crate::error::Result;
use crate::request;
use crate::scene::camera::Camera;
use crate::scene::light::LightRequest;
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

const FEATURES: [&[(&str, i32)]; 4] = [
    &[("SHADED", 0), ("BACK_TO_FRONT", 0)],
    &[("SHADED", 1), ("BACK_TO_FRONT", 0)],
    &[("SHADED", 0), ("BACK_TO_FRONT", 1)],
    &[("SHADED", 1), ("BACK_TO_FRONT", 1)],
];

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        headers: super::VIEW_HEADERS,
        structs: || DeviceView::opencl_text() + &EmissionAbsorption::opencl_text(),
        arguments: 7,
        variants: || {
            let types = [VoxelType::U8, VoxelType::I16, VoxelType::U16, VoxelType::F32];
            types.into_iter().flat_map(|t| FEATURES.iter().map(move |f| variant(t, f))).collect()
        },
        common: usize::MAX,
    }
}

fn variant(voxel: VoxelType, features: &'static [(&'static str, i32)]) -> Variant {
    Variant { kernel: TECHNIQUE.name, voxel: Some(voxel), features }
}

fn parse(parameters: &Value, at: &str) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::parse(parameters, &(TECHNIQUE.schema)(), at)?;
    if let Some(light) = &parameters.light {
        light.check(&format!("{at}/light"))?;
    }
    Ok(Arc::new(parameters))
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
        let skip = self.empty_space_skipping && self.order == "front_to_back";
        let mut reasons = vec![format!("transfer function: {named}")];
        if !skip {
            reasons.push("every sample is taken: skipping is off".into());
        }
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let features = FEATURES[usize::from(self.shading) + 2 * usize::from(self.order == "back_to_front")];
        Ok(ViewPlan {
            variant: variant(volume.voxels().voxel_type(), features),
            occupied: skip.then(|| function.opaque()),
            step: (self.step_voxels * smallest) as f32,
            opacity_threshold: self.opacity_threshold,
            reasons,
        })
    }

    fn parameters(&self, volume: &Volume, _camera: &Camera) -> Result<Vec<u8>> {
        let [low, high] = self.transfer_function(volume)?.0.domain();
        let per_value = (TABLE_SIZE - 1) as f64 / (high - low);
        let device = EmissionAbsorption {
            table_scale: (volume.slope() * per_value) as f32,
            // Half an entry, so that a value goes to the nearest.
            table_offset: ((volume.inter() - low) * per_value + 0.5) as f32,
            transmittance_floor: if self.opacity_threshold >= 1.0 {
                0.0
            } else {
                (1.0 - self.opacity_threshold) as f32
            },
        };
        Ok(bytemuck::bytes_of(&device).to_vec())
    }

    fn table(&self, volume: &Volume, step: f32) -> Result<Vec<u32>> {
        Ok(self.transfer_function(volume)?.0.table(self.opacity_scale, f64::from(step)))
    }

    fn look(&self, camera: &Camera, view: &mut DeviceView) {
        self.light.clone().unwrap_or_default().apply(camera, view);
    }
}
