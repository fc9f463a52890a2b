//! The techniques: the trait of each kind and the one list. A technique is three files of one name and one line here.
//!
//! A technique drives the device through a handle, [`crate::device::Device`], and hands over no recording of what is to be done. Both were
//! tried on `histogram`, with the same table and the same time (256³ voxels, AVX-512: 455 and 458 ms). The recording took 24 lines more in the
//! technique and 67 for its player. It cannot decide: each decision (does a slice's time ask for fewer items, is there more to do, has the
//! solver converged) ends one recording, and the step falls into a part that records and one that learns. A wrong name is found only when
//! it is played. With the handle both stand in one function, in the order in which they happen.

mod analytic;
pub mod backprojection;
mod case;
mod draw;
pub mod emission_absorption;
mod export;
pub mod fbp;
mod field;
pub mod histogram;
pub mod isosurface;
pub(crate) mod majorant;
pub mod optics;
pub mod photon_transport;
mod process;
pub mod project;
pub mod projection;
pub mod scattering;
pub mod single_scatter;
pub mod slab;
pub mod slice;
mod stepping;
mod steps;
mod subject;
mod view;
pub mod volume_path;

use std::sync::{Arc, OnceLock};

use serde_json::Value;

use crate::asset::Assets;
use crate::config::Limits;
use crate::device::enums::{Count, DeviceEnum};
use crate::device::program::Source;
use crate::error::{Error, Result};
use crate::scene::interpolation::Interpolation;
pub use case::{Case, Cases};
pub use draw::Draw;
pub use export::{Export, File, OnDevice};
pub use field::{Field, Look};
pub use process::{Process, Progress, Step};
pub(crate) use steps::LONGEST_STEP_VOXELS;
pub use subject::{AskedField, Subject};
pub use view::{CellUse, Open, PreparedView, Random, Setting, Settings, View, ViewPlan};
pub(crate) use view::{TILE, TILES_HEADER};

/// Every technique. Adding one is one line.
pub const ALL: &[Technique] = &[
    emission_absorption::TECHNIQUE,
    backprojection::TECHNIQUE,
    fbp::TECHNIQUE,
    histogram::TECHNIQUE,
    isosurface::TECHNIQUE,
    photon_transport::TECHNIQUE,
    project::TECHNIQUE,
    projection::TECHNIQUE,
    single_scatter::TECHNIQUE,
    slice::TECHNIQUE,
    volume_path::TECHNIQUE,
];

impl DeviceEnum for Interpolation {
    const PREFIX: &'static str = "INTERPOLATION";
    const ALL: &'static [Self] = &[Self::Nearest, Self::Trilinear, Self::BSpline, Self::CatmullRom];
    fn number(self) -> i32 {
        self.code()
    }
}

/// The `#define`s that all views' kernels share: interpolations and counts.
pub fn view_words() -> String {
    Interpolation::opencl_text() + &Count::opencl_text()
}

/// The description of a technique.
pub struct Technique {
    /// The name of its Rust file, its kernel and its test, and its name in a request.
    pub name: &'static str,
    /// Its purpose, in a sentence.
    pub summary: &'static str,
    /// JSON Schema of its own parameters.
    pub schema: fn() -> &'static Value,
    /// A request that works as it is.
    pub example: fn() -> Value,
    /// Its kernel and the variants of it.
    pub source: fn() -> Source,
    /// The sections of the request that it shares with other techniques, in place of its own parameters of those names.
    pub shares: &'static [&'static str],
    /// The cases that tests run.
    pub cases: fn() -> Cases,
    /// Its kind, with its parser: parameters and their JSON pointer.
    pub kind: Kind,
}

/// The three kinds of technique.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Turns a camera into an image.
    View {
        /// Makes the view; its parameters may name stored objects.
        parse: fn(&Value, &str, &Assets) -> Result<Arc<dyn View>>,
        /// The technique that leaves nothing of the scene out and has this one as a setting: usually itself.
        complete: &'static str,
        /// A scene that measures its speed on a device for the planner; without one, the first technique's speed stands for it.
        calibration: Option<fn() -> Value>,
    },
    /// Fills a grid.
    Field {
        /// Makes the field; its parameters may name stored objects.
        parse: fn(&Value, &str, &Assets) -> Result<Arc<dyn Field>>,
        /// The parameter that sets its amount of random work; `None` for a field that is always computed to its end and has no noise of its own.
        work: Option<Work>,
    },
    /// Turns a subject into a file.
    Export {
        /// Makes the export; its parameters may name stored objects.
        parse: fn(&Value, &str, &Assets) -> Result<Arc<dyn Export>>,
    },
}

/// The parameter of a field that sets its amount of work.
#[derive(Clone, Copy)]
pub struct Work {
    /// Its name, which is also the name of the counted unit.
    pub of: &'static str,
    /// The most that a server permits.
    pub most: fn(&Limits) -> u64,
    /// The amount of work that is enough to measure the field's speed.
    pub first: u64,
    /// The number of looks that are due during the work, besides the last.
    pub looks: u32,
}

impl Technique {
    /// `view`, `field` or `export`.
    pub fn kind_name(&self) -> &'static str {
        match self.kind {
            Kind::View { .. } => "view",
            Kind::Field { .. } => "field",
            Kind::Export { .. } => "export",
        }
    }

    /// The technique that leaves nothing of this one's scene out.
    pub fn complete(&self) -> &'static str {
        match self.kind {
            Kind::View { complete, .. } => complete,
            Kind::Field { .. } | Kind::Export { .. } => self.name,
        }
    }
}

/// The built-in smoke, by which the planner measures a device.
pub(crate) fn smoke() -> Value {
    serde_json::json!({"volume": {"builtin": "smoke", "resolution": 64}})
}

static ADDED: OnceLock<&'static [Technique]> = OnceLock::new();

/// Adds techniques to the list, once, before a service is started: those of the program that contains this library. Their kernel files are read from
/// the folder of [`crate::device::DeviceConfig::kernels`].
///
/// # Errors
/// [`Error::Conflict`] if techniques were added before, or a name is taken.
pub fn add(techniques: &'static [Technique]) -> Result<()> {
    if let Some(taken) = techniques.iter().find(|t| ALL.iter().any(|known| known.name == t.name)) {
        return Err(Error::Conflict(format!("there is a technique {} already", taken.name)));
    }
    ADDED.set(techniques).map_err(|_| Error::Conflict("techniques were added already".into()))
}

/// Every technique that is served: [`ALL`] and the added ones.
pub fn all() -> impl Iterator<Item = &'static Technique> {
    ALL.iter().chain(ADDED.get().copied().unwrap_or_default())
}

/// The technique of a name.
pub fn find(name: &str) -> Option<&'static Technique> {
    all().find(|t| t.name == name)
}

/// The views, in the list's order.
pub fn views() -> impl Iterator<Item = &'static Technique> {
    all().filter(|t| matches!(t.kind, Kind::View { .. }))
}

/// The exports, in the list's order.
pub fn exports() -> impl Iterator<Item = &'static Technique> {
    all().filter(|t| matches!(t.kind, Kind::Export { .. }))
}

/// The fields, in the list's order.
pub fn fields() -> impl Iterator<Item = &'static Technique> {
    all().filter(|t| matches!(t.kind, Kind::Field { .. }))
}

/// The fields of random work, in the list's order.
pub fn random_fields() -> impl Iterator<Item = &'static Technique> {
    all().filter(|t| matches!(t.kind, Kind::Field { work: Some(_), .. }))
}
