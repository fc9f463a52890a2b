//! A job on the device thread: what it does with a turn, and what all jobs there share.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::gathered::Gathered;
use super::motion::Motion;
use super::verdict::{Verdict, verdict};
use super::view_run::{Pass, ViewRun};
use super::{Job, Snapshot};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::Scene;
use crate::technique::{FieldPlan, ViewPlan};
use crate::volume::Volume;

/// A turn on the device: long enough to be worth a launch, short enough that nobody waits and a cancel is felt at once.
const SLICE: Duration = Duration::from_millis(20);
/// A turn while the camera moves and its picture is there: the next camera does not wait for the rest of it,
const MOVING_SLICE: Duration = Duration::from_millis(2);
/// until none has come for so long.
const AT_REST: Duration = Duration::from_millis(100);
/// A turn of a field: its packets end at very different times, and a longer slice wastes fewer lanes on the last of them.
const FIELD_SLICE: Duration = Duration::from_millis(40);
/// Frames are not made faster than the eye sees: encoding takes cores that the device wants.
const FRAME_EVERY: Duration = Duration::from_millis(30);
/// The same where nobody looks: for who asks how far it is.
const UNSEEN_EVERY: Duration = Duration::from_millis(500);

/// What a turn came to.
pub(super) enum Turn {
    /// More to do.
    Again,
    /// Nothing before a kernel is compiled.
    Waits,
    /// The device is through with the job.
    Over,
}

/// What cannot begin before its kernel is compiled: planned once, since a field's plan may take long.
pub(super) enum Awaited {
    Field(FieldPlan),
    View(Arc<Volume>, ViewPlan),
}

/// What is left of a job that has ended.
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
    pub(super) awaited: Option<Awaited>,
    pub(super) generation: u64,
    pub(super) asked: Instant,
    pub(super) started: Instant,
    pub(super) scene: Option<Scene>,
    pub(super) volume: Option<Arc<Volume>>,
    pub(super) field: Option<FieldRun>,
    /// The field's volume has to be looked at before more is computed.
    pub(super) look: bool,
    pub(super) result: Option<Value>,
    pub(super) view: Option<ViewRun>,
    /// What was gathered earlier, here or for another job: memory for what comes.
    pub(super) memory: Option<Gathered>,
    /// What the device took for pictures of the field while it had fewer histories.
    pub(super) earlier_time: Duration,
    /// The picture when the field had half its histories.
    pub(super) half: Option<Film>,
    pub(super) field_error: Option<f64>,
    pub(super) motion: Motion,
    /// A picture of a moving camera is there, and the one before is still being developed.
    pub(super) unseen: bool,
    pub(super) last_frame: Option<Instant>,
}

impl Live {
    /// A job, with memory for what it gathers: its own of an earlier camera, or another's.
    pub fn new(job: Arc<Job>, rested: Option<Rested>) -> Self {
        let own = rested.as_ref().is_some_and(|r| r.is_of(&job));
        let (memory, motion) = rested.map(|r| (r.gathered, r.motion)).unzip();
        let now = Instant::now();
        Self {
            job,
            awaited: None,
            generation: 0,
            asked: now,
            started: now,
            scene: None,
            volume: None,
            field: None,
            look: false,
            result: None,
            view: None,
            memory,
            earlier_time: Duration::ZERO,
            half: None,
            field_error: None,
            motion: motion.filter(|_| own).unwrap_or_else(Motion::new),
            unseen: false,
            last_frame: None,
        }
    }

    pub fn is_of(&self, job: &Arc<Job>) -> bool {
        Arc::ptr_eq(&self.job, job)
    }

    /// What there is to see, with its pixels; none where there is nothing yet, or a pass is under way.
    pub fn film(&mut self, context: &DeviceContext) -> Result<Option<Film>> {
        let between = self.view.as_mut().filter(|v| v.is_between_passes());
        let gathered = between.map(|v| &mut v.gathered).filter(|g| g.is_something());
        gathered.map(|g| g.film(context)).transpose()
    }

    /// Ends with what was gathered, which stays on the device. Of a render that was cancelled within a pass some pixels have a sample more than
    /// it says, so that their error is a little less than it says.
    pub fn rest(self) -> Option<Rested> {
        let gathered = self.view?.gathered;
        let job = Arc::downgrade(&self.job);
        gathered.is_something().then_some(Rested { job, gathered, motion: self.motion })
    }

    pub fn fail(&self, error: Error) {
        self.job.fail(&error);
    }

    /// One turn: a slice of the field or of the view.
    pub fn turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        if self.job.is_cancelled() || self.job.state().is_terminal() {
            return Ok(Turn::Over);
        }
        match self.awaited.take() {
            None => self.follow_camera(context)?,
            Some(Awaited::Field(plan)) => self.run_field(context, plan)?,
            Some(Awaited::View(volume, plan)) => self.run_view(context, volume, plan)?,
        }
        if self.awaited.is_some() {
            return Ok(Turn::Waits);
        }
        if !self.look && self.field.as_ref().is_some_and(|f| !f.is_done()) {
            return self.field_turn(context);
        }
        self.view_turn(context)
    }

    fn field_turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let Some(field) = &mut self.field else { return Ok(Turn::Over) };
        let finished = field.slice(context, FIELD_SLICE)?;
        let time = self.scene.as_ref().and_then(|s| s.budget().time_ms);
        let over = time.is_some_and(|ms| self.started.elapsed().as_millis() >= u128::from(ms));
        if over {
            field.cut(context)?;
        }
        if finished || over {
            let (volume, result) = field.finish(context)?;
            self.result = Some(result);
            self.look = true;
            self.begin_view(context, volume)?;
        }
        Ok(Turn::Again)
    }

    fn view_turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        if self.unseen && !self.job.developing.swap(true, Ordering::AcqRel) {
            self.snapshot(context, None)?;
            // The next camera may have come.
            return Ok(Turn::Again);
        }
        let moves = self.generation > 0 && self.asked.elapsed() < AT_REST && (self.unseen || self.last_frame.is_some());
        let Some(view) = &mut self.view else { return Ok(Turn::Over) };
        let slice = if moves { MOVING_SLICE } else { SLICE };
        let Some(pass) = view.slice(context, slice)? else { return Ok(Turn::Again) };
        if pass == Pass::Moving {
            // Not left out because the frame before is still being encoded: the next camera is not followed before this is seen.
            self.unseen = true;
            return Ok(Turn::Again);
        }
        let unfinished_field = self.field.as_ref().is_some_and(|f| !f.is_done());
        if unfinished_field {
            if pass == Pass::Main {
                self.look_at_field(context)?;
            }
            return Ok(Turn::Again);
        }
        if pass == Pass::Main && self.view.as_ref().is_some_and(|v| v.samples() == 1) && self.field.is_some() {
            self.compare_with_half(context)?;
        }
        if let (Pass::Main, Some(view), true) = (pass, &mut self.view, self.job.is_followed())
            && view.gathered.samples() == 1
        {
            self.motion.see(&view.gathered.develop(context)?);
        }
        match self.verdict(context, pass)? {
            Verdict::Refine => {
                if let (Some(view), Some(scene), Some(volume)) = (&mut self.view, &self.scene, &self.volume) {
                    view.halve_step(context, scene, volume)?;
                }
                Ok(Turn::Again)
            }
            Verdict::Stop(reason) => {
                if reason == "floor" {
                    let message = "max_error is below what this technique reaches here, however many samples; the error parts say why";
                    self.job.lock().warnings.push(json!({"code": "error_floor", "message": message}));
                }
                self.snapshot(context, Some(reason))?;
                Ok(if self.job.leave(self.generation) { Turn::Over } else { Turn::Again })
            }
            Verdict::GoOn => {
                let followed = self.job.is_followed();
                let every = if followed { FRAME_EVERY } else { UNSEEN_EVERY };
                let due = self.last_frame.unwrap_or(self.started).elapsed() >= every
                    || (followed && self.last_frame.is_none());
                let preview = |v: &ViewRun| followed && v.samples() == 0 && !v.is_quick() && !v.has_hurried();
                let proper = pass == Pass::Main || self.view.as_ref().is_some_and(preview);
                if due && proper && !self.job.developing.swap(true, Ordering::AcqRel) {
                    self.snapshot(context, None)?;
                }
                Ok(Turn::Again)
            }
        }
    }

    /// One picture of a field that is still filling; then the field goes on.
    fn look_at_field(&mut self, context: &mut DeviceContext) -> Result<()> {
        self.compare_with_half(context)?;
        self.job.developing.store(true, Ordering::Release);
        self.snapshot(context, None)?;
        self.look = false;
        Ok(())
    }

    /// The picture against the one of half as many histories: the difference of a mean to that of its first half has the
    /// variance of the mean itself, so it estimates the picture's standard error.
    fn compare_with_half(&mut self, context: &mut DeviceContext) -> Result<()> {
        let Some(view) = &mut self.view else { return Ok(()) };
        if self.scene.as_ref().is_some_and(|s| s.view().random().is_some()) {
            // Two pictures of one random sample differ by their own noise, whatever the field's.
            return Ok(());
        }
        let film = view.gathered.film(context)?;
        // From a new camera there is no picture of the half yet: the error seen from the last one stands in for it.
        if let Some(half) = &self.half {
            self.field_error = film.difference(half);
        }
        self.half = Some(film);
        Ok(())
    }

    fn verdict(&mut self, context: &DeviceContext, pass: Pass) -> Result<Verdict> {
        match (&mut self.view, &self.scene) {
            (Some(view), Some(scene)) if pass == Pass::Main => {
                view.gathered.field_error = self.field_error;
                verdict(view, scene, self.started, context)
            }
            _ => Ok(Verdict::GoOn),
        }
    }

    fn snapshot(&mut self, context: &DeviceContext, stopped_by: Option<&'static str>) -> Result<()> {
        let Some(view) = &mut self.view else { return Ok(()) };
        view.gathered.field_error = self.field_error;
        let film = view.gathered.develop(context)?;
        let device_time =
            self.earlier_time + view.device_time + self.field.as_ref().map_or(Duration::ZERO, |f| f.device_time);
        let snapshot = Snapshot {
            film: Arc::new(film),
            picture: view.gathered.picture(context)?,
            generation: self.generation,
            is_first: self.last_frame.is_none(),
            made: Instant::now(),
            elapsed_ms: self.asked.elapsed().as_secs_f64() * 1e3,
            device_ms: device_time.as_secs_f64() * 1e3,
            counts: view.gathered.counted,
            result: self.result.clone(),
            stopped_by,
        };
        self.unseen = false;
        self.last_frame = Some(Instant::now());
        self.job.snapshots.send_replace(Some(Arc::new(snapshot)));
        Ok(())
    }
}
