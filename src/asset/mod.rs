//! Stored things, by the hash of their content: one handle for all techniques.
//!
//! A kind of asset implements [`Asset`] in a file here and has a [`Store`] in [`Assets`]. All kinds share the limits: bytes on disk, and bytes of
//! decoded things. Built-in volumes are made when asked for, and count as decoded.

mod cache;
mod folder;
mod kind;
mod sinogram;
mod space;
mod store;
mod volume;

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use cache::Resident;
use cache::{Cache, SharedCache};
pub use kind::Asset;
use space::{SharedSpace, Space};
pub use store::Store;

use crate::error::{Error, Result};
use crate::tomography::Sinogram;
use crate::volume::builtin::{self, BUILTINS};
use crate::volume::{Volume, VolumeInfo, VolumeLimits};

/// The limits of the stores.
#[derive(Debug, Clone, Copy)]
pub struct AssetLimits {
    /// The limits of one volume.
    pub volume: VolumeLimits,
    /// The bytes of all uploaded files on disk.
    pub max_store_bytes: u64,
    /// The bytes of decoded things in memory for the next use. Forgotten things that are still in use are not counted.
    pub max_resident_bytes: u64,
}

/// All stored things. One process at a time may use a folder.
pub struct Assets {
    volumes: Store<Volume>,
    sinograms: Store<Sinogram>,
    cache: SharedCache,
    space: SharedSpace,
    limits: AssetLimits,
    /// The lock for the making of built-ins, one at a time. It is taken before the cache's, never after.
    making: Mutex<()>,
}

impl Assets {
    /// Opens or creates the stores below the folder `dir`.
    ///
    /// # Errors
    /// [`Error::Internal`] if the folder cannot be used.
    pub fn open(dir: &Path, limits: AssetLimits) -> Result<Self> {
        let cache = SharedCache::new(Mutex::new(Cache::new(limits.max_resident_bytes)));
        let space = SharedSpace::new(Space::new(limits.max_store_bytes));
        let volumes = Store::open(&dir.join("volumes"), limits, cache.clone(), space.clone())?;
        let sinograms = Store::open(&dir.join("sinograms"), limits, cache.clone(), space.clone())?;
        Ok(Self { volumes, sinograms, cache, space, limits, making: Mutex::new(()) })
    }

    /// The limits, which hold for grids that are computed, too.
    pub fn limits(&self) -> &AssetLimits {
        &self.limits
    }

    /// The uploaded volumes.
    pub fn volumes(&self) -> &Store<Volume> {
        &self.volumes
    }

    /// The uploaded sinograms.
    pub fn sinograms(&self) -> &Store<Sinogram> {
        &self.sinograms
    }

    /// A built-in volume. It is built if it is not in memory.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `/volume/builtin` or `/volume/resolution`; [`Error::TooLarge`] above the volume limits.
    pub fn builtin(&self, name: &str, resolution: usize, seed: u64) -> Result<Arc<Volume>> {
        let known = builtin::find(name, resolution)?;
        let bytes = (resolution as u64).pow(3) * 4;
        if bytes > self.limits.volume.max_volume_bytes || resolution > self.limits.volume.max_side {
            let limit = format!("{} bytes of voxels", self.limits.volume.max_volume_bytes);
            return Err(Error::TooLarge { what: format!("a built-in of {resolution}³ voxels"), limit });
        }
        let seed = if known.seeded { seed } else { 0 };
        let key = format!("built-in {name} {resolution} {seed}");
        let made = || lock(&self.cache).get(&key);
        if let Some(volume) = made() {
            return Ok(volume);
        }
        let _making = lock(&self.making);
        if let Some(volume) = made() {
            return Ok(volume);
        }
        let volume = Arc::new(builtin::build(known.name, resolution, seed)?);
        lock(&self.cache).put(key, &volume);
        Ok(volume)
    }

    /// The description of a built-in, with its histogram.
    ///
    /// # Errors
    /// As [`Assets::builtin`].
    pub fn builtin_info(&self, name: &str, resolution: usize, seed: u64) -> Result<VolumeInfo> {
        VolumeInfo::of_builtin(name, resolution, seed, &*self.builtin(name, resolution, seed)?)
    }

    /// The built-ins at their default resolution, then the uploads, oldest first. Nothing is decoded or built.
    pub fn list_volumes(&self) -> Vec<VolumeInfo> {
        BUILTINS.iter().map(VolumeInfo::of_unbuilt).chain(self.volumes.list()).collect()
    }

    /// The bytes of all uploaded files on disk, and of all decoded things in memory.
    pub fn sizes(&self) -> (u64, u64) {
        (self.space.used(), lock(&self.cache).bytes())
    }
}

/// Takes a lock. A panic elsewhere leaves the state whole, since it is changed in single steps only.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
