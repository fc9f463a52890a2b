//! # `photon_transport`
//!
//! Photons from a light through a participating medium, as the lecture simulates them in its `chamber`: a free path ends
//! where its optical depth reaches −ln u, a collision absorbs the fraction 1 − albedo of the weight and scatters the rest
//! isotropically, and Russian roulette ends photons that no longer matter without changing any mean (an energy cut-off
//! would lose what it cuts). Voxels are traversed exactly, so there is no step to choose.
//!
//! The grid is the fluence per launched photon, Φ = Σ w s / ΔV (track length) or Σ w / (σ ΔV) (collision), per mm², or the
//! energy absorbed per mm³. Deposits are 64-bit integers and random numbers are keyed by photon and event, so the same
//! request gives the same bytes on any number of threads.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `photons` | | 1–limit | 10⁶ |
//! | `grid` | voxels | 4–512 | 64, 64, 64 |
//! | `size_mm` | mm | 10⁻³–10⁶ | 1, 1, 1 |
//! | `albedo` | | 0–1 | 0.9 |
//! | `extinction_scale` | | 0–1000 | 1 |
//! | `source` | mm from the box's corner | a point, `isotropic` or a `cone` | above the hole in the lid |
//! | `tally` | | `fluence`, `absorbed` | `fluence` |
//! | `estimator` | | `track_length`, `collision` | `track_length` |
//! | `roulette` | | threshold 0–1, survival 0–1 | 10⁻⁴, 0.1 |
//! | `seed` | | | 0 |
//!
//! Example: see [`example`], which a test runs.

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
use crate::volume::{NewVolume, Volume, Voxels, builtin};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "photon_transport",
    summary: "Photons from a light through the lecture's chamber: free paths, isotropic scattering, fluence per voxel",
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
        /// Histories that a lane takes one after the other.
        pub per_lane: u32,
        /// The seed, low and high word.
        pub seed: [u32; 2],
    }
}

device_struct! {
    /// The kernel's own parameters.
    pub struct PhotonTransport {
        /// Voxels along x, y, z.
        pub grid: [i32; 3],
        /// Voxels per mm along x, y, z.
        pub cells_per_mm: [f32; 3],
        /// The source, in voxels from the corner.
        pub source: [f32; 3],
        /// The axis of the source's cone, unit length.
        pub source_axis: [f32; 3],
        /// Cosine of the cone's half angle; -1 for all directions.
        pub source_cos_from: f32,
        /// The part of the weight that a collision scatters.
        pub albedo: f32,
        /// Weights below this meet the roulette.
        pub roulette_threshold: f32,
        /// Probability to survive it.
        pub roulette_survival: f32,
        /// What is added up: see the `TALLY_` names.
        pub tally: i32,
    }
}

/// `FIXED_ONE` of the kernel: sums are in units of 2^-30.
const FIXED_ONE: f64 = 1_073_741_824.0;
/// Photons that a lane takes one after the other, at most: enough that lanes which end early are refilled.
const PHOTONS_PER_LANE: u32 = 32;
/// Entries of the kernel's ledger, in its order.
const LEDGER: usize = 11;
/// Names of the ledger's fractions, in the kernel's order.
const FRACTIONS: [&str; 8] =
    ["exit_minus_x", "exit_plus_x", "exit_minus_y", "exit_plus_y", "exit_minus_z", "exit_plus_z", "absorbed", "lost"];

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Parameters {
    /// Photons to launch.
    #[schemars(range(min = 1, max = 1_000_000_000))]
    photons: u64,
    /// Voxels of the grid along x, y, z.
    #[schemars(inner(range(min = 4, max = 512)))]
    grid: [u32; 3],
    /// Size of the chamber along x, y, z. Its densities are per mm.
    #[schemars(inner(range(min = 1e-3, max = 1e6)))]
    size_mm: [f64; 3],
    /// The part of a collision's weight that scatters; the rest is absorbed.
    #[schemars(range(min = 0, max = 1))]
    albedo: f64,
    /// Multiplies every density.
    #[schemars(range(min = 0, max = 1000))]
    extinction_scale: f64,
    /// The light.
    source: LightSource,
    /// What each voxel holds: `fluence` (per mm²) or energy `absorbed` (per mm³), per launched photon.
    #[schemars(extend("enum" = ["fluence", "absorbed"]))]
    tally: String,
    /// How the fluence is added up: `track_length` (less noise in thin air) or `collision` (less work).
    #[schemars(extend("enum" = ["track_length", "collision"]))]
    estimator: String,
    /// Ends faint photons without bias.
    roulette: Roulette,
    /// Keys every random number of the simulation.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    seed: u64,
}

/// The light.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct LightSource {
    /// `isotropic`, or a `cone` about `direction`.
    #[serde(rename = "type")]
    #[schemars(extend("enum" = ["isotropic", "cone"]))]
    kind: String,
    /// Where it stands, from the box's corner; null is above the hole in the lid.
    position_mm: Option<[f64; 3]>,
    /// Where a cone points.
    direction: [f64; 3],
    /// Half the cone's opening.
    #[schemars(range(min = 0.01, max = 180))]
    half_angle_deg: f64,
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
            grid: [64; 3],
            size_mm: [1.0; 3],
            albedo: 0.9,
            extinction_scale: 1.0,
            source: LightSource::default(),
            tally: "fluence".into(),
            estimator: "track_length".into(),
            roulette: Roulette::default(),
            seed: 0,
        }
    }
}

impl Default for LightSource {
    fn default() -> Self {
        Self { kind: "isotropic".into(), position_mm: None, direction: [0.0, -1.0, 0.0], half_angle_deg: 20.0 }
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
        headers: &["shared/lanes.h", "shared/rng.h"],
        structs: || {
            "#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable\n\
             #define TALLY_ABSORBED 0\n#define TALLY_FLUENCE_COLLISION 1\n#define TALLY_FLUENCE_TRACK 2\n"
                .to_owned()
                + &FieldPass::opencl_text()
                + &PhotonTransport::opencl_text()
        },
        arguments: 5,
        volume: None,
        variants: || vec![VARIANT],
        common: usize::MAX,
    }
}

const VARIANT: Variant = Variant { kernel: TECHNIQUE.name, voxel: None, features: &[] };

fn parse(parameters: &Value, at: &str) -> Result<Arc<dyn Field>> {
    let p: Parameters = request::parse(parameters, &(TECHNIQUE.schema)(), at)?;
    for (axis, (place, size)) in p.position_mm().into_iter().zip(p.size_mm).enumerate() {
        if !(0.0..=size).contains(&place) {
            let permitted = format!("0 to {size} (size_mm)");
            return Err(Error::invalid(format!("{at}/source/position_mm/{axis}"), "outside the box", permitted));
        }
    }
    if DVec3::from(p.source.direction).try_normalize().is_none() {
        return Err(Error::invalid(
            format!("{at}/source/direction"),
            "the direction is zero",
            "a direction of any length",
        ));
    }
    Ok(Arc::new(p))
}

impl Parameters {
    fn dims(&self) -> [usize; 3] {
        self.grid.map(|n| n as usize)
    }

    fn spacing_mm(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.size_mm[a] / f64::from(self.grid[a]))
    }

    /// The point light stands above the middle of the lid's hole unless told otherwise.
    fn position_mm(&self) -> [f64; 3] {
        self.source.position_mm.unwrap_or_else(|| std::array::from_fn(|a| [0.5, 0.9, 0.5][a] * self.size_mm[a]))
    }

    fn world_from_index(&self) -> DAffine3 {
        let spacing = DVec3::from(self.spacing_mm());
        DAffine3 { matrix3: DMat3::from_diagonal(spacing), translation: -0.5 * DVec3::from(self.size_mm) }
    }

    /// The extinction of every voxel, from the chamber at its centre.
    fn extinction_per_mm(&self) -> Vec<f32> {
        let [nx, ny, nz] = self.dims();
        let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let mut table = Vec::with_capacity(nx * ny * nz);
        for z in 0..nz {
            for y in 0..ny {
                table.extend((0..nx).map(|x| {
                    (builtin::chamber_value(centre(x, nx), centre(y, ny), centre(z, nz)) * self.extinction_scale) as f32
                }));
            }
        }
        table
    }

    fn tally_code(&self) -> i32 {
        match (self.tally.as_str(), self.estimator.as_str()) {
            ("absorbed", _) => 0,
            (_, "collision") => 1,
            _ => 2,
        }
    }
}

impl Field for Parameters {
    fn framing(&self) -> Framing {
        Framing::new(&self.world_from_index(), self.dims(), false)
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn plan(&self) -> Result<FieldPlan> {
        let cells_per_mm = self.spacing_mm().map(|s| (1.0 / s) as f32);
        let position = self.position_mm();
        let half_angle = if self.source.kind == "cone" { self.source.half_angle_deg } else { 180.0 };
        let parameters = PhotonTransport {
            grid: self.grid.map(|n| n as i32),
            cells_per_mm,
            source: std::array::from_fn(|a| (position[a] / self.size_mm[a] * f64::from(self.grid[a])) as f32),
            source_axis: DVec3::from(self.source.direction).normalize().as_vec3().to_array(),
            source_cos_from: half_angle.to_radians().cos() as f32,
            albedo: self.albedo as f32,
            roulette_threshold: self.roulette.threshold as f32,
            roulette_survival: self.roulette.survival as f32,
            tally: self.tally_code(),
        };
        Ok(FieldPlan {
            variant: VARIANT,
            parameters: bytemuck::bytes_of(&parameters).to_vec(),
            table: self.extinction_per_mm(),
            cells: self.dims().iter().product(),
            ledger: LEDGER,
            histories: self.photons,
            histories_per_lane: PHOTONS_PER_LANE,
            reasons: vec![
                "photon_transport: free paths by exact voxel traversal, unbiased for any density, no step and no majorant".into(),
                "photon_transport: scattering is isotropic; roulette in place of an energy cut-off".into(),
            ],
        })
    }

    fn finish(&self, grid: &[u64], ledgers: &[Vec<u64>], histories: u64) -> Result<FieldResult> {
        let [sx, sy, sz] = self.spacing_mm();
        // Deposits of path are in voxel sides along x: back to mm. Then per photon and per volume of a voxel.
        let per_deposit = if self.tally_code() == 0 { 1.0 } else { sx };
        let scale = per_deposit / (FIXED_ONE * histories as f64 * sx * sy * sz);
        let values = grid.iter().map(|&sum| (sum as i64 as f64 * scale) as f32).collect();
        let volume = Volume::new(NewVolume {
            dims: self.dims(),
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
        Ok(FieldResult { volume, result: self.report(ledgers, histories) })
    }
}

impl Parameters {
    /// The ledger as fractions of the launched weight, each with the standard error of its batches.
    fn report(&self, ledgers: &[Vec<u64>], histories: u64) -> Value {
        let total = |entry: usize| ledgers.iter().map(|l| l[entry] as i64 as f64).sum::<f64>() / FIXED_ONE;
        let batches = ledgers.len() as f64;
        let per_batch = histories as f64 / batches;
        let mut fractions = serde_json::Map::new();
        for (entry, name) in FRACTIONS.iter().enumerate() {
            let mean = total(entry) / histories as f64;
            let deviation = |l: &Vec<u64>| (l[entry] as i64 as f64 / FIXED_ONE / per_batch - mean).powi(2);
            let variance = ledgers.iter().map(deviation).sum::<f64>() / (batches - 1.0) / batches;
            let error = if ledgers.len() > 1 { json!(variance.sqrt()) } else { Value::Null };
            fractions.insert((*name).into(), json!({"value": mean, "standard_error": error}));
        }
        json!({
            "photons": histories,
            "ledger": fractions,
            "mean_scatterings": total(8) / histories as f64,
            "faults": total(9).round() as u64,
            "mean_path_mm": total(10) / histories as f64,
            "tally": self.tally,
            "estimator": self.estimator,
        })
    }
}
