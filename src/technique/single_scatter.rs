//! # `single_scatter`
//!
//! Light that reaches the eye directly or after one scattering, with shadows cast through the volume: the first two terms of the radiative transfer
//! equation's series, L = T L_sky + ∫ T σ [ε/σ + albedo Σ p(ω', ω) T' L_light] dt (Blinn, SIGGRAPH 1982; Kajiya & Von Herzen, SIGGRAPH 1984).
//! Collisions are found by delta tracking, transmittances to every light by ratio tracking, and points, spheres and quads are also seen from places
//! chosen by angle (Kulla & Fajardo, EGSR 2012). It is `volume_path` with `max_scatterings` 1, with less noise near lights. The part of the light
//! that it leaves out grows with albedo and depth.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `medium` | | `sigma_t_per_unit`, `albedo`, `phase`, `emission`, `density_window` | depth 40, 0.9, isotropic |
//! | `lights` | | `sun`, `sky`, `point`, `sphere`, `quad` | a sun in a blue sky |
//! | `interpolation` | | `trilinear`, `nearest` | `trilinear` |
//! | `tracking` | | `auto`, `exact` (nearest), `march` (biased), `delta`, `weighted` | `auto` |
//! | `majorant` | | `local` or `global`, times a scale | local, 1 |
//! | `march_step_voxels` | smallest voxel side | 0.01–16 | 1 |
//! | `equiangular` | | | true |
//! | `clamp_luminance` | | | none |
//! | `adaptive` | | | false |
//!
//! Example: see [`example`], which a test runs.

use std::sync::Arc;

use serde_json::{Value, json};

use super::case::{Cases, tiny};
use super::scattering::{self, Parameters, Scatterer};
use super::{Kind, Technique, View};
use crate::asset::Assets;
use crate::device::program::Source;
use crate::error::Result;
use crate::request;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "single_scatter",
    summary: "Light scattered once, with shadows cast through the volume",
    schema,
    example,
    source,
    shares: &["medium", "lights"],
    cases,
    kind: Kind::View { parse, complete: "volume_path", calibration: Some(super::smoke) },
};

fn schema() -> &'static Value {
    scattering::schema(&scattering::NOT_OF_ONCE)
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "single_scatter",
        "volume": {"builtin": "smoke", "resolution": 64},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 16},
        "single_scatter": {"medium": {"sigma_t_per_unit": 4}, "lights": [{"type": "point", "position": [0.4, 0.6, -0.8]}]}
    })
}

fn cases() -> Cases {
    let own = json!({"tracking": "exact", "medium": {"sigma_t_per_unit": 2},
        "lights": [{"type": "sun"}, {"type": "point", "position": [0, 0.5, 0]}, {"type": "sky"}]});
    let mut request = tiny(TECHNIQUE.name, "sphere", 10, 2, &own);
    // The picture is wider than a tile.
    request["image"]["width"] = json!(17);
    scattering::cases(vec![request])
}

fn source() -> Source {
    scattering::source(TECHNIQUE.name)
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    Ok(Arc::new(Scatterer::new(TECHNIQUE.name, parameters, at)?))
}
