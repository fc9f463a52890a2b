//! The techniques: the trait of each kind and the one list. A technique is three files of one name and one line here.

pub mod emission_absorption;
pub mod isosurface;
pub(crate) mod majorant;
pub mod photon_transport;
pub mod projection;
pub mod scattering;
pub mod single_scatter;
pub mod slab;
pub mod slice;
mod steps;
pub mod volume_path;

use std::sync::Arc;

use serde_json::Value;

use crate::device::enums::{Count, DeviceEnum};
use crate::device::program::{Source, Variant};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene::camera::{Camera, Framing};
use crate::scene::interpolation::Interpolation;
use crate::volume::{Store, Volume};

/// Every technique. Adding one is one line.
pub const ALL: &[Technique] = &[
    emission_absorption::TECHNIQUE,
    isosurface::TECHNIQUE,
    photon_transport::TECHNIQUE,
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

/// The OpenCL C text that all views share: the camera and the pass, and the names of interpolations and counts.
pub(crate) fn view_text() -> String {
    DeviceView::opencl_text() + &Interpolation::opencl_text() + &Count::opencl_text()
}

/// The description of a technique.
pub struct Technique {
    /// Its name: of its Rust file, its kernel, its test, and in a request.
    pub name: &'static str,
    /// Its purpose, in a sentence.
    pub summary: &'static str,
    /// JSON Schema of its own parameters.
    pub schema: fn() -> &'static Value,
    /// A request that works as it is.
    pub example: fn() -> Value,
    /// Its kernel and the variants of it.
    pub source: fn() -> Source,
    /// View or field, with the parser of its parameters, which is told their JSON pointer.
    pub kind: Kind,
}

/// The two kinds of technique.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Turns a camera into an image.
    View(fn(&Value, &str) -> Result<Arc<dyn View>>),
    /// Fills a grid; its parameters may name volumes of the store.
    Field(fn(&Value, &str, &Store) -> Result<Arc<dyn Field>>),
}

impl Technique {
    /// `view` or `field`.
    pub fn kind_name(&self) -> &'static str {
        match self.kind {
            Kind::View(_) => "view",
            Kind::Field(_) => "field",
        }
    }
}

/// The macro-cells' part in a view (`kernels/cells.cl`).
#[derive(Debug, Clone, PartialEq)]
pub enum CellUse {
    /// The distance of each cell to the nearest one with a value in these intervals, a byte a cell: empty cells are skipped.
    Distances(Vec<[f64; 2]>),
    /// The least and greatest voxel that a sample in each cell can read, in the volume's own type.
    Ranges,
    /// Distances of 0: every sample is taken.
    None,
}

/// The plan of a view for one volume: data, made without a device.
#[derive(Debug, Clone)]
pub struct ViewPlan {
    /// The kernel variant.
    pub variant: Variant,
    /// The use of macro-cells.
    pub cells: CellUse,
    /// The step of the finest pass, world units.
    pub step: f32,
    /// True if the step plays no part in the picture.
    pub stepless: bool,
    /// Past this opacity a ray ends; what it leaves out is part of the error.
    pub opacity_threshold: f64,
    /// Why it is planned so, in words.
    pub reasons: Vec<String>,
}

/// The sampling scheme of a stochastic view: by tiles (`kernels/shared/tile.h`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Random {
    /// True if more samples are taken where the noise is.
    pub adaptive: bool,
    /// The luminance that brighter ones are scaled down to.
    pub clamp_luminance: Option<f64>,
}

impl Random {
    /// Samples per pixel before which the error of random samples is not believed: no render stops for it, and none is placed by it.
    pub const LEAST_SAMPLES: u32 = 16;
}

/// A view with valid parameters.
pub trait View: Send + Sync {
    /// A difference of values that plays no part in the picture; none where all do. Where words are finer, floats are taken as words.
    ///
    /// # Errors
    /// As [`View::plan`].
    fn resolution(&self, _volume: &Volume) -> Result<Option<f64>> {
        Ok(None)
    }
    /// The plan for `volume`.
    ///
    /// # Errors
    /// `Error::Invalid` where parameters and volume do not go together.
    fn plan(&self, volume: &Volume) -> Result<ViewPlan>;
    /// The kernel's own parameters for a camera, as the bytes of its device struct.
    ///
    /// # Errors
    /// As [`View::plan`].
    fn parameters(&self, volume: &Volume, camera: &Camera) -> Result<Vec<u8>>;
    /// The kernel's read-only table for a step, such as a transfer function's opacities.
    ///
    /// # Errors
    /// As [`View::plan`].
    fn table(&self, _volume: &Volume, _step: f32) -> Result<Vec<u32>> {
        Ok(Vec::new())
    }
    /// Sets fields that all views share, such as its lights.
    fn look(&self, _camera: &Camera, _view: &mut DeviceView) {}
    /// True if clipping planes cut it.
    fn clips(&self) -> bool {
        true
    }
    /// The greatest change of opacity per unit of length with the value, where a transfer function gives it.
    fn steepest_slope(&self, _volume: &Volume) -> Option<f64> {
        None
    }
    /// True if values are labels, of which there is no mean.
    fn shows_labels(&self) -> bool {
        false
    }
    /// The sampling scheme of a stochastic view; `None` for a deterministic one.
    fn random(&self) -> Option<Random> {
        None
    }
    /// Warnings about the parameters on this volume: objects with `code` and `message`.
    fn warnings(&self, _volume: &Volume) -> Vec<Value> {
        Vec::new()
    }
}

/// The plan of a field: data, made without a device.
pub struct FieldPlan {
    /// The kernel variant.
    pub variant: Variant,
    /// The kernel's own parameters, as the bytes of its device struct; the run writes the range into a `FieldPass` beside it.
    pub parameters: Vec<u8>,
    /// Read-only data, such as the extinction of every voxel.
    pub table: Vec<f32>,
    /// Cells of the grid of 64-bit sums.
    pub cells: usize,
    /// 64-bit sums beside the grid, such as the energy ledger.
    pub ledger: usize,
    /// The number of histories (photons).
    pub histories: u64,
    /// Why it is planned so, in words.
    pub reasons: Vec<String>,
}

/// The result of a field: a volume to look at, and the `result` of the reply.
pub struct FieldResult {
    /// The grid, normalised per history.
    pub volume: Volume,
    /// The ledger and what else was measured.
    pub result: Value,
}

/// A field with valid parameters.
pub trait Field: Send + Sync {
    /// The framing of its grid.
    fn framing(&self) -> Framing;
    /// The plan.
    ///
    /// # Errors
    /// `Error::Internal` when its input cannot be made.
    fn plan(&self) -> Result<FieldPlan>;
    /// Keys its random numbers.
    fn seed(&self) -> u64;
    /// The volume and the result after `histories` of them, from the grid's sums and the ledger of every batch (batches are equal).
    ///
    /// # Errors
    /// `Error::Internal` when the volume cannot be made.
    fn finish(&self, grid: &[u64], ledgers: &[Vec<u64>], histories: u64) -> Result<FieldResult>;
}

/// The technique of a name.
pub fn find(name: &str) -> Option<&'static Technique> {
    ALL.iter().find(|t| t.name == name)
}

/// The views, in the list's order.
pub fn views() -> impl Iterator<Item = &'static Technique> {
    ALL.iter().filter(|t| matches!(t.kind, Kind::View(_)))
}

/// The fields, in the list's order.
pub fn fields() -> impl Iterator<Item = &'static Technique> {
    ALL.iter().filter(|t| matches!(t.kind, Kind::Field(_)))
}
