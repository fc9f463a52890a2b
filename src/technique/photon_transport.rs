//! # `photon_transport`
//!
//! Photons through participating media. A free path ends at the optical depth −ln u. A collision absorbs the part 1 − albedo of the weight and
//! scatters the rest by the medium's phase function. An interface reflects by Fresnel's formulae or refracts. Russian roulette ends photons of small
//! weight without changing any mean (an energy cut-off would lose their energy). Without media the scene is the lecture's `chamber`.
//!
//! The grid is, per launched photon, the fluence Φ = Σ w s / ΔV (track length) or Σ w / (σ ΔV) (collision) per mm², the energy absorbed per mm³, or
//! the lecture's gather L = (1/σ) Σ w P(ω, ω_eye) / ΔV per mm² and steradian. The gather scores each event towards the eye as it happens: this costs
//! a phase function per collision, and another eye needs another simulation. Deposits are 64-bit integers and random numbers are keyed by photon and
//! event, so the same request gives the same bytes on any number of threads.
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
//! | `estimator` | | `track_length`, `collision` | the scene decides |
//! | `eye_mm` | mm from the box's corner | for the gather | before the entry face |
//! | `exit_histogram` | mm, degrees | edges of radius and angle | |
//! | `roulette` | | threshold 0–1, survival 0–1 | 10⁻⁴, 0.1 |
//! | `albedo`, `extinction_scale` | | of the chamber | 0.9, 1 |
//! | `seed` | | | 0 |
//!
//! Example: see [`example`], which a test runs.

pub mod attenuation;
mod cases;
mod clearance;
mod device;
mod gammas;
mod geometry;
mod grid_request;
mod layers;
mod medium;
mod parameters;
mod plan;
mod process;
mod report;
mod source;
mod tracking;

use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use super::{Field, Kind, Look, Process, Technique, Work};
use crate::asset::Assets;
use crate::device::enums::{DeviceEnum, PhaseKind};
use crate::device::numbers::define;
use crate::device::program::{Source, Variant};
use crate::device::structs::DeviceStruct;
use crate::device::{Device, Resume, grid};
use crate::error::{Error, Result};
use crate::request;
use crate::scene::bounds::Bounds;
use device::{BoundaryKind, LedgerEntry, Media, MediumNumber, STATE_WORDS, SourceKind, Tally};
pub use device::{FieldPass, PhotonTransport};
use geometry::Geometry;
use parameters::Parameters;
use plan::DevicePlan;
use process::{LOOKS_ON_THE_WAY, Run};
pub use report::FRACTIONS;
use tracking::Tracking;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "photon_transport",
    summary: "Photons through media: free paths, scattering, refraction; fluence or absorbed energy per voxel, and where the rest went",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    shares: &[],
    cases: cases::cases,
    kind: Kind::Field {
        parse,
        work: Some(Work { of: "photons", most: |limits| limits.max_photons, first: 20_000, looks: LOOKS_ON_THE_WAY }),
    },
};

/// Sums are in units of 2^-30: `FIXED_ONE` of the kernel.
const FIXED_ONE: f64 = 1_073_741_824.0;

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
        words: || {
            "#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable\n".to_owned()
                + &define("FIXED_ONE", format!("{FIXED_ONE:.1}f"))
                + &Resume::opencl_text("PHOTON", STATE_WORDS)
                + &[Media::opencl_text(), MediumNumber::opencl_text(), PhaseKind::opencl_text()].concat()
                + &[Tracking::opencl_text(), SourceKind::opencl_text(), BoundaryKind::opencl_text()].concat()
                + &[Tally::opencl_text(), LedgerEntry::opencl_text()].concat()
        },
        structs: || vec![FieldPass::LAYOUT, PhotonTransport::LAYOUT],
        variants: || plan::FEATURES.iter().map(|f| Variant::new(TECHNIQUE.name, None, f)).collect(),
        common: 2,
    }
}

/// A simulation: the request with everything resolved.
#[derive(Clone)]
struct Simulation {
    parameters: Parameters,
    geometry: Geometry,
    /// The least and greatest extinction anywhere. They are computed once, since a grid has many voxels.
    extinction_range_per_mm: [f64; 2],
    source: source::Source,
    tracking: Tracking,
    tracking_reason: String,
    /// True if deposits are by track length.
    track: bool,
    reasons: Vec<String>,
    /// The plan, made with the request: for a large grid this takes a while, and the device's thread has other jobs. The first process takes it.
    plan: Arc<Mutex<Option<DevicePlan>>>,
}

fn parse(parameters: &Value, at: &str, assets: &Assets) -> Result<Arc<dyn Field>> {
    Ok(Arc::new(Arc::new(simulation(parameters, at, assets)?)))
}

fn simulation(parameters: &Value, at: &str, assets: &Assets) -> Result<Simulation> {
    let p: Parameters = request::read(parameters, at)?;
    let geometry = Geometry::new(&p, assets, at)?;
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
    let extinction_range_per_mm = geometry.extinction_range_per_mm();
    let [least, greatest] = extinction_range_per_mm;
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
    gammas::check(&p, &geometry, tracking, at)?;
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
    let simulation = Simulation {
        parameters: p,
        geometry,
        extinction_range_per_mm,
        source,
        tracking,
        tracking_reason,
        track,
        reasons,
        plan: Arc::default(),
    };
    let plan = simulation.device_plan()?;
    *simulation.plan.lock().unwrap_or_else(PoisonError::into_inner) = Some(plan);
    Ok(simulation)
}

impl Field for Arc<Simulation> {
    fn bounds(&self) -> Bounds {
        let spacing = DVec3::from(self.spacing_mm());
        let translation = -0.5 * DVec3::from(self.geometry.size_mm);
        let world_from_index = DAffine3 { matrix3: DMat3::from_diagonal(spacing), translation };
        Bounds::new(world_from_index, self.geometry.dims, false)
    }

    fn kernels(&self) -> Result<Vec<Variant>> {
        Ok(vec![self.variant()?, grid::OF_SUMS])
    }

    fn reasons(&self) -> Vec<String> {
        self.reasons.clone()
    }

    fn with(&self, work: u64, seed: u64) -> Arc<dyn Field> {
        let mut other = Simulation::clone(self);
        other.parameters.photons = work;
        other.parameters.seed ^= seed;
        Arc::new(Arc::new(other))
    }

    fn begin(&self, device: &mut Device) -> Result<Box<dyn Process<Look = Look>>> {
        Ok(Box::new(Run::new(device, self.clone())?))
    }
}

impl Simulation {
    /// The plan that was made with the request, or a new one.
    fn take_plan(&self) -> Result<DevicePlan> {
        let made = self.plan.lock().unwrap_or_else(PoisonError::into_inner).take();
        made.map_or_else(|| self.device_plan(), Ok)
    }

    /// The grid's value per sum of `photons` photons.
    fn per_photon(&self, photons: u64) -> f64 {
        let [sx, sy, sz] = self.spacing_mm();
        1.0 / (self.deposit_scale() * FIXED_ONE * photons as f64 * sx * sy * sz)
    }
}
