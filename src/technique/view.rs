//! Views: techniques that turn a camera into an image of a volume.

use std::sync::Arc;

use serde_json::{Map, Value};

use super::Subject;
use super::optics::Optics;
use crate::device::program::Variant;
use crate::device::structs::View as DeviceView;
use crate::error::Result;
use crate::scene::bounds::Bounds;
use crate::scene::camera::Camera;
use crate::volume::Volume;

/// Pixels along a side of a tile, by which stochastic views are sampled (`kernels/shared/tile.h`).
pub(crate) const TILE: usize = 16;
/// Words before the list of tiles.
pub(crate) const TILES_HEADER: usize = 3;

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
    /// Words of a lane, for each packet of a work-item, that a launch leaves to the next (`kernels/shared/resume.h`); 0 where no launch can take
    /// long.
    pub state_words: usize,
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
    /// The view of a subject: all that does not depend on the camera is worked out, once. It may take a while, as where floats are taken as
    /// words.
    ///
    /// # Errors
    /// `Error::Invalid` where parameters and subject do not go together.
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>>;
    /// The box of what the view shows by its own parameters, where it does: it may look at that alone. A view without one looks at a volume.
    fn bounds(&self) -> Option<Bounds> {
        None
    }
    /// True if clipping planes cut it.
    fn clips(&self) -> bool {
        true
    }
    /// True if values are labels, of which there is no mean.
    fn shows_labels(&self) -> bool {
        false
    }
    /// The sampling scheme of a stochastic view; `None` for a deterministic one.
    fn random(&self) -> Option<Random> {
        None
    }
}

/// A view of a subject.
pub trait PreparedView: Send + Sync {
    /// Its plan.
    fn plan(&self) -> &ViewPlan;
    /// The volume that its kernel reads: the subject's, or that in words. None where it looks at none.
    fn volume(&self) -> Option<&Arc<Volume>>;
    /// The kernel's own parameters for a camera, as the bytes of its device struct.
    fn parameters(&self, camera: &Camera) -> Vec<u8>;
    /// The kernel's read-only table for a step, such as a transfer function's opacities.
    fn table(&self, _step: f32) -> Vec<u32> {
        Vec::new()
    }
    /// Sets fields that all views share, such as its lights.
    fn set_shared(&self, _camera: &Camera, _view: &mut DeviceView) {}
    /// The settings that the planner may choose in its place; `None` where there is nothing to choose.
    fn settings(&self, _open: &Open<'_>) -> Option<Settings> {
        None
    }
    /// The optics of the scene, where it scatters light.
    fn optics(&self) -> Option<Optics> {
        None
    }
    /// The greatest change of opacity per unit of length with the value, where a transfer function gives it.
    fn steepest_slope(&self) -> Option<f64> {
        None
    }
    /// Warnings about the parameters on this subject: objects with `code` and `message`.
    fn warnings(&self) -> Vec<Value> {
        Vec::new()
    }
}

/// The volume in words of 16 bits where it has floats and a difference of `resolution` between values plays no part in the picture, with what
/// that does to values, in words; else the volume as it is.
pub(super) fn in_words(volume: &Arc<Volume>, resolution: Option<f64>) -> (Arc<Volume>, Option<String>) {
    match resolution.and_then(|resolution| volume.words(resolution)) {
        Some(words) => {
            let half = 0.5 * words.word_step();
            (words, Some(format!("floats are taken as words of 16 bits: values are off by {half:.1e} at most")))
        }
        None => (volume.clone(), None),
    }
}

/// What a request leaves open.
pub struct Open<'a> {
    /// The view's own parameters as the request has them.
    pub given: &'a Map<String, Value>,
    /// True if the request leaves the technique to the planner.
    pub auto: bool,
    /// Coarser levels of the volume that may stand for it.
    pub levels: Vec<usize>,
    /// The error asked for, relative.
    pub error: f64,
}

impl Open<'_> {
    /// True if the request does not give a parameter.
    pub fn leaves(&self, field: &str) -> bool {
        !self.given.contains_key(field)
    }
}

/// One way to make a scene's picture.
#[derive(Clone)]
pub struct Setting {
    /// The technique.
    pub technique: &'static str,
    /// The view with its parameters; none for that of the scene as it is.
    pub view: Option<Arc<dyn View>>,
    /// The parameters that are not as the request has them, as a request has them.
    pub changes: Vec<(&'static str, Value)>,
    /// The lights that are left out, by their places in the request.
    pub without_lights: Vec<usize>,
    /// The level of the volume, where that is not its own.
    pub level: Option<usize>,
    /// What it is, in words.
    pub words: String,
    /// True if more samples take all of its error away.
    pub unbiased: bool,
    /// The words of those that leave out less: where one of them leaves out too much, so does this.
    pub less: Vec<String>,
}

impl Setting {
    /// The view of the scene as it is, which stands for the truth.
    pub fn as_given(technique: &'static str, words: String) -> Self {
        let (changes, without_lights, less) = (Vec::new(), Vec::new(), Vec::new());
        Self { technique, view: None, changes, without_lights, level: None, words, unbiased: true, less }
    }
}

/// The settings of a scene: the first is the reference, which stands for the truth of the others.
#[derive(Default)]
pub struct Settings {
    /// Those that could do.
    pub all: Vec<Setting>,
    /// Those that a bound on what they leave out rules out, each with that bound, relative, and why.
    pub ruled_out: Vec<(Setting, f64, String)>,
}
