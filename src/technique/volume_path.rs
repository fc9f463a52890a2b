//! # `volume_path`
//!
//! The full radiative transfer equation by unbiased paths from the eye: the volume's values are densities, extinction
//! σ(x) = density(x) · `sigma_t_per_unit`, and
//! L(x, ω) = ∫ T(x, y) σ(y) [ε/σ + albedo ∫ p(ω', ω) L(y, ω') dω'] dy + T L_sky (Chandrasekhar, "Radiative Transfer", 1950).
//! Free paths are found by delta tracking (Woodcock 1965), transmittances by ratio tracking (Novák, Selle, Jarosz 2014). Next-event estimation aims
//! at one light per scattering; the balance heuristic weighs it against light that the phase function finds (Veach & Guibas 1995). Colours of
//! different extinction are tracked by spectral tracking (Kutz et al. 2017).
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `medium` | | `sigma_t_per_unit`, `albedo`, `phase`, `emission`, `index`, `density_window` | depth 40, 0.9, isotropic |
//! | `lights` | | `sun`, `sky`, `point`, `sphere`, `quad` | a sun in a blue sky |
//! | `interpolation` | | `trilinear`, `nearest` | `trilinear` |
//! | `tracking` | | `auto`, `exact` (nearest), `march` (biased), `delta`, `weighted` | `auto` |
//! | `majorant` | | `local` or `global`, times a scale | local, 1 |
//! | `march_step_voxels` | smallest voxel side | 0.01–16 | 1 |
//! | `max_scatterings` | | 0–10⁶ | none |
//! | `next_event` | | | true |
//! | `roulette_threshold` | | 0–1 | 0.25 |
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
    name: "volume_path",
    summary: "Light scattered any number of times: unbiased paths through the volume as a medium",
    schema,
    example,
    source,
    shares: &["medium", "lights"],
    cases,
    kind: Kind::View { parse, complete: "volume_path", calibration: Some(super::smoke) },
};

fn schema() -> &'static Value {
    scattering::schema(&["equiangular"])
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "volume_path",
        "volume": {"builtin": "smoke", "resolution": 64},
        "image": {"width": 128, "height": 128},
        "budget": {"samples": 16},
        "volume_path": {"medium": {"sigma_t_per_unit": 12, "albedo": 0.95, "phase": {"type": "henyey_greenstein", "g": 0.5}}}
    })
}

/// The cases cover each kind of light, emission and colours, and a surface that refracts: a homogeneous box.
fn cases() -> Cases {
    let table = json!({"type": "tabulated", "cosines": [-1, 0, 1], "densities": [1, 0, 2]});
    let lights = json!([{"type": "sun"}, {"type": "sky"}, {"type": "point", "position": [0, 0, 0]},
        {"type": "sphere", "position": [1, 1, 0], "radius": 0.5},
        {"type": "quad", "corner": [0, 1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}]);
    let medium = json!({"sigma_t_per_unit": [2, 3, 4], "emission": 0.1, "phase": table});
    let own = json!({"adaptive": true, "medium": medium, "lights": lights});
    let glass = json!({"medium": {"sigma_t_per_unit": 2, "index": 1.5}, "lights": [{"type": "sky"}]});
    let tiny = vec![tiny(TECHNIQUE.name, "sphere", 10, 2, &own), tiny(TECHNIQUE.name, "constant", 8, 2, &glass)];
    scattering::cases(tiny)
}

fn source() -> Source {
    scattering::source(TECHNIQUE.name)
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn View>> {
    let parameters: Parameters = request::read(parameters, at)?;
    Ok(Arc::new(Scatterer::new(TECHNIQUE.name, parameters, at)?))
}
