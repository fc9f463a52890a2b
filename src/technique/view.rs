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

/// Pixels along a side of a tile. Stochastic views are sampled by tiles (`kernels/shared/tile.h`).
pub(crate) const TILE: usize = 16;
/// Words before the list of tiles.
pub(crate) const TILES_HEADER: usize = 3;

/// The macro-cells' part in a view (`kernels/cells.cl`).
#[derive(Debug, Clone, PartialEq)]
pub enum CellUse {
    /// The distance of each cell to the nearest one with a value in these intervals, a byte per cell. Empty cells are skipped.
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
    /// Words of a lane, for each packet of a work-item, that a launch leaves to the next (`kernels/shared/resume.h`); 0 if no launch can take long.
    pub state_words: usize,
    /// True if the step has no effect on the picture.
    pub stepless: bool,
    /// True if a sample costs so little that most of the picture's pixels are sampled again to find its error.
    pub cheap: bool,
    /// True if the method has an error besides noise that is not measured.
    pub biased: bool,
    /// True if a pixel is the least or the greatest of many values, which noise in these shifts.
    pub extremum: bool,
    /// The opacity at which a ray ends. The light behind is part of the error.
    pub opacity_threshold: f64,
    /// The reasons for the plan, in words.
    pub reasons: Vec<String>,
}

/// The sampling scheme of a stochastic view: by tiles (`kernels/shared/tile.h`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Random {
    /// True if noisier parts get more samples.
    pub adaptive: bool,
    /// The luminance that brighter samples are scaled down to.
    pub clamp_luminance: Option<f64>,
}

impl Random {
    /// Samples per pixel below which no samples are placed by the deviations of their tiles.
    pub const LEAST_SAMPLES: u32 = 16;
    /// Samples of all pixels together below which the error of random samples is not relied on: no render of fewer stops by it, unless it has
    /// [`Self::LEAST_SAMPLES`]. A rare bright path that none of so many has found counts for less than their noise.
    pub const LEAST_PATHS: usize = 4096;
}

/// A view with valid parameters.
pub trait View: Send + Sync {
    /// The view of a subject. Everything that does not depend on the camera is computed once. This may take a while, for example to convert
    /// floats to words.
    ///
    /// # Errors
    /// `Error::Invalid` if parameters and subject do not go together.
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>>;
    /// The box of the objects in the view's own parameters, if any; such a view needs no volume. A view without a box looks at a volume.
    fn bounds(&self) -> Option<Bounds> {
        None
    }
    /// True if clipping planes cut it.
    fn clips(&self) -> bool {
        true
    }
    /// True if values are labels, which have no mean.
    fn shows_labels(&self, _volume: Option<&Volume>) -> bool {
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
    /// The volume that its kernel reads: the subject's, or the same in words. `None` if it reads none.
    fn volume(&self) -> Option<&Arc<Volume>>;
    /// The kernel's own parameters for a camera, as the bytes of its device struct.
    fn parameters(&self, camera: &Camera) -> Vec<u8>;
    /// The same parameters for rays that go to their end, if others may end so early that this is seen. The control's rays tell the loss.
    fn parameters_to_the_end(&self, _camera: &Camera) -> Option<Vec<u8>> {
        None
    }
    /// The kernel's read-only table for a step, such as a transfer function's opacities.
    fn table(&self, _step: f32) -> Vec<u32> {
        Vec::new()
    }
    /// Sets fields that all views share, such as its lights.
    fn set_shared(&self, _camera: &Camera, _view: &mut DeviceView) {}
    /// The settings that the planner may choose in its place; `None` if there is no choice.
    fn settings(&self, _open: &Open<'_>) -> Option<Settings> {
        None
    }
    /// The optics of the scene, if it scatters light.
    fn optics(&self) -> Option<Optics> {
        None
    }
    /// The greatest change of opacity per unit of length with the value, if a transfer function gives it.
    fn steepest_slope(&self) -> Option<f64> {
        None
    }
    /// Warnings about the parameters on this subject: objects with `code` and `message`.
    fn warnings(&self) -> Vec<Value> {
        Vec::new()
    }
}

/// The volume in words of 16 bits, with the effect on its values in words: if it has floats and a difference of `resolution` between values has no
/// effect on the picture. Otherwise the volume as it is.
pub(super) fn in_words(volume: &Arc<Volume>, resolution: Option<f64>) -> (Arc<Volume>, Option<String>) {
    match resolution.and_then(|resolution| volume.words(resolution)) {
        Some(words) => {
            let half = 0.5 * words.word_step();
            (words, Some(format!("floats are taken as words of 16 bits: values are off by {half:.1e} at most")))
        }
        None => (volume.clone(), None),
    }
}

/// The choices that a request leaves open.
pub struct Open<'a> {
    /// The view's own parameters as the request has them.
    pub given: &'a Map<String, Value>,
    /// True if the request leaves the technique to the planner.
    pub auto: bool,
    /// Coarser levels of the volume that may replace it.
    pub levels: Vec<usize>,
    /// The relative error that the request asks for.
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
    /// The view with its parameters; `None` for the scene's own.
    pub view: Option<Arc<dyn View>>,
    /// The parameters that differ from the request's, in the form of a request.
    pub changes: Vec<(&'static str, Value)>,
    /// The lights that are left out, by their places in the request.
    pub without_lights: Vec<usize>,
    /// The level of the volume, if it differs from the request's.
    pub level: Option<usize>,
    /// A description, in words.
    pub words: String,
    /// True if its error falls to 0 with more samples.
    pub unbiased: bool,
    /// Its step as a multiple of the reference's, if it differs from the reference in nothing else.
    pub longer: Option<f64>,
    /// The words of the settings that leave out less. If one of them leaves out too much, so does this one.
    pub less: Vec<String>,
}

impl Setting {
    /// The view of the scene as it is. It stands for the truth.
    pub fn as_given(technique: &'static str, words: String) -> Self {
        let (changes, without_lights, less) = (Vec::new(), Vec::new(), Vec::new());
        Self { technique, view: None, changes, without_lights, level: None, words, unbiased: true, longer: None, less }
    }
}

/// The settings of a scene. The first is the reference, which stands for the truth of the others.
#[derive(Default)]
pub struct Settings {
    /// The possible settings.
    pub all: Vec<Setting>,
    /// The settings that are ruled out by a bound on their error, each with that relative bound and the reason.
    pub ruled_out: Vec<(Setting, f64, String)>,
}
