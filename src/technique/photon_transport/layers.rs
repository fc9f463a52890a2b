//! Media in layers along z.

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use super::attenuation::Attenuation;
use super::medium::Medium;
use crate::error::{Error, Result};
use crate::scene::phase::Phase;

/// A layer along z.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Its thickness; the last may be `"infinite"`.
    #[schemars(schema_with = "thickness_schema")]
    thickness_mm: Value,
    /// Absorption coefficient.
    #[schemars(range(min = 0, max = 1e6))]
    #[serde(default = "absorption")]
    mu_a_per_mm: f64,
    /// Scattering coefficient.
    #[schemars(range(min = 0, max = 1e6))]
    #[serde(default = "scattering")]
    mu_s_per_mm: f64,
    /// Refractive index.
    #[schemars(range(min = 1, max = 4))]
    #[serde(default = "index")]
    index: f64,
    /// How a collision turns a photon.
    #[serde(default)]
    phase: Phase,
    /// Of gamma photons: attenuation by energy.
    attenuation: Option<Attenuation>,
}

fn absorption() -> f64 {
    Medium::default().mu_a_per_mm
}

fn scattering() -> f64 {
    Medium::default().mu_s_per_mm
}

fn index() -> f64 {
    Medium::default().index
}

fn thickness_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({"description": "Its thickness in mm, more than 0; the last may be \"infinite\".", "type": ["number", "string"]})
}

impl Layer {
    /// Its medium.
    pub fn medium(&self) -> Medium {
        let (mu_a_per_mm, mu_s_per_mm) = (self.mu_a_per_mm, self.mu_s_per_mm);
        Medium {
            mu_a_per_mm,
            mu_s_per_mm,
            index: self.index,
            phase: self.phase.clone(),
            attenuation: self.attenuation.clone(),
        }
    }
}

/// The ends of the layers, mm; the last may be infinite.
///
/// # Errors
/// [`Error::Invalid`] for an invalid thickness.
pub fn ends(layers: &[Layer], at: &str) -> Result<Vec<f64>> {
    let mut ends = Vec::new();
    let mut depth = 0.0;
    for (i, layer) in layers.iter().enumerate() {
        let pointer = || format!("{at}/{i}/thickness_mm");
        depth += match &layer.thickness_mm {
            Value::String(word) if word == "infinite" && i + 1 == layers.len() => f64::INFINITY,
            Value::Number(n) => n
                .as_f64()
                .filter(|t| (1e-6..=1e6).contains(t))
                .ok_or_else(|| Error::invalid(pointer(), "not a thickness", "0.000001 to 1000000"))?,
            _ => {
                return Err(Error::invalid(
                    pointer(),
                    "not a thickness",
                    "a number of mm; the last may be \"infinite\"",
                ));
            }
        };
        ends.push(depth);
    }
    Ok(ends)
}
