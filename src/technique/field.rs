//! Fields: techniques that fill a grid, step by step.
//!
//! A [`Field`] is a valid request. On the device's thread it begins a [`Process`], which has the device for a slice at a time, looks after
//! its own buffers, and can be looked at, stopped and resumed between any two slices. What it counts (photons, iterations, views) is its
//! own business.
//!
//! A process drives the device itself, through the safe methods of [`Device`]; it does not hand over a recording of what is to be done. A
//! recording cannot decide: how many photons fit in a slice is learnt from the launch before, and an iterative solver needs an inner product
//! before its next step.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use crate::device::Device;
use crate::device::program::Variant;
use crate::error::Result;
use crate::scene::bounds::Bounds;
use crate::volume::Volume;

/// How much of its work a process has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is counted: `photons`, `iterations`, `views`.
    pub of: &'static str,
    /// How many are done,
    pub done: u64,
    /// of how many.
    pub total: u64,
}

impl Progress {
    /// True if nothing is left to do.
    pub fn is_over(&self) -> bool {
        self.done >= self.total
    }
}

/// What a slice came to.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// How far the process is.
    pub progress: Progress,
    /// Time on the device.
    pub device_time: Duration,
    /// True if nothing is half done: the process can be stopped here.
    pub is_whole: bool,
    /// True if the grid has become so much better that a picture of it is worth its time.
    pub is_look_due: bool,
}

/// A field as it is between two slices.
pub struct Look {
    /// The grid.
    pub volume: Arc<Volume>,
    /// What stands under `result` in the reply.
    pub result: Value,
}

/// A field at work on the device. It is dropped with its buffers.
pub trait Process {
    /// Works for about `slice`. Each launch is bounded in steps, so that a slice is never much longer.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device fails.
    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step>;
    /// Makes a whole of what is done so far, such as a batch that is cut short. A later [`Process::step`] goes on from there.
    ///
    /// # Errors
    /// As [`Process::step`].
    fn stop(&mut self, device: &mut Device) -> Result<()>;
    /// The grid and the result as they are.
    ///
    /// # Errors
    /// As [`Process::step`].
    fn look(&mut self, device: &mut Device) -> Result<Look>;
}

/// A field with valid parameters.
pub trait Field: Send + Sync {
    /// The box of its grid.
    fn bounds(&self) -> Bounds;
    /// The kernel variants that its process runs: they are compiled before it begins.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] for a combination of features that is not listed.
    fn kernels(&self) -> Result<Vec<Variant>>;
    /// Why it is done so, in words.
    fn reasons(&self) -> Vec<String>;
    /// The same with another amount of work, and with another seed: its own with bits of `seed` flipped.
    fn with(&self, work: u64, seed: u64) -> Arc<dyn Field>;
    /// Begins its process on a device that has its kernels.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device has no room.
    fn begin(&self, device: &mut Device) -> Result<Box<dyn Process>>;
}
