//! What a planner says.

use serde::Serialize;
use serde_json::Value;

use super::features::Features;

/// A number with the interval that it is expected in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Predicted {
    /// The expectation.
    pub value: f64,
    /// The least and the most that it should be, in about nine of ten cases.
    pub interval: [f64; 2],
}

/// A setting that was considered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Considered {
    /// What it is, in words.
    pub words: String,
    /// Its technique.
    pub technique: String,
    /// Samples per pixel that it would take for the error asked for, or could take in the time.
    pub samples: Option<u32>,
    /// And photons, where the volume is a field that is computed first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons: Option<u64>,
    /// What it would take, device milliseconds.
    pub device_ms: Option<f64>,
    /// What it would be wrong by, relative.
    pub error: Option<f64>,
    /// What it is wrong by however many samples it takes.
    pub bias: Option<f64>,
    /// Whether it is enough.
    pub enough: bool,
    /// Why it is, or is not.
    pub why: String,
}

/// A plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// The technique.
    pub technique: String,
    /// Its own parameters.
    pub options: Value,
    /// Samples per pixel.
    pub samples: u32,
    /// Photons, where the volume is a field that is computed first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons: Option<u64>,
    /// Time on the device, ms.
    pub device_ms: Predicted,
    /// The error, relative.
    pub error: Predicted,
    /// Why, in words.
    pub reasons: Vec<String>,
    /// Every setting that was considered.
    pub considered: Vec<Considered>,
    /// What the scene is like.
    pub features: Features,
    /// The request to post: this plan carried out.
    pub request: Value,
}
