//! A job on the device thread: what it does with a turn, and what all jobs there share.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::motion::Motion;
use super::report::warnings;
use super::verdict::{Verdict, verdict};
use super::view_run::{Pass, ViewRun};
use super::{Job, Snapshot};
use crate::device::cells;
use crate::device::program::Variant;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film::picture::Background;
use crate::scene::{Scene, Subject};
use crate::technique::{FieldPlan, ViewPlan};
use crate::volume::Volume;

/// A turn on the device: long enough to be worth a launch, short enough that nobody waits and a cancel is felt at once.
const SLICE: Duration = Duration::from_millis(20);
/// A turn of a field: its packets end at very different times, and a longer slice wastes fewer lanes on the last of them.
const FIELD_SLICE: Duration = Duration::from_millis(40);
/// Frames are not made faster than the eye sees: encoding takes cores that the device wants.
const FRAME_EVERY: Duration = Duration::from_millis(30);

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
enum Awaited {
    Field(FieldPlan),
    View(Arc<Volume>, ViewPlan),
}

/// A job with its buffers.
pub(super) struct Live {
    job: Arc<Job>,
    awaited: Option<Awaited>,
    generation: u64,
    asked: Instant,
    started: Instant,
    scene: Option<Scene>,
    volume: Option<Arc<Volume>>,
    field: Option<FieldRun>,
    /// The field's volume has to be looked at before more is computed.
    look: bool,
    result: Option<Value>,
    view: Option<ViewRun>,
    /// What the device took for pictures of the field while it had fewer histories.
    earlier_time: Duration,
    /// The picture when the field had half its histories.
    half: Option<Film>,
    field_error: Option<f64>,
    motion: Motion,
    /// A picture of a moving camera is there, and the one before is still being developed.
    unseen: bool,
    last_frame: Option<Instant>,
}

impl Live {
    pub fn new(job: Arc<Job>) -> Self {
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
            earlier_time: Duration::ZERO,
            half: None,
            field_error: None,
            motion: Motion::new(),
            unseen: false,
            last_frame: None,
        }
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

    /// The first turn, and after that a newer camera where there is one.
    fn follow_camera(&mut self, context: &mut DeviceContext) -> Result<()> {
        let first = self.scene.is_none();
        {
            let progress = self.job.lock();
            // A camera is followed once the one before has been seen: cameras may come faster than frames, and none would be.
            if !first && (progress.generation == self.generation || self.last_frame.is_none()) {
                return Ok(());
            }
            (self.generation, self.asked) = (progress.generation, progress.asked);
            self.scene = Some(progress.scene.clone());
        }
        self.started = Instant::now();
        self.last_frame = None;
        self.unseen = false;
        self.half = None;
        self.earlier_time = Duration::ZERO;
        self.learn_motion();
        let complete = self.job.lock().complete_field.clone();
        self.aim(context, complete)?;
        match (&mut self.view, &self.scene, &self.volume) {
            (Some(view), Some(scene), Some(volume)) if self.generation > 0 => {
                view.hurry(context, scene, volume, &mut self.motion)
            }
            _ => Ok(()),
        }
    }

    /// From the newest picture, and how long the first of the camera before took.
    fn learn_motion(&mut self) {
        let (seen, took) = {
            let mut progress = self.job.lock();
            (progress.film.clone().zip(progress.error), progress.first_frame_before.take())
        };
        self.motion.learn(seen, took);
    }

    /// Points the view at the newest camera, or begins it.
    fn aim(&mut self, context: &mut DeviceContext, complete: Option<Arc<Volume>>) -> Result<()> {
        let Some(scene) = &self.scene else { return Ok(()) };
        match (scene.subject(), &self.volume, &mut self.view) {
            (_, Some(volume), Some(view)) => {
                // A field that is still filling is looked at from the new camera at once.
                self.look = self.field.as_ref().is_some_and(|f| !f.is_done());
                self.job.started();
                view.restart(context, scene, volume)
            }
            // A field that was computed for an earlier camera is looked at again, not computed again.
            (Subject::Field(_), _, _) if complete.is_some() => match complete {
                Some(volume) => self.begin_view(context, volume),
                None => Ok(()),
            },
            (Subject::Volume(volume), _, _) => self.begin_view(context, volume.clone()),
            (Subject::Field(_), _, _) => self.begin_field(context),
        }
    }

    /// Whether kernels are ready; one that is not is waited for.
    fn is_ready(&self, context: &mut DeviceContext, variants: &[Variant]) -> Result<bool> {
        let mut all = true;
        for variant in variants {
            if !context.is_ready(variant)? {
                self.job.waits_for(variant);
                all = false;
            }
        }
        if all {
            self.job.started();
        }
        Ok(all)
    }

    fn begin_field(&mut self, context: &mut DeviceContext) -> Result<()> {
        let Some(Subject::Field(field)) = self.scene.as_ref().map(Scene::subject) else { return Ok(()) };
        let plan = field.plan()?;
        self.run_field(context, plan)
    }

    fn run_field(&mut self, context: &mut DeviceContext, plan: FieldPlan) -> Result<()> {
        if !self.is_ready(context, &[plan.variant])? {
            self.awaited = Some(Awaited::Field(plan));
            return Ok(());
        }
        let Some(Subject::Field(field)) = self.scene.as_ref().map(Scene::subject) else { return Ok(()) };
        // A budget of time is for the work, not for compiling.
        self.started = Instant::now();
        let run = FieldRun::new(context, field, plan)?;
        self.job.lock().reasons = run.reasons().to_vec();
        self.field = Some(run);
        Ok(())
    }

    fn begin_view(&mut self, context: &mut DeviceContext, volume: Arc<Volume>) -> Result<()> {
        let Some(scene) = &self.scene else { return Ok(()) };
        let plan = scene.view().plan(&volume)?;
        self.run_view(context, volume, plan)
    }

    fn run_view(&mut self, context: &mut DeviceContext, volume: Arc<Volume>, plan: ViewPlan) -> Result<()> {
        let [of_cells, of_distances] = cells::needed(volume.voxel_type());
        if !self.is_ready(context, &[plan.variant, of_cells, of_distances])? {
            self.awaited = Some(Awaited::View(volume, plan));
            return Ok(());
        }
        let Some(scene) = &self.scene else { return Ok(()) };
        if self.field.is_none() {
            self.started = Instant::now();
        }
        let view = ViewRun::new(context, scene, &volume, plan)?;
        {
            let mut progress = self.job.lock();
            progress.reasons = self.field.as_ref().map_or(Vec::new(), |f| f.reasons().to_vec());
            progress.reasons.extend_from_slice(&view.plan().reasons);
            progress.counts.non_finite_voxels = volume.non_finite();
            progress.warnings = warnings(&volume, scene);
            let simulated = self.result.as_ref().and_then(|r| r["warnings"].as_array());
            progress.warnings.extend(simulated.into_iter().flatten().cloned());
            if self.field.is_some() {
                progress.field = Some(volume.clone());
            }
            if self.field.as_ref().is_some_and(FieldRun::is_done) {
                progress.complete_field = Some(volume.clone());
            }
        }
        self.volume = Some(volume);
        self.earlier_time += self.view.replace(view).map_or(Duration::ZERO, |earlier| earlier.device_time);
        Ok(())
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
        }
        let Some(view) = &mut self.view else { return Ok(Turn::Over) };
        let Some(pass) = view.slice(context, SLICE)? else { return Ok(Turn::Again) };
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
                let due = self.last_frame.is_none_or(|t| t.elapsed() >= FRAME_EVERY);
                let preview = |v: &ViewRun| v.samples() == 0 && !v.is_quick() && !v.has_hurried();
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
        let Some(view) = &self.view else { return Ok(()) };
        if self.scene.as_ref().is_some_and(|s| s.view().random().is_some()) {
            // Two pictures of one random sample differ by their own noise, whatever the field's.
            return Ok(());
        }
        let film = view.film(context)?;
        // From a new camera there is no picture of the half yet: the error seen from the last one stands in for it.
        if let Some(half) = &self.half {
            self.field_error = film.difference(half);
        }
        self.half = Some(film);
        Ok(())
    }

    fn verdict(&self, context: &DeviceContext, pass: Pass) -> Result<Verdict> {
        match (&self.view, &self.scene) {
            (Some(view), Some(scene)) if pass == Pass::Main => {
                let film = || Ok(Film { field_error: self.field_error, ..view.film(context)? });
                verdict(view, scene, self.started, film)
            }
            _ => Ok(Verdict::GoOn),
        }
    }

    fn snapshot(&mut self, context: &DeviceContext, stopped_by: Option<&'static str>) -> Result<()> {
        let Some(view) = &self.view else { return Ok(()) };
        let background = self.scene.as_ref().map_or(Background::default(), Scene::background);
        let film = Film { field_error: self.field_error, background, ..view.film(context)? };
        let device_time =
            self.earlier_time + view.device_time + self.field.as_ref().map_or(Duration::ZERO, |f| f.device_time);
        let snapshot = Snapshot {
            film: Arc::new(film),
            generation: self.generation,
            elapsed_ms: self.asked.elapsed().as_secs_f64() * 1e3,
            device_ms: device_time.as_secs_f64() * 1e3,
            counts: view.counts(context)?,
            result: self.result.clone(),
            stopped_by,
        };
        self.unseen = false;
        self.last_frame = Some(Instant::now());
        self.job.snapshots.send_replace(Some(Arc::new(snapshot)));
        Ok(())
    }
}
