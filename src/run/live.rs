//! A job on the device thread: its stage, and its turns.

use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::gathered::Gathered;
use super::motion::Motion;
use super::view_run::ViewRun;
use crate::error::Result;
use crate::film::Film;
use crate::job::{Job, NewestCamera};
use crate::technique::PreparedView;

/// The slice of a field. Its packets end at very different times, and a longer slice wastes fewer lanes on the last of them.
pub(super) const FIELD_SLICE: Duration = Duration::from_millis(40);

/// The outcome of a turn.
pub(super) enum Turn {
    /// There is more to do.
    Again,
    /// Nothing can be done before a kernel is compiled.
    Waits,
    /// The device has finished the job.
    Over,
}

/// The stage of a job, which decides its next turn.
pub(super) enum Stage {
    /// Nothing has begun.
    New,
    /// The field begins once its kernels are compiled.
    AwaitsField,
    /// The field fills.
    Fills,
    /// The view begins once its kernels are compiled.
    AwaitsView(Arc<dyn PreparedView>),
    /// The view makes one picture of an incomplete field. Then the field goes on.
    Looks,
    /// The view refines the picture until its budget is used up.
    Refines,
}

/// The progress of the newest camera's frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shown {
    /// There is no frame.
    Nothing,
    /// The picture of a moving camera is there. It waits until the frame before is encoded.
    Waits,
    /// The newest frame was handed on at this time.
    At(Instant),
}

impl Shown {
    /// The time at which the newest frame was handed on.
    pub fn at(self) -> Option<Instant> {
        if let Self::At(when) = self { Some(when) } else { None }
    }
}

/// The samples of a job that has ended.
pub(super) struct Rested {
    pub job: Weak<Job>,
    pub gathered: Gathered,
    pub motion: Motion,
}

impl Rested {
    pub fn is_of(&self, job: &Arc<Job>) -> bool {
        std::ptr::eq(self.job.as_ptr(), &**job)
    }
}

/// A job with its buffers.
pub(super) struct Live {
    pub(super) job: Arc<Job>,
    pub(super) stage: Stage,
    /// The camera that is worked on; `None` before the first turn.
    pub(super) camera: Option<NewestCamera>,
    pub(super) started: Instant,
    pub(super) field: Option<FieldRun>,
    pub(super) view: Option<ViewRun>,
    /// Samples that were gathered earlier, here or for another job: their memory is for the next ones.
    pub(super) memory: Option<Gathered>,
    /// The device time of pictures of the field while it was less complete.
    pub(super) earlier_time: Duration,
    pub(super) motion: Motion,
    pub(super) shown: Shown,
}

impl Live {
    /// A job with memory for its samples: its own of an earlier camera, or another job's.
    pub fn new(job: Arc<Job>, rested: Option<Rested>) -> Self {
        let own = rested.as_ref().is_some_and(|r| r.is_of(&job));
        let (memory, motion) = rested.map(|r| (r.gathered, r.motion)).unzip();
        Self {
            job,
            stage: Stage::New,
            camera: None,
            started: Instant::now(),
            field: None,
            view: None,
            memory,
            earlier_time: Duration::ZERO,
            motion: motion.filter(|_| own).unwrap_or_else(Motion::new),
            shown: Shown::Nothing,
        }
    }

    pub fn job(&self) -> &Arc<Job> {
        &self.job
    }

    /// The film so far, with its pixels; `None` if there is nothing yet, or while a pass is under way.
    pub fn film(&mut self, context: &DeviceContext) -> Result<Option<Film>> {
        // A picture whose error is about to be known waits for it.
        let between = self.view.as_mut().filter(|v| v.is_between_passes() && !v.owes_probe());
        let gathered = between.map(|v| &mut v.gathered).filter(|g| g.is_something());
        gathered.map(|g| g.film(context)).transpose()
    }

    /// Ends with the samples so far, which stay on the device. If a render was cancelled within a pass, some pixels have one sample more than it
    /// says, so that their error is a little less than it says.
    pub fn rest(self) -> Option<Rested> {
        let gathered = self.view?.gathered;
        let job = Arc::downgrade(&self.job);
        gathered.is_something().then_some(Rested { job, gathered, motion: self.motion })
    }

    /// One turn: a slice of the field or of the view.
    pub fn turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        if self.job.is_cancelled() || self.job.state().is_terminal() {
            return Ok(Turn::Over);
        }
        match std::mem::replace(&mut self.stage, Stage::New) {
            Stage::AwaitsField => self.begin_field(context)?,
            Stage::AwaitsView(prepared) => self.run_view(context, prepared)?,
            stage => {
                self.stage = stage;
                self.follow_camera(context)?;
            }
        }
        match self.stage {
            Stage::New => Ok(Turn::Over),
            Stage::AwaitsField | Stage::AwaitsView(..) => Ok(Turn::Waits),
            Stage::Fills => self.field_turn(context),
            Stage::Looks | Stage::Refines => self.view_turn(context),
        }
    }

    fn field_turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let (Some(field), Some(camera)) = (&mut self.field, &self.camera) else { return Ok(Turn::Over) };
        let step = field.step(context, FIELD_SLICE)?;
        let time = camera.scene.budget().time_ms;
        let is_late = time.is_some_and(|ms| self.started.elapsed().as_millis() >= u128::from(ms)) && step.is_whole;
        if is_late {
            field.stop(context)?;
        }
        if step.is_look_due || field.is_over() {
            let volume = field.look(context)?;
            self.job.set_field(&volume, field.is_over(), 1e3 * field.device_time.as_secs_f64());
            self.begin_view(context, Some(&volume))?;
        }
        Ok(Turn::Again)
    }
}
