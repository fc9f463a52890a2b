//! # `ball`
//!
//! A ball of radius 1 under a light at the eye: a view that looks at no volume. Its grey is albedo · n · v.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `albedo` | | 0–1 | 0.8 |

use std::sync::Arc;

use cloudchamber::asset::Assets;
use cloudchamber::device::program::{Source, Variant};
use cloudchamber::device::structs::{DeviceStruct, View as DeviceView};
use cloudchamber::device_struct;
use cloudchamber::error::Result;
use cloudchamber::request;
use cloudchamber::scene::bounds::Bounds;
use cloudchamber::scene::camera::Camera;
use cloudchamber::technique::{Cases, CellUse, Kind, PreparedView, Subject, Technique, View, ViewPlan, view_words};
use cloudchamber::volume::Volume;
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "ball",
    summary: "A ball under a light at the eye",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    shares: &[],
    cases: || Cases { all: vec![json!({}).into()], tiny: vec![example()], ..Cases::default() },
    kind: Kind::View { parse, complete: "ball", calibration: None },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct Ball {
        /// The part of the light that the surface sends back.
        pub albedo: f32,
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// The part of the light that the surface sends back.
    #[serde(default = "default_albedo")]
    #[schemars(range(min = 0, max = 1))]
    albedo: f64,
}

fn default_albedo() -> f64 {
    0.8
}

fn example() -> Value {
    json!({"technique": "ball", "image": {"width": 9, "height": 7}, "budget": {"samples": 2}})
}

fn variant() -> Variant {
    Variant::new("ball", None, &[])
}

fn source() -> Source {
    Source {
        kernel: "ball",
        words: view_words,
        structs: || vec![DeviceView::LAYOUT, Ball::LAYOUT],
        variants: || vec![variant()],
        common: 0,
    }
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    Ok(Arc::new(request::read::<Parameters>(parameters, at)?))
}

impl View for Parameters {
    fn bounds(&self) -> Option<Bounds> {
        Some(Bounds::of_corners(DVec3::NEG_ONE, DVec3::ONE))
    }

    fn prepare(&self, _: &Subject) -> Result<Arc<dyn PreparedView>> {
        let plan = ViewPlan {
            variant: variant(),
            cells: CellUse::None,
            step: 1.0,
            state_words: 0,
            stepless: true,
            cheap: false,
            biased: false,
            extremum: false,
            opacity_threshold: 1.0,
            reasons: vec!["the surface is a root of a quadratic equation".into()],
        };
        Ok(Arc::new(Prepared { albedo: self.albedo, plan }))
    }
}

struct Prepared {
    albedo: f64,
    plan: ViewPlan,
}

impl PreparedView for Prepared {
    fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn volume(&self) -> Option<&Arc<Volume>> {
        None
    }

    fn parameters(&self, _: &Camera) -> Vec<u8> {
        bytemuck::bytes_of(&Ball { albedo: self.albedo as f32 }).to_vec()
    }

    fn set_shared(&self, _: &Camera, view: &mut DeviceView) {
        view.jittered = 0;
    }
}
