//! A field on the device: its process, the last look at it, and the error that it causes in the picture.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::context::DeviceContext;
use crate::device::grid;
use crate::device::program::Variant;
use crate::error::Result;
use crate::film::{FieldError, Film};
use crate::scene::bounds::Bounds;
use crate::technique::{AskedField, Field, Look, Process, Step};
use crate::volume::Volume;

/// A field at work.
pub(super) struct FieldRun {
    process: Box<dyn Process<Look = Look>>,
    /// The box of its grid, and the technique's name.
    bounds: Bounds,
    technique: &'static str,
    reasons: Vec<String>,
    is_over: bool,
    /// True if its work is random.
    is_random: bool,
    /// The `result` of the reply, as of the last look.
    pub result: Option<Value>,
    /// The picture of half as much work.
    half: Option<Film>,
    /// The error that it causes in the picture.
    pub error: Option<FieldError>,
    pub device_time: Duration,
}

impl FieldRun {
    /// The kernels of a field and of looks at it.
    ///
    /// # Errors
    /// As [`Field::kernels`].
    pub fn kernels(field: &dyn Field) -> Result<Vec<Variant>> {
        Ok(field.kernels()?.into_iter().chain(grid::needed()).collect())
    }

    /// Begins a field whose kernels are built.
    pub fn new(context: &mut DeviceContext, AskedField { field, technique, work, .. }: &AskedField) -> Result<Self> {
        Ok(Self {
            process: field.begin(&mut context.device)?,
            bounds: field.bounds(),
            technique,
            reasons: field.reasons(),
            is_over: false,
            is_random: work.is_some(),
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

    /// The grid in its present state. It stays on the device.
    pub fn look(&mut self, context: &mut DeviceContext) -> Result<Arc<Volume>> {
        let Look { voxels, result } = self.process.look(&mut context.device)?;
        self.result = Some(result);
        context.grid(voxels, &self.bounds, self.technique)
    }

    /// Forgets the picture of half the work, which is from an old camera. The error that was found from there stands in for the new camera's.
    pub fn forget_half(&mut self) {
        self.half = None;
    }

    /// True if its work is random, so that its pictures have noise of their own.
    pub fn is_random(&self) -> bool {
        self.is_random
    }

    /// The error of a field without random work: none once it is whole, and not known before.
    pub fn settle(&mut self) {
        self.error = self.is_over.then(FieldError::default);
    }

    /// Compares a picture with the one of half as much work.
    pub fn compare_with_half(&mut self, film: Film, extremum: bool) {
        if let Some(half) = &self.half {
            self.error = FieldError::of(&film, half, extremum);
        }
        self.half = Some(film);
    }
}
