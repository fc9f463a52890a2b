//! # `photon_transport`
//!
//! Photons through participating media: a free path ends where its optical depth reaches −ln u, a collision absorbs the part
//! 1 − albedo of the weight and scatters the rest by the medium's phase function, an interface reflects by Fresnel's formulae or
//! refracts, and Russian roulette ends photons that no longer matter without changing any mean (an energy cut-off would lose what
//! it cuts). Without media it is the lecture's `chamber`.
//!
//! The grid is, per launched photon, the fluence Φ = Σ w s / ΔV (track length) or Σ w / (σ ΔV) (collision) per mm², the energy
//! absorbed per mm³, or the lecture's gather L = (1/σ) Σ w P(ω, ω_eye) / ΔV per mm² and steradian: each event is scored towards the
//! eye as it happens, which costs a phase function a collision, and another eye is another simulation. Deposits are 64-bit integers
//! and random numbers are keyed by photon and event, so the same request gives the same bytes on any number of threads.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `photons` | | 1–limit | 10⁶ |
//! | `size_mm` | mm | 10⁻³–10⁶ | 60, 60, 60; the volume's; the chamber's 1, 1, 1 |
//! | `grid` | voxels | 1–512 | 60, 60, 60; the volume's; the chamber's 64, 64, 64 |
//! | `medium` | | absorption, scattering, index, phase; or for gamma photons attenuation and `klein_nishina` | |
//! | `media` with `labels` | | a medium per label of a volume | |
//! | `layers` | | media along z | |
//! | `density` | | extinction times a volume, with `medium` | |
//! | `source` | mm from the box's corner | `pencil`, `isotropic`, `planar`, `disk`, `cone`, `diffuse` | a pencil along +z |
//! | `boundary` | | `absorbing`, `cyclic`, `mirror`; Fresnel | absorbing; layers go on for ever in x and y |
//! | `time_gate_ns` | ns | | none |
//! | `tracking` | | `auto`, `exact`, `march`, `delta`, `weighted` | `auto` |
//! | `march_step_mm` | mm | | a tenth of the shortest mean free path |
//! | `majorant` | | `local` or `global`, times a scale | local, 1 |
//! | `tally` | | `fluence`, `absorbed`, `radiance_gather` | `fluence` |
//! | `estimator` | | `track_length`, `collision` | what the scene permits |
//! | `eye_mm` | mm from the box's corner | for the gather | before the entry face |
//! | `exit_histogram` | mm, degrees | edges of radius and angle | |
//! | `roulette` | | threshold 0–1, survival 0–1 | 10⁻⁴, 0.1 |
//! | `albedo`, `extinction_scale` | | of the chamber | 0.9, 1 |
//! | `seed` | | | 0 |
//!
//! Example: see [`example`], which a test runs.

pub mod attenuation;
mod geometry;
mod medium;
mod plan;
mod report;
mod source;
mod tracking;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::{Field, FieldPlan, FieldResult, Kind, Technique};
use crate::device::program::{Source, Variant};
use crate::device::structs::DeviceStruct;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::camera::Framing;
use crate::volume::{NewVolume, Store, Volume, Voxels};
use geometry::{Geometry, GridRequest, Layer};
use medium::Medium;
use report::Ledgers;
use source::LightSource;
use tracking::Tracking;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "photon_transport",
    summary: "Photons through media: free paths, scattering, refraction; fluence or absorbed energy per voxel, and where the rest went",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    kind: Kind::Field(parse),
};

device_struct! {
    /// Which histories a launch takes.
    pub struct FieldPass {
        /// Number of the first history, low and high word.
        pub first: [u32; 2],
        /// Histories in this launch.
        pub count: u32,
        /// Histories of a work-item.
        pub per_item: u32,
        /// One work-item in so many works.
        pub stride: u32,
        /// Whether each working item has a grid of its own.
        pub own_grids: i32,
        /// The seed, low and high word.
        pub seed: [u32; 2],
    }
}

device_struct! {
    /// The kernel's own parameters. Lengths are in mm from the box's corner; `at_` says where in the table something starts.
    pub struct PhotonTransport {
        /// Voxels along x, y, z.
        pub grid: [i32; 3],
        /// Their sides.
        pub voxel_mm: [f32; 3],
        /// Voxels per mm along x, y, z.
        pub voxels_per_mm: [f32; 3],
        /// Size of the grid.
        pub size_mm: [f32; 3],
        /// Where the media start.
        pub low_mm: [f32; 3],
        /// Where they end.
        pub high_mm: [f32; 3],
        /// Whether they go further than the grid.
        pub endless: i32,
        /// What is at their ends: 0 nothing (absorbing), 1 the other side (cyclic), 2 a mirror.
        pub boundary: [i32; 3],
        /// Cells between walls, along each axis.
        pub walls: [i32; 3],
        /// From wall to wall.
        pub wall_mm: [f32; 3],
        /// Walls per mm; 0 where there is but one cell.
        pub walls_per_mm: [f32; 3],
        /// Media that the table has room for.
        pub media: i32,
        /// The refractive index, where there is but one.
        pub index: f32,
        /// Layers.
        pub layers: i32,
        /// Ends of the layers, from 0 on.
        pub at_layers: i32,
        /// Labels or densities of the voxels.
        pub at_voxels: i32,
        /// Majorants of the blocks.
        pub at_blocks: i32,
        /// Edges of the histogram's radii.
        pub at_radii: i32,
        /// Cosines of the edges of its angles.
        pub at_cosines: i32,
        /// Bins by radius.
        pub radius_bins: i32,
        /// Bins by angle.
        pub angle_bins: i32,
        /// The axis that radii count from.
        pub beam_mm: [f32; 2],
        /// Refractive index outside.
        pub outside_index: f32,
        /// Whether the outer faces reflect and refract.
        pub fresnel: i32,
        /// Whether what they reflect of the beam is lost.
        pub specular_entry: i32,
        /// Whether refractive indices differ inside.
        pub mismatch: i32,
        /// Optical path after which a photon is taken out.
        pub gate_mm: f32,
        /// The march's step.
        pub march_step_mm: f32,
        /// The source's number.
        pub source_type: i32,
        /// Where it is.
        pub source: [f32; 3],
        /// Where it shines, unit length.
        pub source_axis: [f32; 3],
        /// Its edges, or the axes of its disk times its radius.
        pub source_u: [f32; 3],
        /// See `source_u`.
        pub source_v: [f32; 3],
        /// Cosine of the cone's half angle; -1 for all directions.
        pub source_cos_from: f32,
        /// Weights below this meet the roulette.
        pub roulette_threshold: f32,
        /// Probability to survive it.
        pub roulette_survival: f32,
        /// What is added up: see the `TALLY_` names.
        pub tally: i32,
        /// Deposits of length are times this.
        pub deposit_scale: f32,
        /// Paths are counted times this.
        pub paths_per_mm: f32,
        /// A photon that takes more steps than this is trapped, or has met a fault of arithmetic; it is counted as lost.
        pub most_steps: i32,
        /// Energy of the source's gamma photons.
        pub source_kev: f32,
        /// Energy below which they are absorbed.
        pub gamma_least_kev: f32,
        /// Its logarithm to the base 2.
        pub gamma_least_log2: f32,
        /// Rows of the attenuation tables per octave of energy.
        pub gamma_rows_per_log2: f32,
        /// Attenuation and albedo of each medium by energy.
        pub at_gamma: i32,
        /// What the gather looks from.
        pub eye_mm: [f32; 3],
    }
}

/// `FIXED_ONE` of the kernel: sums are in units of 2^-30.
const FIXED_ONE: f64 = 1_073_741_824.0;
/// Entries of the kernel's ledger before the histogram.
const LEDGER_BINS: usize = 17;

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Photons to launch.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    photons: u64,
    /// Voxels of the grid along x, y, z. Default: 60 each; the volume's; the chamber's 64.
    #[schemars(inner(range(min = 1, max = 512)))]
    grid: Option<[u32; 3]>,
    /// Size of the box along x, y, z. Default: 60 mm each; the volume's; the chamber's 1 mm. Layers bring their own thickness.
    #[schemars(inner(range(min = 1e-3, max = 1e6)))]
    size_mm: Option<[f64; 3]>,
    /// The medium of the whole box, or what `density` multiplies.
    medium: Option<Medium>,
    /// A medium per label.
    #[schemars(length(min = 1, max = 1024))]
    media: Option<Vec<Medium>>,
    /// A volume of whole numbers: which of `media` each voxel is.
    labels: Option<GridRequest>,
    /// Layers along z from the entry face on.
    #[schemars(length(min = 1, max = 64))]
    layers: Option<Vec<Layer>>,
    /// A volume: the extinction is its voxel times that of `medium`.
    density: Option<GridRequest>,
    /// Of the chamber: the part of a collision's weight that scatters. Default 0.9.
    #[schemars(range(min = 0, max = 1))]
    albedo: Option<f64>,
    /// Of the chamber: multiplies every density. Default 1.
    #[schemars(range(min = 0, max = 1000))]
    extinction_scale: Option<f64>,
    /// The light.
    source: LightSource,
    /// What is at the box's faces.
    boundary: Boundary,
    /// Photons are taken out after this time in the medium.
    #[schemars(range(min = 1e-6, max = 1e6))]
    time_gate_ns: Option<f64>,
    /// How free paths are found: `exact` from wall to wall, the lecture's `march`, `delta` tracking by majorants, `weighted` tracking
    /// where those may be too small, or the cheapest that is unbiased.
    #[schemars(extend("enum" = ["auto", "exact", "march", "delta", "weighted"]))]
    tracking: String,
    /// The march's step. Default: a tenth of the shortest mean free path.
    #[schemars(range(min = 1e-6, max = 1e6))]
    march_step_mm: Option<f64>,
    /// What delta and weighted tracking go by.
    majorant: Majorant,
    /// What each voxel holds, per launched photon: `fluence` (per mm²), energy `absorbed` (per mm³), or the `radiance_gather` towards
    /// the eye (per mm² and steradian).
    #[schemars(extend("enum" = ["fluence", "absorbed", "radiance_gather"]))]
    tally: String,
    /// How it is added up: `collision` (less work) or `track_length` (less noise where collisions are rare). Default: `track_length`
    /// where something lets photons pass freely and for densities, else `collision`.
    #[schemars(extend("enum" = ["track_length", "collision", null]))]
    estimator: Option<String>,
    /// Where the gather looks from. Default: before the entry face.
    eye_mm: Option<[f64; 3]>,
    /// Bins for what leaves through the faces at the ends of z.
    exit_histogram: Option<ExitHistogram>,
    /// Ends faint photons without bias.
    roulette: Roulette,
    /// Keys every random number of the simulation.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    seed: u64,
}

/// What is at the box's faces.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Boundary {
    /// At both ends of x: `absorbing` lets photons out, `cyclic` brings them back on the other side, `mirror` reflects. Layers
    /// default to going on for ever.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    x: Option<String>,
    /// At both ends of y.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    y: Option<String>,
    /// At both ends of z.
    #[schemars(extend("enum" = ["absorbing", "cyclic", "mirror", null]))]
    z: Option<String>,
    /// Whether absorbing faces reflect and refract where the index outside is another.
    fresnel: bool,
    /// Refractive index outside.
    #[schemars(range(min = 1, max = 4))]
    outside_index: f64,
    /// With `fresnel`: whether the entry face reflects a part of the beam, which is `specular` in the ledger.
    specular_entry: bool,
}

/// What delta and weighted tracking go by.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Majorant {
    /// One for the whole box (`global`), or one for each block of 8³ voxels (`local`).
    #[schemars(extend("enum" = ["local", "global"]))]
    grid: String,
    /// Times the greatest extinction. Below 1 delta tracking is biased, and says so.
    #[schemars(range(min = 1e-3, max = 1e3))]
    scale: f64,
}

/// Bins for what leaves through the faces at the ends of z.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ExitHistogram {
    /// Edges of the radius from the source's axis, rising.
    #[schemars(length(min = 2, max = 257), inner(range(min = 0, max = 1e6)))]
    radius_edges_mm: Vec<f64>,
    /// Edges of the angle to the face's normal, rising.
    #[schemars(length(min = 2, max = 181), inner(range(min = 0, max = 90)))]
    angle_edges_deg: Vec<f64>,
}

/// Russian roulette (Arvo & Kirk, SIGGRAPH 1990).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Roulette {
    /// Weights below this play.
    #[schemars(range(min = 0, max = 1))]
    threshold: f64,
    /// Probability to survive, with the weight divided by it.
    #[schemars(range(min = 0.001, max = 1))]
    survival: f64,
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

impl Default for Majorant {
    fn default() -> Self {
        Self { grid: "local".into(), scale: 1.0 }
    }
}

impl Default for Roulette {
    fn default() -> Self {
        Self { threshold: 1e-4, survival: 0.1 }
    }
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({
        "technique": "emission_absorption",
        "volume": {"photon_transport": {"photons": 200_000, "grid": [48, 48, 48], "albedo": 0.95}},
        "image": {"width": 192, "height": 192},
        "budget": {"samples": 4}
    })
}

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        headers: &[
            "shared/lanes.h",
            "shared/rng.h",
            "shared/phase.h",
            "shared/fresnel.h",
            "shared/medium.h",
            "shared/tally.h",
            "shared/photon.h",
            "shared/compton.h",
        ],
        structs: || {
            "#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable\n\
             #define TALLY_ABSORBED 0\n#define TALLY_FLUENCE 1\n#define TALLY_FLUENCE_TRACK 2\n#define TALLY_GATHER 3\n\
             #define TALLY_ABSORBED_TRACK 4\n\
             #define BOUNDARY_ABSORBING 0\n#define BOUNDARY_CYCLIC 1\n#define BOUNDARY_MIRROR 2\n"
                .to_owned()
                + &FieldPass::opencl_text()
                + &PhotonTransport::opencl_text()
        },
        arguments: 5,
        volume: None,
        variants: || {
            plan::FEATURES.iter().map(|f| Variant { kernel: TECHNIQUE.name, voxel: None, features: f }).collect()
        },
        common: 2,
    }
}

/// A simulation: the request with everything resolved.
struct Simulation {
    parameters: Parameters,
    geometry: Geometry,
    source: source::Source,
    tracking: Tracking,
    tracking_reason: String,
    /// Whether deposits are by track length.
    track: bool,
    reasons: Vec<String>,
}

fn parse(parameters: &Value, at: &str, store: &Store) -> Result<Arc<dyn Field>> {
    let p: Parameters = request::parse(parameters, &(TECHNIQUE.schema)(), at)?;
    let geometry = Geometry::new(&p, store, at)?;
    let source = p.source.resolve(geometry.size_mm, geometry.chamber, &format!("{at}/source"))?;
    if let Some(histogram) = &p.exit_histogram {
        for (name, edges) in
            [("radius_edges_mm", &histogram.radius_edges_mm), ("angle_edges_deg", &histogram.angle_edges_deg)]
        {
            if !edges.windows(2).all(|w| w[0] < w[1]) {
                return Err(Error::invalid(
                    format!("{at}/exit_histogram/{name}"),
                    "the edges do not rise",
                    "rising numbers",
                ));
            }
        }
    }
    let [least, greatest] = geometry.extinction_range_per_mm();
    let ends = [&p.boundary.x, &p.boundary.y, &p.boundary.z];
    if greatest == 0.0
        && p.time_gate_ns.is_none()
        && ends.iter().all(|b| b.as_deref().is_some_and(|b| b != "absorbing"))
    {
        let permitted = "absorbing somewhere, or a time_gate_ns";
        return Err(Error::invalid(
            format!("{at}/boundary"),
            "in a box without media no photon would ever end",
            permitted,
        ));
    }
    let free = least == 0.0 || matches!(geometry.place, geometry::Where::Density(_));
    let (track, why) = match p.estimator.as_deref() {
        Some(asked) => (asked == "track_length", "as asked"),
        None if p.tally == "fluence" && free => (true, "collisions are rare or missing somewhere"),
        None => (false, "photons collide everywhere"),
    };
    let (tracking, tracking_reason) = tracking::choose(&p, &geometry, track, at)?;
    attenuation::check(&p, &geometry, tracking, at)?;
    if p.tally == "radiance_gather" && track {
        let permitted = "collision, or leave it out";
        return Err(Error::invalid(format!("{at}/estimator"), "the gather scores collisions", permitted));
    }
    let estimator = if track { "track_length" } else { "collision" };
    let reasons = vec![
        format!("photon_transport: tracking {tracking_reason}"),
        format!("photon_transport: estimator {estimator}: {why}"),
        "photon_transport: roulette in place of an energy cut-off".into(),
    ];
    Ok(Arc::new(Simulation { parameters: p, geometry, source, tracking, tracking_reason, track, reasons }))
}

impl Field for Simulation {
    fn framing(&self) -> Framing {
        let spacing = DVec3::from(self.spacing_mm());
        let translation = -0.5 * DVec3::from(self.geometry.size_mm);
        let world_from_index = DAffine3 { matrix3: DMat3::from_diagonal(spacing), translation };
        Framing::new(&world_from_index, self.geometry.dims, false)
    }

    fn seed(&self) -> u64 {
        self.parameters.seed
    }

    fn plan(&self) -> Result<FieldPlan> {
        Ok(self.device_plan())
    }

    fn finish(&self, grid: &[u64], ledgers: &[Vec<u64>], histories: u64) -> Result<FieldResult> {
        let [sx, sy, sz] = self.spacing_mm();
        let scale = 1.0 / (self.deposit_scale() * FIXED_ONE * histories as f64 * sx * sy * sz);
        let values = grid.iter().map(|&sum| (sum as i64 as f64 * scale) as f32).collect();
        let volume = Volume::new(NewVolume {
            dims: self.geometry.dims,
            spacing: self.spacing_mm(),
            linear: None,
            voxels: Voxels::F32(values),
            slope: 1.0,
            inter: 0.0,
            name: TECHNIQUE.name.into(),
            format: "field".into(),
            file_affine: None,
            unit: "mm".into(),
            notes: Vec::new(),
        })?;
        Ok(FieldResult { volume, result: self.report(&Ledgers::new(ledgers, histories), grid) })
    }
}
