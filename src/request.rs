//! Wire types: the parts of a request, as JSON Schema and serde see them. No defaults are resolved here and nothing is read.
//!
//! A body is checked against the very schema that is served (`schema`), so that documentation and server cannot differ. Rules that a schema cannot
//! express are checked when the [`crate::render::Scene`] is made.

mod check;
mod schema;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

pub use check::{check, parse, read};
pub use schema::{kept, schema_of, schema_without};

/// The largest whole number that every JSON reader carries exactly: 2^53 - 1.
pub const LARGEST_WHOLE: i64 = 9_007_199_254_740_991;

/// The body of `POST /v1/renders`, less the techniques' own parameters.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
pub struct RenderRequest {
    /// The view technique that makes the picture.
    pub technique: String,
    /// What is looked at: an uploaded volume, a built-in one, or a field technique's name with its parameters. Default: the built-in `smoke`.
    pub volume: Option<VolumeRequest>,
    /// Default: one that frames the volume.
    pub camera: Option<CameraRequest>,
    /// Size of the picture.
    pub image: Option<ImageRequest>,
    /// What of the volume is shown. Default: all.
    pub clip: Option<ClipRequest>,
    /// When to stop: whichever is reached first. Default: the technique's own number of samples.
    pub budget: Option<BudgetRequest>,
    /// What the volume is made of, for techniques that scatter light: in place of their own `medium`, so that one scene serves them all.
    pub medium: Option<Value>,
    /// The lights of such a technique, in place of its own `lights`.
    pub lights: Option<Value>,
    /// Keys every random number of the render.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    pub seed: Option<u64>,
    /// The techniques' own parameters, by technique.
    #[serde(flatten)]
    #[schemars(skip)]
    pub parameters: Map<String, Value>,
}

/// What is looked at: exactly one of `id`, `builtin`, or the name of a field technique.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
pub struct VolumeRequest {
    /// The id of an uploaded volume.
    pub id: Option<String>,
    /// The name of a built-in volume.
    pub builtin: Option<String>,
    /// Voxels a side of a built-in volume.
    #[schemars(range(min = 8, max = 512))]
    pub resolution: Option<u32>,
    /// Seed of a built-in volume that is made of random numbers.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    pub seed: Option<u64>,
    /// A coarser level of an uploaded or built-in volume: its voxels are the means of boxes 2^level times as wide as the smallest side of a voxel.
    /// `step_voxels` is of the level's. Default 0, the volume as it is; the planner chooses one where it is not given.
    #[schemars(range(min = 0, max = crate::volume::MOST_LEVEL))]
    pub level: Option<u32>,
    /// A field technique's parameters, by technique.
    #[serde(flatten)]
    #[schemars(skip)]
    pub field: Map<String, Value>,
}

/// A camera: either `camera_to_world`, or `eye` with `target` and `up`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraRequest {
    /// Column-major 4x4 matrix, rigid, translation in the last column; the camera looks along -z with +y up (three.js, glTF).
    #[schemars(length(min = 16, max = 16))]
    pub camera_to_world: Option<Vec<f64>>,
    /// Where the eye is, in world units (mm for a scan; the volume is centred at the origin).
    pub eye: Option<[f64; 3]>,
    /// What the eye looks at. Default: the volume's centre.
    pub target: Option<[f64; 3]>,
    /// Which way is up. Default: z for a scan, y for a built-in.
    pub up: Option<[f64; 3]>,
    /// Full vertical angle of view in degrees. Default 53.13.
    #[schemars(range(min = 0.1, max = 179))]
    pub fov_y_deg: Option<f64>,
    /// `orthographic` shows what `fov_y_deg` would show in the target's plane.
    #[schemars(extend("enum" = ["perspective", "orthographic"]))]
    pub projection: Option<String>,
}

/// Size of the picture.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageRequest {
    /// Pixels across. Default 512.
    #[schemars(range(min = 1, max = 4096))]
    pub width: Option<u32>,
    /// Pixels down. Default 512.
    #[schemars(range(min = 1, max = 4096))]
    pub height: Option<u32>,
    /// Linear red, green, blue behind the volume. Default black.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub background: Option<[f64; 3]>,
    /// Leave out the background: a PNG with alpha.
    pub transparent: Option<bool>,
}

/// Clipping planes and a crop box: only what is inside of all of them is shown.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClipRequest {
    /// Planes in world units.
    #[schemars(length(max = 8))]
    pub planes: Option<Vec<PlaneRequest>>,
    /// A box along the world's axes.
    #[serde(rename = "box")]
    pub crop: Option<BoxRequest>,
}

/// A plane: the side that its normal points to is shown.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneRequest {
    /// Towards what is shown, of any length.
    pub normal: [f64; 3],
    /// A point of the plane. Default: the volume's centre.
    #[serde(default)]
    pub point: [f64; 3],
}

/// A box along the world's axes, in world units.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRequest {
    /// Its least corner.
    pub min: [f64; 3],
    /// Its greatest corner.
    pub max: [f64; 3],
}

/// When to stop.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BudgetRequest {
    /// Samples per pixel.
    #[schemars(range(min = 1, max = 65536))]
    pub samples: Option<u32>,
    /// Milliseconds from the start of the render; the sample under way is finished.
    #[schemars(range(min = 1, max = 3_600_000))]
    pub time_ms: Option<u64>,
    /// Stop when `error` is at most this.
    #[schemars(range(min = 1e-6, max = 10))]
    pub max_error: Option<f64>,
}
