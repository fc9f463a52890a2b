//! The tests of a technique. It lists its own cases, and the tests go through the list of techniques.

use serde_json::{Map, Value, json};

use super::draw::Draw;

/// A technique's own parameters for a test. A view's run on volumes of every voxel type. Instead of an id they name a volume of the tests: `{"test":
/// "labels"}`.
#[derive(Debug, Clone)]
pub struct Case {
    /// The parameters.
    pub own: Value,
    /// True if it runs on a volume of one value too: kernels may treat such a box differently.
    pub is_even_too: bool,
}

impl From<Value> for Case {
    fn from(own: Value) -> Self {
        Self { own, is_even_too: false }
    }
}

/// All cases of a technique.
#[derive(Clone)]
pub struct Cases {
    /// The cases. Together they run every variant of its kernels, and no other.
    pub all: Vec<Case>,
    /// Requests of a few pixels and photons that reach all parts of its kernels. An interpreter of OpenCL checks their accesses to memory.
    pub tiny: Vec<Value>,
    /// Parameters of its own at random, for the study of stated errors.
    pub draw: fn(&mut Draw<'_>) -> Value,
    /// Changes parameters so that they give the truth of the same picture, by another path if there is one: a shorter step, no early end, another
    /// tracker.
    pub truth: fn(&mut Map<String, Value>),
}

impl Default for Cases {
    fn default() -> Self {
        Self { all: Vec::new(), tiny: Vec::new(), draw: |_| json!({}), truth: |_| () }
    }
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
        "image": {"width": 5, "height": 3}, "budget": {"samples": samples}, technique: own})
}
