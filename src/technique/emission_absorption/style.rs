//! Styles of samples beyond the transfer function: `kernels/shared/style.h`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::EmissionAbsorption;
use crate::volume::Volume;

/// Opacity times the gradient's magnitude (Levoy 1988).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GradientOpacity {
    /// The magnitude, in values per world unit, at which opacity is unchanged. Default: the value range over ten voxels.
    #[schemars(range(min = 1e-12, max = 1e12))]
    reference: Option<f64>,
}

/// Opacity by how the surface is turned: base + gain (1 − |n·v|)^exponent (Ebert & Rheingans 2000).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Silhouette {
    /// Factor of what faces the eye.
    #[serde(default)]
    #[schemars(range(min = 0, max = 10))]
    base: f64,
    /// What is added at the edge.
    #[serde(default = "default_gain")]
    #[schemars(range(min = 0.001, max = 100))]
    gain: f64,
    /// How narrow the edge is.
    #[serde(default = "default_exponent")]
    #[schemars(range(min = 0.1, max = 100))]
    exponent: f64,
}

/// Cool-to-warm shading (Gooch 1998) by the first light.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tone {
    /// Linear colour away from the light.
    #[serde(default = "default_cool")]
    #[schemars(inner(range(min = 0, max = 1)))]
    cool: [f64; 3],
    /// Linear colour towards the light.
    #[serde(default = "default_warm")]
    #[schemars(inner(range(min = 0, max = 1)))]
    warm: [f64; 3],
}

/// Colour by the principal curvatures of the isosurface through a sample (Kindlmann 2003).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurvatureStyle {
    /// The curvature, per world unit, at which ridges and valleys have their full colour. Default: one over ten voxels.
    #[schemars(range(min = 1e-9, max = 1e9))]
    full: Option<f64>,
    /// Linear colour where the surface is convex.
    #[serde(default = "default_ridge")]
    #[schemars(inner(range(min = 0, max = 1)))]
    ridge: [f64; 3],
    /// Linear colour where it is concave.
    #[serde(default = "default_valley")]
    #[schemars(inner(range(min = 0, max = 1)))]
    valley: [f64; 3],
    /// Width of dark contours, world units; 0 for none.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e9))]
    contour_width: f64,
}

/// Light through thin tissue, with a lobe around the half-vector of the mirrored light.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Translucency {
    /// The part of the light that goes through.
    #[serde(default = "default_amount")]
    #[schemars(range(min = 0.001, max = 1))]
    amount: f64,
    /// Exponent of the lobe behind the surface.
    #[serde(default = "default_lobe")]
    #[schemars(range(min = 1, max = 1000))]
    exponent: f64,
}

fn default_gain() -> f64 {
    4.0
}
fn default_exponent() -> f64 {
    3.0
}
fn default_cool() -> [f64; 3] {
    [0.0, 0.0, 0.3]
}
fn default_warm() -> [f64; 3] {
    [0.25, 0.2, 0.0]
}
fn default_ridge() -> [f64; 3] {
    [1.0, 0.9, 0.6]
}
fn default_valley() -> [f64; 3] {
    [0.25, 0.03, 0.05]
}
fn default_amount() -> f64 {
    0.6
}
fn default_lobe() -> f64 {
    8.0
}

/// The styles of one render.
#[derive(Debug, Default)]
pub struct Styles<'a> {
    /// See [`GradientOpacity`].
    pub gradient_opacity: Option<&'a GradientOpacity>,
    /// See [`Silhouette`].
    pub silhouette: Option<&'a Silhouette>,
    /// See [`Tone`].
    pub tone: Option<&'a Tone>,
    /// See [`CurvatureStyle`].
    pub curvature: Option<&'a CurvatureStyle>,
    /// See [`Translucency`].
    pub translucency: Option<&'a Translucency>,
}

impl Styles<'_> {
    /// True if any style is set.
    pub fn any(&self) -> bool {
        self.gradient_opacity.is_some()
            || self.silhouette.is_some()
            || self.tone.is_some()
            || self.curvature.is_some()
            || self.translucency.is_some()
    }

    /// Writes the styles into the device's parameters, whose gradients are in raw values.
    pub fn apply(&self, volume: &Volume, device: &mut EmissionAbsorption) {
        let voxel = volume.smallest_side();
        let narrow = |c: [f64; 3]| c.map(|v| v as f32);
        if let Some(g) = self.gradient_opacity {
            let [low, high] = volume.range();
            // A constant has no gradient, whatever the reference.
            let range = if high > low { high - low } else { 1.0 };
            let reference = g.reference.unwrap_or(range / (10.0 * voxel));
            device.gradient_gain = (volume.slope().abs() / reference) as f32;
        }
        if let Some(s) = self.silhouette {
            device.silhouette_base = s.base as f32;
            device.silhouette_gain = s.gain as f32;
            device.silhouette_exponent = s.exponent as f32;
        }
        if let Some(t) = self.tone {
            (device.toned, device.cool, device.warm) = (1, narrow(t.cool), narrow(t.warm));
        }
        if let Some(c) = self.curvature {
            device.curvature_full = c.full.unwrap_or(0.1 / voxel) as f32;
            (device.ridge, device.valley) = (narrow(c.ridge), narrow(c.valley));
            device.contour_width = c.contour_width as f32;
        }
        if let Some(t) = self.translucency {
            (device.translucency, device.translucency_exponent) = (t.amount as f32, t.exponent as f32);
        }
    }
}
