//! What tests run of a technique: it says so itself, and the tests go through the list.

use serde_json::{Value, json};

/// Own parameters that tests run, a view's on volumes of every type of voxels. Instead of an id they name a volume of the tests:
/// `{"test": "labels"}`.
#[derive(Debug, Clone)]
pub struct Case {
    /// The parameters.
    pub own: Value,
    /// True if it runs on a volume of one value too: kernels may take another way through such a box.
    pub is_even_too: bool,
}

impl From<Value> for Case {
    fn from(own: Value) -> Self {
        Self { own, is_even_too: false }
    }
}

/// All that tests run of a technique.
#[derive(Debug, Clone)]
pub struct Cases {
    /// Between them they run every variant of its kernels, and no other.
    pub all: Vec<Case>,
    /// Requests of a few pixels and photons that reach all parts of its kernels: an interpreter of OpenCL watches each access to memory.
    pub tiny: Vec<Value>,
}

/// The parameters with each interpolation in turn.
pub(crate) fn interpolated(interpolations: &[&str], own: &[Value]) -> Vec<Case> {
    let with = |interpolation: &str, own: &Value| {
        let mut own = own.clone();
        own["interpolation"] = json!(interpolation);
        own.into()
    };
    interpolations.iter().flat_map(|name| own.iter().map(|own| with(name, own))).collect()
}

/// A tiny request of a view on a built-in of `resolution` voxels a side.
pub(crate) fn tiny(technique: &str, builtin: &str, resolution: u32, samples: u32, own: &Value) -> Value {
    json!({"technique": technique, "volume": {"builtin": builtin, "resolution": resolution},
        "image": {"width": 9, "height": 7}, "budget": {"samples": samples}, technique: own})
}
