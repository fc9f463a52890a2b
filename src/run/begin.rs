//! How a job begins on the device thread, and begins again with a newer camera: its field, then its view, once their kernels are there.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::live::{Live, Shown, Stage};
use super::view_run::ViewRun;
use crate::device::cells;
use crate::device::program::Variant;
use crate::error::Result;
use crate::render::{Scene, Subject};
use crate::technique::ViewPlan;
use crate::volume::Volume;

impl Live {
    /// Takes the newest camera: at the first turn, and then each one that comes after the one before has been seen. Cameras may come faster
    /// than frames, and none would be seen.
    pub(super) fn follow_camera(&mut self, context: &mut DeviceContext) -> Result<()> {
        if self.camera.is_some() && self.shown.at().is_none() {
            return Ok(());
        }
        let seen = self.camera.as_ref().map(|camera| camera.generation);
        let Some(mut camera) = self.job.newest_camera(seen) else { return Ok(()) };
        camera.frame_ms.take().into_iter().for_each(|took| self.motion.learn(took));
        let complete = camera.complete_field.take();
        let moves = camera.generation > 0;
        let scene = self.camera.insert(camera).scene.clone();
        self.started = Instant::now();
        self.shown = Shown::Nothing;
        self.earlier_time = Duration::ZERO;
        self.field.iter_mut().for_each(FieldRun::forget_half);
        self.aim(context, &scene, complete)?;
        match &mut self.view {
            Some(view) if moves => view.hurry(context, &mut self.motion),
            _ => Ok(()),
        }
    }

    /// Points the view at the newest camera, or begins it.
    fn aim(&mut self, context: &mut DeviceContext, scene: &Scene, complete: Option<Arc<Volume>>) -> Result<()> {
        match (scene.subject(), &mut self.view, complete) {
            (_, Some(view), _) => {
                // A field that is still filling is looked at from the new camera at once.
                let fills = self.field.as_ref().is_some_and(|f| !f.is_over());
                self.stage = if fills { Stage::Looks } else { Stage::Refines };
                self.job.started();
                view.restart(context, scene)
            }
            // A field that was computed for an earlier camera is looked at again, not computed again.
            (Subject::Field(..), None, Some(volume)) => self.begin_view(context, volume),
            (Subject::Volume(volume), None, _) => self.begin_view(context, volume.clone()),
            (Subject::Field(..), None, None) => self.begin_field(context),
        }
    }

    /// True if kernels are ready. Those that are not are asked for, and the job says that it waits for the first of them.
    fn is_ready(&self, context: &mut DeviceContext, variants: &[Variant]) -> Result<bool> {
        let mut missing = None;
        for variant in variants {
            if !context.is_ready(variant)? {
                missing.get_or_insert(variant);
            }
        }
        match missing {
            Some(variant) => self.job.waits_for(variant.label()),
            None => self.job.started(),
        }
        Ok(missing.is_none())
    }

    pub(super) fn begin_field(&mut self, context: &mut DeviceContext) -> Result<()> {
        let Some(Subject::Field(field, _)) = self.camera.as_ref().map(|c| c.scene.subject().clone()) else {
            return Ok(());
        };
        if !self.is_ready(context, &field.kernels()?)? {
            self.stage = Stage::AwaitsField;
            return Ok(());
        }
        // A budget of time is for the work, not for compiling.
        self.started = Instant::now();
        let run = FieldRun::new(context, &field)?;
        self.job.set_reasons(run.reasons().to_vec());
        self.field = Some(run);
        self.stage = Stage::Fills;
        Ok(())
    }

    pub(super) fn begin_view(&mut self, context: &mut DeviceContext, volume: Arc<Volume>) -> Result<()> {
        let Some(camera) = &self.camera else { return Ok(()) };
        let scene = &camera.scene;
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
            self.stage = Stage::AwaitsView(volume, plan);
            return Ok(());
        }
        let Some(camera) = &self.camera else { return Ok(()) };
        if self.field.is_none() {
            self.started = Instant::now();
        }
        let before = self.memory.take().or_else(|| {
            self.view.take().map(|earlier| {
                self.earlier_time += earlier.device_time;
                earlier.gathered
            })
        });
        let view = ViewRun::new(context, camera.scene.clone(), volume.clone(), plan, before)?;
        self.note(&view, &volume);
        self.view = Some(view);
        let fills = self.field.as_ref().is_some_and(|f| !f.is_over());
        self.stage = if fills { Stage::Looks } else { Stage::Refines };
        Ok(())
    }

    /// Puts the reasons and the warnings into the job's record.
    fn note(&self, view: &ViewRun, volume: &Volume) {
        let field = self.field.as_ref();
        let mut reasons = field.map_or(Vec::new(), |f| f.reasons().to_vec());
        reasons.extend_from_slice(&view.plan().reasons);
        self.job.set_reasons(reasons);
        let simulated = field.and_then(|f| f.result.as_ref()?["warnings"].as_array());
        let mut warnings = view.warnings();
        warnings.extend(simulated.into_iter().flatten().cloned());
        self.job.set_warnings(warnings, volume.non_finite());
    }
}
