//! Fields: techniques that fill a grid, step by step.
//!
//! A [`Field`] is a valid request. On the device's thread it begins a [`Process`], which owns its buffers. Each field chooses the unit that it counts
//! (photons, iterations, views).

use std::sync::Arc;

use serde_json::Value;

use super::Process;
use crate::device::program::Variant;
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::scene::bounds::Bounds;

/// A field as it is between two slices.
pub struct Look {
    /// The voxels of the field's bounds as floats on the device, x fastest, in memory of [`crate::device::grid::allocate`]. They stay as they are
    /// while the process goes on.
    pub voxels: Buffer,
    /// The reply's `result`.
    pub result: Value,
}

/// A field with valid parameters.
pub trait Field: Send + Sync {
    /// The box of its grid, mm, and its voxels.
    fn bounds(&self) -> Bounds;
    /// The kernel variants that its process runs. They are compiled before it begins.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] for a combination of features that is not listed.
    fn kernels(&self) -> Result<Vec<Variant>>;
    /// The reasons for the chosen method, in words.
    fn reasons(&self) -> Vec<String>;
    /// The same field with another amount of work, and with its own seed xor `seed`.
    fn with(&self, work: u64, seed: u64) -> Arc<dyn Field>;
    /// Begins its process on a device that has its kernels.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room.
    fn begin(&self, device: &mut Device) -> Result<Box<dyn Process<Look = Look>>>;
}
