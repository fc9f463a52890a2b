//! A field on the device: its process, the last look at it, and the error that it causes in the picture.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::context::DeviceContext;
use crate::error::Result;
use crate::film::Film;
use crate::technique::{Field, Look, Process, Step};
use crate::volume::Volume;

/// A field at work.
pub(super) struct FieldRun {
    process: Box<dyn Process<Look = Look>>,
    reasons: Vec<String>,
    is_over: bool,
    /// The `result` of the reply, as of the last look.
    pub result: Option<Value>,
    /// The picture of half as much work.
    half: Option<Film>,
    /// The relative change of the picture since the field had half its work.
    pub error: Option<f64>,
    pub device_time: Duration,
}

impl FieldRun {
    /// Begins a field whose kernels are built.
    pub fn new(context: &mut DeviceContext, field: &Arc<dyn Field>) -> Result<Self> {
        Ok(Self {
            process: field.begin(&mut context.device)?,
            reasons: field.reasons(),
            is_over: false,
            result: None,
            half: None,
            error: None,
            device_time: Duration::ZERO,
        })
    }

    pub fn reasons(&self) -> &[String] {
        &self.reasons
    }

    /// True if nothing is left to do.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// Works for about `slice`.
    pub fn step(&mut self, context: &mut DeviceContext, slice: Duration) -> Result<Step> {
        let step = self.process.step(&mut context.device, slice)?;
        self.device_time += step.device_time;
        self.is_over = step.progress.is_over();
        Ok(step)
    }

    /// Ends the process with the work that is done so far.
    pub fn stop(&mut self, context: &mut DeviceContext) -> Result<()> {
        self.is_over = true;
        self.process.stop(&mut context.device)
    }

    /// Reads the grid in its present state.
    pub fn look(&mut self, context: &mut DeviceContext) -> Result<Arc<Volume>> {
        let seen = self.process.look(&mut context.device)?;
        self.result = Some(seen.result);
        Ok(seen.volume)
    }

    /// Forgets the picture of half the work, which is from an old camera. The error that was found from there stands in for the new camera's.
    pub fn forget_half(&mut self) {
        self.half = None;
    }

    /// Compares a picture with the one of half as much work. The difference of a mean to that of its first half has the variance of the mean
    /// itself, so it estimates the picture's standard error.
    pub fn compare_with_half(&mut self, film: Film) {
        if let Some(half) = &self.half {
            self.error = film.difference(half);
        }
        self.half = Some(film);
    }
}
