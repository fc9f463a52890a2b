//! A turn of the view: a slice, and after a pass a frame, a shorter step, or the end.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::json;

use super::context::DeviceContext;
use super::gathered::Pass;
use super::live::{Live, Shown, Stage, Turn};
use super::stopping::{Next, next};
use super::view_run::ViewRun;
use crate::error::Result;
use crate::job::Snapshot;

/// The slice of a view: long enough to be worth a launch, short enough that nobody waits and a cancel is felt at once.
const SLICE: Duration = Duration::from_millis(20);
/// The slice while the camera moves and its picture is there. The next camera then does not wait for the rest of the picture.
const MOVING_SLICE: Duration = Duration::from_millis(2);
/// The time without a new camera after which the camera is at rest.
const AT_REST: Duration = Duration::from_millis(100);
/// The time between frames. The eye does not see faster ones, and encoding takes cores that the device needs.
const FRAME_EVERY: Duration = Duration::from_millis(30);
/// The time between frames if nobody looks. They serve those who ask for the progress.
const UNSEEN_EVERY: Duration = Duration::from_millis(500);

impl Live {
    /// Takes a slice of the view.
    pub(super) fn view_turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        if self.shown == Shown::Waits && self.job.take_encoder() {
            self.leave_snapshot(context, None)?;
            // The next camera may have come.
            return Ok(Turn::Again);
        }
        let slice = if self.is_moving() { MOVING_SLICE } else { SLICE };
        let is_followed = self.job.is_followed();
        let Some(view) = &mut self.view else { return Ok(Turn::Over) };
        view.is_followed = is_followed || matches!(self.stage, Stage::Looks);
        match view.slice(context, slice)? {
            None => Ok(Turn::Again),
            Some(Pass::Moving) => {
                // The picture is not left out while the frame before is still being encoded: the next camera is not followed before this one is
                // seen.
                self.shown = Shown::Waits;
                Ok(Turn::Again)
            }
            Some(Pass::Preview) => self.frame_if_due(context, Pass::Preview),
            // The picture's error is about to be known.
            Some(_) if view.owes_probe() => Ok(Turn::Again),
            Some(_) if matches!(self.stage, Stage::Looks) => self.after_look(context),
            Some(_) => self.after_pass(context),
        }
    }

    /// True while a camera moves and its picture is there.
    fn is_moving(&self) -> bool {
        let camera = self.camera.as_ref().filter(|camera| camera.generation > 0);
        camera.is_some_and(|camera| camera.asked.elapsed() < AT_REST) && self.shown != Shown::Nothing
    }

    /// Makes one picture of a field that is still filling; then the field goes on.
    fn after_look(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        self.compare_with_half(context)?;
        self.leave_snapshot(context, None)?;
        self.stage = Stage::Fills;
        Ok(Turn::Again)
    }

    fn after_pass(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let Some(view) = &mut self.view else { return Ok(Turn::Over) };
        if view.samples() == 1 {
            self.compare_with_half(context)?;
            self.learn_losses(context)?;
        }
        let Some(view) = &mut self.view else { return Ok(Turn::Over) };
        match next(view, self.started, context)? {
            Next::GoOn => self.frame_if_due(context, Pass::Main),
            Next::Refine => view.halve_step(context).map(|()| Turn::Again),
            Next::Stop(reason) => {
                if reason == "floor" {
                    let message = "max_error is below what this technique reaches here, however many samples; the error parts say why";
                    self.job.warn(json!({"code": "error_floor", "message": message}));
                }
                self.leave_snapshot(context, Some(reason))?;
                let generation = self.camera.as_ref().map_or(0, |camera| camera.generation);
                Ok(if self.job.leave(generation) { Turn::Over } else { Turn::Again })
            }
        }
    }

    /// Learns the losses of a lower resolution and of a longer step, for the time when the camera moves.
    fn learn_losses(&mut self, context: &DeviceContext) -> Result<()> {
        if let (Some(view), true) = (&mut self.view, self.job.is_followed()) {
            let film = view.gathered.encode(context)?;
            self.motion.see(&film, view.scene().camera());
        }
        Ok(())
    }

    /// Leaves a frame if one is due and the encoder is free.
    fn frame_if_due(&mut self, context: &DeviceContext, pass: Pass) -> Result<Turn> {
        let followed = self.job.is_followed();
        let every = if followed { FRAME_EVERY } else { UNSEEN_EVERY };
        let last = self.shown.at();
        let due = last.unwrap_or(self.started).elapsed() >= every || (followed && last.is_none());
        let preview = |v: &ViewRun| followed && v.samples() == 0 && !v.is_quick() && !v.has_hurried();
        let proper = pass == Pass::Main || self.view.as_ref().is_some_and(preview);
        if due && proper && self.job.take_encoder() {
            self.leave_snapshot(context, None)?;
        }
        Ok(Turn::Again)
    }

    /// Compares the picture of a field with that of half as much work. Two pictures of one random sample differ by their own noise, whatever the
    /// field's noise is, and are not compared.
    fn compare_with_half(&mut self, context: &DeviceContext) -> Result<()> {
        match (&mut self.field, &mut self.view) {
            (Some(field), Some(view)) if !field.is_random() => {
                field.settle();
                (self.motion.field_error, view.gathered.field_error) = (field.error, field.error);
            }
            (Some(field), Some(view)) if !view.is_random() => {
                field.compare_with_half(view.gathered.film(context)?, view.plan().extremum);
                (self.motion.field_error, view.gathered.field_error) = (field.error, field.error);
            }
            _ => {}
        }
        Ok(())
    }

    fn leave_snapshot(&mut self, context: &DeviceContext, stopped_by: Option<&'static str>) -> Result<()> {
        let (Some(view), Some(camera)) = (&mut self.view, &self.camera) else { return Ok(()) };
        let field = self.field.as_ref();
        let film = view.gathered.encode(context)?;
        let device_time = self.earlier_time + view.device_time + field.map_or(Duration::ZERO, |f| f.device_time);
        self.job.leave_snapshot(Snapshot {
            film: Arc::new(film),
            picture: view.gathered.picture(context)?,
            generation: camera.generation,
            is_first: self.shown.at().is_none(),
            made: Instant::now(),
            elapsed_ms: camera.asked.elapsed().as_secs_f64() * 1e3,
            device_ms: device_time.as_secs_f64() * 1e3,
            counts: view.gathered.counted,
            result: field.and_then(|f| f.result.clone()),
            stopped_by,
        });
        self.shown = Shown::At(Instant::now());
        Ok(())
    }
}
