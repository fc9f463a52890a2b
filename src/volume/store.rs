//! Volumes by id: uploads kept in a folder, built-ins made when asked for, both decoded only while they are used.

use super::builtin::{self, BUILTINS};
use super::cache::{Cache, Key};
use super::inflate::Source;
use super::store_files::{Extension, Folder, Record, id_of, is_id};
use super::{RawParams, Volume, VolumeInfo, VolumeLimits, read};
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// How much a store holds.
#[derive(Debug, Clone, Copy)]
pub struct StoreLimits {
    /// How large one volume may be.
    pub volume: VolumeLimits,
    /// Bytes of all uploaded files on disk.
    pub max_store_bytes: u64,
    /// Bytes of decoded voxels kept in memory for the next use. Volumes in use are not counted once forgotten.
    pub max_resident_bytes: u64,
}

/// Uploaded and built-in volumes. One process at a time may use a folder.
pub struct Store {
    folder: Folder,
    limits: StoreLimits,
    state: Mutex<State>,
    /// Held while a volume is decoded, built or written: one at a time, so that many requests together take no more
    /// memory than one, and the same content sent twice at once is stored once. Taken before `state`, never after.
    working: Mutex<()>,
}

struct State {
    records: BTreeMap<String, Record>,
    cache: Cache,
}

impl Store {
    /// Opens or creates a store in the folder `dir`.
    ///
    /// # Errors
    /// [`Error::Internal`] if the folder cannot be used.
    pub fn open(dir: &Path, limits: StoreLimits) -> Result<Self> {
        let (folder, records) = Folder::open(dir)?;
        let state = State { records: records.into_iter().collect(), cache: Cache::new(limits.max_resident_bytes) };
        Ok(Self { folder, limits, state: Mutex::new(state), working: Mutex::new(()) })
    }

    /// Reads and keeps an upload. Returns it with its id, and whether it is new: the same content, read in the same
    /// way, is one volume, under the name that it had first.
    ///
    /// # Errors
    /// Those of [`read`]; [`Error::TooLarge`] if the store is full.
    pub fn insert(&self, bytes: Vec<u8>, name: &str, raw: Option<RawParams>) -> Result<(Arc<Volume>, String, bool)> {
        let id = id_of(&bytes, raw.as_ref())?;
        let _working = lock(&self.working);
        if lock(&self.state).records.contains_key(&id) {
            return Ok((self.decoded(&id)?, id, false));
        }
        self.check_space(bytes.len() as u64)?;
        let volume = Arc::new(read(&bytes, name, raw, &self.limits.volume)?);
        let created = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let record = Record {
            info: VolumeInfo::of_upload(&id, &volume).brief(),
            raw,
            extension: extension(&volume, &bytes),
            file_bytes: bytes.len() as u64,
            created_unix_s: created.as_secs(),
        };
        self.folder.write(&id, &bytes, &record)?;
        let mut state = lock(&self.state);
        state.records.insert(id.clone(), record);
        state.cache.put(Key::Id(id.clone()), &volume);
        Ok((volume, id, true))
    }

    fn check_space(&self, more: u64) -> Result<()> {
        let held: u64 = lock(&self.state).records.values().map(|record| record.file_bytes).sum();
        if held.saturating_add(more) > self.limits.max_store_bytes {
            let what = format!("the store with these {more} bytes added to its {held}");
            return Err(Error::TooLarge { what, limit: format!("{} bytes", self.limits.max_store_bytes) });
        }
        Ok(())
    }

    /// An upload, decoded again if it was forgotten.
    ///
    /// # Errors
    /// [`Error::NotFound`] for an unknown id, also one that is not an id at all.
    pub fn get(&self, id: &str) -> Result<Arc<Volume>> {
        self.record(id)?;
        if let Some(volume) = self.cached(&Key::Id(id.to_owned())) {
            return Ok(volume);
        }
        let _working = lock(&self.working);
        self.decoded(id)
    }

    /// The volume of a known id; `working` is held.
    fn decoded(&self, id: &str) -> Result<Arc<Volume>> {
        let key = Key::Id(id.to_owned());
        if let Some(volume) = self.cached(&key) {
            return Ok(volume);
        }
        let record = self.record(id)?;
        let bytes = self.folder.read(id, &record)?;
        let volume = read(&bytes, &record.info.name, record.raw, &self.limits.volume)
            .map_err(|cause| Error::internal(format!("the stored volume {id} cannot be read any more: {cause}")))?;
        let volume = Arc::new(volume);
        lock(&self.state).cache.put(key, &volume);
        Ok(volume)
    }

    /// As [`Store::get`], where the request's field at `pointer` names the volume.
    ///
    /// # Errors
    /// Those of [`Store::get`]; [`Error::Invalid`] with the pointer where there is no such volume.
    pub fn named(&self, id: &str, pointer: &str) -> Result<Arc<Volume>> {
        self.get(id).map_err(|e| match e {
            Error::NotFound { .. } => {
                Error::invalid(pointer, format!("there is no volume '{id}'"), "an id from /v1/volumes")
            }
            other => other,
        })
    }

    /// A built-in volume, built if it is not in memory.
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
        let key = Key::Builtin(known.name, resolution, seed);
        if let Some(volume) = self.cached(&key) {
            return Ok(volume);
        }
        let _working = lock(&self.working);
        if let Some(volume) = self.cached(&key) {
            return Ok(volume);
        }
        let volume = Arc::new(builtin::build(known.name, resolution, seed)?);
        lock(&self.state).cache.put(key, &volume);
        Ok(volume)
    }

    /// What is known of an upload, with its histogram.
    ///
    /// # Errors
    /// As [`Store::get`].
    pub fn info(&self, id: &str) -> Result<VolumeInfo> {
        Ok(VolumeInfo::of_upload(id, &*self.get(id)?))
    }

    /// What is known of a built-in, with its histogram.
    ///
    /// # Errors
    /// As [`Store::builtin`].
    pub fn builtin_info(&self, name: &str, resolution: usize, seed: u64) -> Result<VolumeInfo> {
        Ok(VolumeInfo::of_builtin(name, resolution, seed, &*self.builtin(name, resolution, seed)?))
    }

    /// The built-ins at their default resolution, then the uploads, oldest first. Decodes and builds nothing.
    pub fn list(&self) -> Vec<VolumeInfo> {
        let state = lock(&self.state);
        let mut uploads: Vec<_> = state.records.values().collect();
        uploads.sort_by_key(|record| record.created_unix_s);
        let uploads = uploads.into_iter().map(|record| record.info.clone());
        BUILTINS.iter().map(VolumeInfo::of_unbuilt).chain(uploads).collect()
    }

    /// Removes an upload from memory and disk. Renders that use it go on.
    ///
    /// # Errors
    /// [`Error::NotFound`] for an unknown id.
    pub fn delete(&self, id: &str) -> Result<()> {
        let _working = lock(&self.working);
        let record = self.record(id)?;
        self.folder.remove(id, &record)?;
        let mut state = lock(&self.state);
        state.records.remove(id);
        state.cache.remove(&Key::Id(id.to_owned()));
        Ok(())
    }

    /// Bytes of all uploaded files on disk, and of all decoded voxels kept in memory.
    pub fn sizes(&self) -> (u64, u64) {
        let state = lock(&self.state);
        (state.records.values().map(|record| record.file_bytes).sum(), state.cache.bytes())
    }

    fn cached(&self, key: &Key) -> Option<Arc<Volume>> {
        lock(&self.state).cache.get(key)
    }

    fn record(&self, id: &str) -> Result<Record> {
        let found = if is_id(id) { lock(&self.state).records.get(id).cloned() } else { None };
        found.ok_or_else(|| Error::NotFound { what: "volume", id: id.chars().take(64).collect() })
    }
}

/// A panic elsewhere leaves the state whole: it is changed in single steps only.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn extension(volume: &Volume, bytes: &[u8]) -> Extension {
    match volume.format() {
        "nifti" if Source::is_gzip(bytes) => Extension::NiiGz,
        "nifti" => Extension::Nii,
        "nrrd" => Extension::Nrrd,
        _ => Extension::Raw,
    }
}
