//! Processes: what works on the device slice by slice, and can be looked at, stopped and resumed between any two slices.
//!
//! A process drives the device itself, through the safe methods of [`Device`]; it does not hand over a recording of what is to be done. A
//! recording cannot decide: how many photons fit in a slice is learnt from the launch before, and an iterative solver needs an inner product
//! before its next step.

use std::time::Duration;

use crate::device::Device;
use crate::error::Result;

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
    /// True if the result has become so much better that a look at it is worth its time.
    pub is_look_due: bool,
}

/// Work on the device. It is dropped with its buffers.
pub trait Process {
    /// What is seen of it.
    type Look;
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
    /// What it has come to.
    ///
    /// # Errors
    /// As [`Process::step`].
    fn look(&mut self, device: &mut Device) -> Result<Self::Look>;
}
