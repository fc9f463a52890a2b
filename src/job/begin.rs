//! How a job begins on the device thread, and begins again with a newer camera: its field, then its view, once their kernels are there.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::live::{Awaited, Live};
use super::report::warnings;
use super::view_run::ViewRun;
use crate::device::cells;
use crate::device::program::Variant;
use crate::error::Result;
use crate::scene::{Scene, Subject};
use crate::technique::{FieldPlan, ViewPlan};
use crate::volume::Volume;

impl Live {
    /// The first turn, and after that a newer camera where there is one.
    pub(super) fn follow_camera(&mut self, context: &mut DeviceContext) -> Result<()> {
        let first = self.scene.is_none();
        {
            let mut progress = self.job.lock();
            // A camera is followed once the one before has been seen: cameras may come faster than frames, and none would be.
            if !first && (progress.generation == self.generation || self.last_frame.is_none()) {
                return Ok(());
            }
            (self.generation, self.asked) = (progress.generation, progress.asked);
            self.scene = Some(progress.scene.clone());
            progress.frame_ms.take().into_iter().for_each(|took| self.motion.learn(took));
        }
        self.started = Instant::now();
        self.last_frame = None;
        self.unseen = false;
        self.half = None;
        self.earlier_time = Duration::ZERO;
        let complete = self.job.lock().complete_field.clone();
        self.aim(context, complete)?;
        match (&mut self.view, &self.scene, &self.volume) {
            (Some(view), Some(scene), Some(volume)) if self.generation > 0 => {
                view.hurry(context, scene, volume, &mut self.motion)
            }
            _ => Ok(()),
        }
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

    /// Whether kernels are ready. Those that are not are asked for, and the job says that it waits for the first of them.
    fn is_ready(&self, context: &mut DeviceContext, variants: &[Variant]) -> Result<bool> {
        let mut missing = None;
        for variant in variants {
            if !context.is_ready(variant)? {
                missing.get_or_insert(variant);
            }
        }
        match missing {
            Some(variant) => self.job.waits_for(variant),
            None => self.job.started(),
        }
        Ok(missing.is_none())
    }

    fn begin_field(&mut self, context: &mut DeviceContext) -> Result<()> {
        let Some(Subject::Field(field)) = self.scene.as_ref().map(Scene::subject) else { return Ok(()) };
        let plan = field.plan()?;
        self.run_field(context, plan)
    }

    pub(super) fn run_field(&mut self, context: &mut DeviceContext, plan: FieldPlan) -> Result<()> {
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

    pub(super) fn begin_view(&mut self, context: &mut DeviceContext, volume: Arc<Volume>) -> Result<()> {
        let Some(scene) = &self.scene else { return Ok(()) };
        if let Some(field) = &self.field {
            let mut progress = self.job.lock();
            progress.field = Some(volume.clone());
            if field.is_done() {
                progress.complete_field = Some(volume.clone());
            }
        }
        let words = scene.words_of(&volume)?;
        let mut plan = scene.view().plan(words.as_ref().unwrap_or(&volume))?;
        if words.is_some() {
            let half = 0.5 * volume.word_step();
            plan.reasons.push(format!("floats are taken as words of 16 bits: values are off by {half:.1e} at most"));
        }
        self.run_view(context, words.unwrap_or(volume), plan)
    }

    pub(super) fn run_view(&mut self, context: &mut DeviceContext, volume: Arc<Volume>, plan: ViewPlan) -> Result<()> {
        let [of_cells, of_distances] = cells::needed(volume.voxel_type());
        if !self.is_ready(context, &[plan.variant, of_cells, of_distances])? {
            self.awaited = Some(Awaited::View(volume, plan));
            return Ok(());
        }
        let Some(scene) = &self.scene else { return Ok(()) };
        if self.field.is_none() {
            self.started = Instant::now();
        }
        let before = self.memory.take().or_else(|| {
            self.view.take().map(|earlier| {
                self.earlier_time += earlier.device_time;
                earlier.gathered
            })
        });
        let view = ViewRun::new(context, scene, &volume, plan, before)?;
        {
            let mut progress = self.job.lock();
            progress.reasons = self.field.as_ref().map_or(Vec::new(), |f| f.reasons().to_vec());
            progress.reasons.extend_from_slice(&view.plan().reasons);
            progress.counts.non_finite_voxels = volume.non_finite();
            progress.warnings = warnings(&volume, scene);
            let simulated = self.result.as_ref().and_then(|r| r["warnings"].as_array());
            progress.warnings.extend(simulated.into_iter().flatten().cloned());
        }
        self.volume = Some(volume);
        self.view = Some(view);
        Ok(())
    }
}
