//! The complete build of a kernel. PoCL compiles at the first launch, so each kernel is launched once on nothing.

use std::path::PathBuf;

use super::sources::source_of;
use crate::device::program::Variant;
use crate::device::{Buffer, Device, Parameter};
use crate::error::Result;
use crate::volume::VoxelType;

/// Builds a variant and launches it once on nothing.
///
/// # Errors
/// [`Error::Internal`] with the build log.
pub(super) fn warm(device: &mut Device, variant: &Variant) -> Result<()> {
    if device.is_built(variant) {
        return Ok(());
    }
    let source = source_of(variant)?;
    device.build(&source, variant)?;
    // Zeroed buffers ask for an image of no pixels or a launch of no histories, so that the kernel is compiled and does nothing.
    let zero = |parameter: &Parameter| -> Result<Buffer> {
        if parameter.is_volume && device.info().volumes_are_images {
            device.image_of(&device.upload(&[0], 0)?, VoxelType::U8, [1; 3])
        } else {
            device.upload(&[0; 1024], 0)
        }
    };
    let parameters = device.parameters(variant)?;
    let buffers: Vec<Buffer> = parameters.iter().map(zero).collect::<Result<_>>()?;
    let arguments: Vec<(&str, &Buffer)> = parameters.iter().map(|p| p.name.as_str()).zip(&buffers).collect();
    device.run(variant, &arguments, 1)?;
    // The note stands beside PoCL's cache. Without it the variant is compiled again, which finds the cached one.
    if let Some(note) = note(device, variant) {
        drop(note.parent().map(std::fs::create_dir_all));
        drop(std::fs::write(note, variant.label()));
    }
    Ok(())
}

/// The file that notes that PoCL's cache has a variant. It is in the cache's own folder, so that both are deleted together.
fn note(device: &Device, variant: &Variant) -> Option<PathBuf> {
    let cache = std::env::var_os("POCL_CACHE_DIR").filter(|_| device.info().is_pocl())?;
    let source = source_of(variant).ok()?;
    Some(PathBuf::from(cache).join("cloudchamber").join(device.fingerprint(&source, variant).ok()?))
}

/// True if PoCL's cache has a variant.
pub(super) fn is_cached(device: &Device, variant: &Variant) -> bool {
    note(device, variant).is_some_and(|note| note.exists())
}
