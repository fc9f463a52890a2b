//! An export on the device thread: its field fills if it has one, then its process makes the file.

use std::sync::Arc;
use std::time::Duration;

use super::begin::is_ready;
use super::context::DeviceContext;
use super::field_run::FieldRun;
use super::live::{FIELD_SLICE, Turn};
use super::volumes::kernels_for;
use crate::error::Result;
use crate::job::Job;
use crate::render::ExportTask;
use crate::technique::{File, OnDevice, Process, Subject};

/// The stage of an export, which decides its next turn.
enum Stage {
    /// Its subject's field begins once its kernels are compiled.
    AwaitsField,
    /// The field fills.
    Fills(Box<FieldRun>),
    /// The process begins once its kernels are compiled.
    AwaitsProcess(Box<Subject>),
    /// The process works.
    Works(Box<dyn Process<Look = File>>),
}

/// An export with its buffers.
pub(super) struct ExportRun {
    job: Arc<Job>,
    task: ExportTask,
    stage: Stage,
    device_time: Duration,
}

impl ExportRun {
    pub fn new(job: Arc<Job>, task: ExportTask) -> Self {
        let stage = match task.subject().field() {
            Some(_) => Stage::AwaitsField,
            None => Stage::AwaitsProcess(Box::new(task.subject().clone())),
        };
        Self { job, task, stage, device_time: Duration::ZERO }
    }

    pub fn job(&self) -> &Arc<Job> {
        &self.job
    }

    /// One turn: a slice of the field or of the process.
    pub fn turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        if self.job.is_cancelled() || self.job.state().is_terminal() {
            return Ok(Turn::Over);
        }
        match &mut self.stage {
            Stage::AwaitsField => self.begin_field(context),
            Stage::Fills(_) => self.fill(context),
            Stage::AwaitsProcess(subject) => {
                let subject = Subject::clone(subject);
                self.begin_process(context, subject)
            }
            Stage::Works(_) => self.work(context),
        }
    }

    fn begin_field(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let Some(asked) = self.task.subject().field() else { return Ok(Turn::Over) };
        if !is_ready(context, &self.job, &FieldRun::kernels(&*asked.field)?)? {
            return Ok(Turn::Waits);
        }
        let run = FieldRun::new(context, asked)?;
        self.job.set_reasons(run.reasons().to_vec());
        self.stage = Stage::Fills(Box::new(run));
        Ok(Turn::Again)
    }

    fn fill(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let Stage::Fills(field) = &mut self.stage else { return Ok(Turn::Over) };
        let step = field.step(context, FIELD_SLICE)?;
        let device_ms = 1e3 * field.device_time.as_secs_f64();
        self.job.worked(step.progress, device_ms);
        if field.is_over() {
            let volume = field.look(context)?;
            self.device_time = field.device_time;
            self.job.set_field(&volume, true, device_ms);
            self.stage = Stage::AwaitsProcess(Box::new(self.task.subject().with_volume(volume)));
        }
        Ok(Turn::Again)
    }

    fn begin_process(&mut self, context: &mut DeviceContext, subject: Subject) -> Result<Turn> {
        let mut kernels = self.task.export().kernels(&subject)?;
        kernels.extend(subject.volume().into_iter().flat_map(|volume| kernels_for(volume)));
        if !is_ready(context, &self.job, &kernels)? {
            return Ok(Turn::Waits);
        }
        let voxels = subject.volume().map(|volume| context.volume(volume)).transpose()?.map(|v| v.voxels.clone());
        let seen = OnDevice { subject, voxels };
        self.stage = Stage::Works(self.task.export().begin(&mut context.device, seen)?);
        Ok(Turn::Again)
    }

    fn work(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        let Stage::Works(process) = &mut self.stage else { return Ok(Turn::Over) };
        let step = process.step(&mut context.device, FIELD_SLICE)?;
        self.device_time += step.device_time;
        self.job.worked(step.progress, 1e3 * self.device_time.as_secs_f64());
        if !step.progress.is_over() {
            return Ok(Turn::Again);
        }
        let file = process.look(&mut context.device)?;
        if self.task.is_kept() {
            self.job.hand_over(file);
        } else {
            // A cancelled export has no file.
            let _ = self.job.finish_file(file);
        }
        Ok(Turn::Over)
    }
}
