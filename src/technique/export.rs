//! Exports: techniques that turn a subject into a file (a table, a mesh, a sinogram), step by step.

use std::sync::Arc;

use serde_json::Value;

use super::{Process, Subject};
use crate::device::program::Variant;
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::scene::bounds::Bounds;

/// The file that an export makes.
#[derive(Debug, Clone)]
pub struct File {
    /// Its bytes.
    pub bytes: bytes::Bytes,
    /// Its media type.
    pub media_type: &'static str,
    /// The file name's extension.
    pub extension: &'static str,
    /// The reply's `result`.
    pub result: Value,
}

/// The complete subject of an export on the device.
pub struct OnDevice {
    /// The subject, which has no field any more.
    pub subject: Subject,
    /// The voxels of its volume, if it has one: a buffer, or an image if the device samples volumes as images.
    pub voxels: Option<Arc<Buffer>>,
}

/// An export with valid parameters.
pub trait Export: Send + Sync {
    /// True if its subject has a volume or a field. Without one it is of its own parameters alone.
    fn needs_volume(&self) -> bool {
        true
    }
    /// Checks its parameters against the box of its subject, before a field is computed.
    ///
    /// # Errors
    /// `Error::Invalid` if they do not go together; `Error::TooLarge`.
    fn check(&self, _: &Bounds) -> Result<()> {
        Ok(())
    }
    /// The kernel variants that its process runs on a subject without a field.
    ///
    /// # Errors
    /// `Error::Invalid` if parameters and subject do not go together; [`crate::error::Error::Internal`] for a combination of features that is not
    /// listed.
    fn kernels(&self, subject: &Subject) -> Result<Vec<Variant>>;
    /// Begins its process on a device that has its kernels.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room.
    fn begin(&self, device: &mut Device, seen: OnDevice) -> Result<Box<dyn Process<Look = File>>>;
}
