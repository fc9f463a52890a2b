//! Processes: work on the device, slice by slice, that can be looked at, stopped and resumed between any two slices.
//!
//! A process drives the device itself, through the safe methods of [`Device`], instead of returning a list of commands. A list cannot decide: the
//! number of photons in a slice is learnt from the launch before, and an iterative solver needs an inner product before its next step.

use std::time::Duration;

use crate::device::Device;
use crate::error::Result;

/// The progress of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The counted unit: `photons`, `iterations`, `views`.
    pub of: &'static str,
    /// The number of units done.
    pub done: u64,
    /// The number of units in total.
    pub total: u64,
}

impl Progress {
    /// True if all is done.
    pub fn is_over(&self) -> bool {
        self.done >= self.total
    }
}

/// The result of a slice.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// The progress of the process.
    pub progress: Progress,
    /// Time on the device.
    pub device_time: Duration,
    /// True if nothing is half done, so that the process can be stopped here.
    pub is_whole: bool,
    /// True if the result has improved so much that a look at it is worth its time.
    pub is_look_due: bool,
}

/// Work on the device. It is dropped with its buffers.
pub trait Process {
    /// The result of a look: the grid of a field, the file of an export.
    type Look;
    /// Works for about `slice`. Each launch is bounded in steps, so that a slice is never much longer.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device fails.
    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step>;
    /// Completes the work so far, such as a batch that is cut short. A later [`Process::step`] continues from there.
    ///
    /// # Errors
    /// As [`Process::step`].
    fn stop(&mut self, device: &mut Device) -> Result<()>;
    /// The result so far.
    ///
    /// # Errors
    /// As [`Process::step`].
    fn look(&mut self, device: &mut Device) -> Result<Self::Look>;
}
