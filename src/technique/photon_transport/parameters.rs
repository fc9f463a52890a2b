//! The parameters in a request.

use schemars::JsonSchema;
use serde::Deserialize;

use super::grid_request::GridRequest;
use super::layers::Layer;
use super::medium::Medium;
use super::source::LightSource;
use crate::technique::majorant::Majorant;

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Photons to launch.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    pub photons: u64,
    /// Voxels of the grid along x, y, z. Default: 60 each; the volume's; the chamber's 64.
    #[schemars(inner(range(min = 1, max = 512)))]
    pub grid: Option<[u32; 3]>,
    /// Size of the box along x, y, z. Default: 60 mm each; the volume's; the chamber's 1 mm. Layers bring their own thickness.
    #[schemars(inner(range(min = 1e-3, max = 1e6)))]
    pub size_mm: Option<[f64; 3]>,
    /// The medium of the whole box, or what `density` multiplies.
    pub medium: Option<Medium>,
    /// A medium per label.
    #[schemars(length(min = 1, max = 1024))]
    pub media: Option<Vec<Medium>>,
    /// A volume of whole numbers: which of `media` each voxel is.
    pub labels: Option<GridRequest>,
    /// Layers along z from the entry face on.
    #[schemars(length(min = 1, max = 64))]
    pub layers: Option<Vec<Layer>>,
    /// A volume: the extinction is its voxel times that of `medium`.
    pub density: Option<GridRequest>,
    /// Of the chamber: the part of a collision's weight that scatters. Default 0.9.
    #[schemars(range(min = 0, max = 1))]
    pub albedo: Option<f64>,
    /// Of the chamber: multiplies every density. Default 1.
    #[schemars(range(min = 0, max = 1000))]
    pub extinction_scale: Option<f64>,
    /// The light.
    pub source: LightSource,
    /// What is at the box's faces.
    pub boundary: Boundary,
    /// Photons are taken out after this time in the medium.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub time_gate_ns: Option<f64>,
    /// How free paths are found: `exact` from wall to wall, the lecture's `march`, `delta` tracking by majorants, `weighted` tracking
    /// where those may be too small, or the cheapest that is unbiased.
    #[schemars(extend("enum" = ["auto", "exact", "march", "delta", "weighted"]))]
    pub tracking: String,
    /// The march's step. Default: a tenth of the shortest mean free path.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub march_step_mm: Option<f64>,
    /// What delta and weighted tracking go by.
    pub majorant: Majorant,
    /// What each voxel holds, per launched photon: `fluence` (per mm²), energy `absorbed` (per mm³), or the `radiance_gather` towards
    /// the eye (per mm² and steradian).
    #[schemars(extend("enum" = ["fluence", "absorbed", "radiance_gather"]))]
    pub tally: String,
    /// How it is added up: `collision` (less work) or `track_length` (less noise where collisions are rare). Default: `track_length`
    /// where something lets photons pass freely and for densities, else `collision`.
    #[schemars(extend("enum" = ["track_length", "collision", null]))]
    pub estimator: Option<String>,
    /// Where the gather looks from. Default: before the entry face.
    pub eye_mm: Option<[f64; 3]>,
    /// Bins for what leaves through the faces at the ends of z.
    pub exit_histogram: Option<ExitHistogram>,
    /// Ends faint photons without bias.
    pub roulette: Roulette,
    /// Keys every random number of the simulation.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    pub seed: u64,
}

/// What is at the box's faces.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Boundary {
    /// At both ends of x: `absorbing` lets photons out, `cyclic` brings them back on the other side, `mirror` reflects. Layers
    /// default to going on for ever.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    pub x: Option<String>,
    /// At both ends of y.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    pub y: Option<String>,
    /// At both ends of z.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    pub z: Option<String>,
    /// Whether absorbing faces reflect and refract where the index outside is another.
    pub fresnel: bool,
    /// Refractive index outside.
    #[schemars(range(min = 1, max = 4))]
    pub outside_index: f64,
    /// With `fresnel`: whether the entry face reflects a part of the beam, which is `specular` in the ledger.
    pub specular_entry: bool,
}

/// Bins for what leaves through the faces at the ends of z.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExitHistogram {
    /// Edges of the radius from the source's axis, rising.
    #[schemars(length(min = 2, max = 257), inner(range(min = 0, max = 1e6)))]
    pub radius_edges_mm: Vec<f64>,
    /// Edges of the angle to the face's normal, rising.
    #[schemars(length(min = 2, max = 181), inner(range(min = 0, max = 90)))]
    pub angle_edges_deg: Vec<f64>,
}

/// Russian roulette (Arvo & Kirk, SIGGRAPH 1990).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Roulette {
    /// Weights below this play.
    #[schemars(range(min = 0, max = 1))]
    pub threshold: f64,
    /// Probability to survive, with the weight divided by it.
    #[schemars(range(min = 0.001, max = 1))]
    pub survival: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            photons: 1_000_000,
            grid: None,
            size_mm: None,
            medium: None,
            media: None,
            labels: None,
            layers: None,
            density: None,
            albedo: None,
            extinction_scale: None,
            source: LightSource::default(),
            boundary: Boundary::default(),
            time_gate_ns: None,
            tracking: "auto".into(),
            march_step_mm: None,
            majorant: Majorant::default(),
            tally: "fluence".into(),
            estimator: None,
            eye_mm: None,
            exit_histogram: None,
            roulette: Roulette::default(),
            seed: 0,
        }
    }
}

impl Default for Boundary {
    fn default() -> Self {
        Self { x: None, y: None, z: None, fresnel: false, outside_index: 1.0, specular_entry: true }
    }
}

impl Default for Roulette {
    fn default() -> Self {
        Self { threshold: 1e-4, survival: 0.1 }
    }
}
