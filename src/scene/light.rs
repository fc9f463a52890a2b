//! Lights from infinity and the shading of surfaces. Every view that shades a gradient shares them (`kernels/shared/shade.h`).

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::camera::Camera;
use crate::device::structs::{LIGHTS, View};
use crate::error::{Error, Result};

/// How a gradient is lit: two-sided Lambert and Blinn-Phong.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightRequest {
    /// Towards the light in world space; null is a headlight at the eye.
    direction: Option<[f64; 3]>,
    /// Instead of `direction`: several lights, each with a direction and a colour.
    #[schemars(length(min = 1, max = 4))]
    lights: Option<Vec<Directional>>,
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
    /// Exponent of the highlight; between whole numbers the highlight is interpolated.
    #[serde(default = "default_shininess")]
    #[schemars(range(min = 1, max = 1000))]
    shininess: f64,
}

/// One light from infinity.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Directional {
    /// Towards the light in world space; null is a headlight at the eye.
    direction: Option<[f64; 3]>,
    /// Linear red, green, blue.
    #[serde(default = "white")]
    #[schemars(inner(range(min = 0, max = 10)))]
    color: [f64; 3],
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
fn white() -> [f64; 3] {
    [1.0; 3]
}

impl Default for LightRequest {
    fn default() -> Self {
        Self {
            direction: None,
            lights: None,
            ambient: default_ambient(),
            diffuse: default_diffuse(),
            specular: default_specular(),
            shininess: default_shininess(),
        }
    }
}

impl LightRequest {
    /// A headlight under a bright sky, for a view that shadows the ambient part.
    pub fn diffuse_sky() -> Self {
        Self { ambient: 0.6, diffuse: 0.4, specular: 0.15, ..Self::default() }
    }

    /// Checks the rules that a schema cannot express: directions have a length, and there is one way to give them.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn check(&self, at: &str) -> Result<()> {
        if self.direction.is_some() && self.lights.is_some() {
            return Err(Error::invalid(
                format!("{at}/lights"),
                "direction is given too",
                "one of direction and lights",
            ));
        }
        for (i, light) in self.lights().iter().enumerate() {
            if light.direction.is_some_and(|d| DVec3::from(d).try_normalize().is_none()) {
                let pointer = if self.lights.is_some() {
                    format!("{at}/lights/{i}/direction")
                } else {
                    format!("{at}/direction")
                };
                return Err(Error::invalid(pointer, "the direction is zero", "a direction of any length"));
            }
        }
        Ok(())
    }

    fn lights(&self) -> Vec<Directional> {
        self.lights.clone().unwrap_or_else(|| vec![Directional { direction: self.direction, color: white() }])
    }

    /// Writes the lights into the device's view.
    pub fn apply(&self, camera: &Camera, view: &mut View) {
        let lights = self.lights();
        view.lights = lights.len().min(LIGHTS) as i32;
        for (i, light) in lights.iter().take(LIGHTS).enumerate() {
            let towards = light.direction.map_or(camera.towards_eye(), |d| DVec3::from(d).normalize());
            view.light_direction[3 * i..3 * i + 3].copy_from_slice(&towards.as_vec3().to_array());
            let m = view.world_gradient_from_index;
            let index = |axis: usize| (0..3).map(|i| towards[i] * f64::from(m[3 * i + axis])).sum::<f64>() as f32;
            view.light_index[3 * i..3 * i + 3].copy_from_slice(&[0, 1, 2].map(index));
            let times = |weight: f64| light.color.map(|c| (weight * c) as f32);
            view.lambert[3 * i..3 * i + 3].copy_from_slice(&times(self.diffuse));
            view.highlight[3 * i..3 * i + 3].copy_from_slice(&times(self.specular));
        }
        view.ambient = self.ambient as f32;
        view.shininess = self.shininess as f32;
    }
}
