//! The start of a job on the device thread, and its restart with a newer camera: first its field, then its view, each once its kernels are
//! compiled.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::live::{Live, Shown, Stage};
use super::view_run::ViewRun;
use super::volumes::kernels_for;
use crate::device::program::Variant;
use crate::error::Result;
use crate::job::Job;
use crate::render::Scene;
use crate::technique::PreparedView;
use crate::volume::Volume;

impl Live {
    /// Takes the newest camera: at the first turn, and later whenever a frame of the camera before has been handed on. Cameras may come faster than
    /// frames, and without that rule none would be seen.
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

    /// Points the view at the newest camera, or begins the view.
    fn aim(&mut self, context: &mut DeviceContext, scene: &Scene, complete: Option<Arc<Volume>>) -> Result<()> {
        if let Some(view) = &mut self.view {
            // A field that is still filling is looked at from the new camera at once.
            let fills = self.field.as_ref().is_some_and(|f| !f.is_over());
            self.stage = if fills { Stage::Looks } else { Stage::Refines };
            self.job.started();
            return view.restart(context, scene);
        }
        match (scene.subject().field(), complete) {
            // A field that was computed for an earlier camera is looked at again, not computed again.
            (Some(_), Some(volume)) => self.begin_view(context, Some(&volume)),
            (Some(_), None) => self.begin_field(context),
            (None, _) => self.begin_view(context, None),
        }
    }

    pub(super) fn begin_field(&mut self, context: &mut DeviceContext) -> Result<()> {
        let asked = self.camera.as_ref().and_then(|camera| camera.scene.subject().field().cloned());
        let Some(asked) = asked else { return Ok(()) };
        if !is_ready(context, &self.job, &FieldRun::kernels(&*asked.field)?)? {
            self.stage = Stage::AwaitsField;
            return Ok(());
        }
        // The time budget covers the work, not the compilation.
        self.started = Instant::now();
        let run = FieldRun::new(context, &asked)?;
        self.job.set_reasons(run.reasons().to_vec());
        self.field = Some(run);
        self.stage = Stage::Fills;
        Ok(())
    }

    /// Begins the view of the subject, or of the volume that its field has become.
    pub(super) fn begin_view(&mut self, context: &mut DeviceContext, field: Option<&Arc<Volume>>) -> Result<()> {
        let Some(camera) = &self.camera else { return Ok(()) };
        let prepared = camera.scene.prepared(field)?;
        self.run_view(context, prepared)
    }

    pub(super) fn run_view(&mut self, context: &mut DeviceContext, prepared: Arc<dyn PreparedView>) -> Result<()> {
        let mut kernels = vec![prepared.plan().variant];
        kernels.extend(prepared.volume().into_iter().flat_map(|volume| kernels_for(volume)));
        if !is_ready(context, &self.job, &kernels)? {
            self.stage = Stage::AwaitsView(prepared);
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
        let non_finite = prepared.volume().map_or(0, |volume| volume.non_finite());
        let mut view = ViewRun::new(context, camera.scene.clone(), prepared, before)?;
        view.gathered.field_error = self.motion.field_error;
        self.note(&view, non_finite);
        self.view = Some(view);
        let fills = self.field.as_ref().is_some_and(|f| !f.is_over());
        self.stage = if fills { Stage::Looks } else { Stage::Refines };
        Ok(())
    }

    /// Puts the reasons and the warnings into the job's record.
    fn note(&self, view: &ViewRun, non_finite_voxels: u64) {
        let field = self.field.as_ref();
        let mut reasons = field.map_or(Vec::new(), |f| f.reasons().to_vec());
        reasons.extend_from_slice(&view.plan().reasons);
        self.job.set_reasons(reasons);
        let simulated = field.and_then(|f| f.result.as_ref()?["warnings"].as_array());
        let mut warnings = view.warnings();
        warnings.extend(simulated.into_iter().flatten().cloned());
        self.job.set_warnings(warnings, non_finite_voxels);
    }
}

/// True if all kernels are ready. Missing kernels are asked for, and the job notes that it waits for the first of them.
pub(super) fn is_ready(context: &mut DeviceContext, job: &Job, variants: &[Variant]) -> Result<bool> {
    let mut missing = None;
    for variant in variants {
        if !context.is_ready(variant)? {
            missing.get_or_insert(variant);
        }
    }
    match missing {
        Some(variant) => job.waits_for(variant.label()),
        None => job.started(),
    }
    Ok(missing.is_none())
}
