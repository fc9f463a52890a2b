//! Assets of one kind by id: uploads kept in a folder, decoded only while they are used.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

use super::cache::SharedCache;
use super::folder::{Folder, Record, Records, id_of, is_id};
use super::kind::Asset;
use super::space::SharedSpace;
use super::{AssetLimits, lock};
use crate::error::{Error, Result};

/// The uploads of one kind.
pub struct Store<A: Asset> {
    folder: Folder,
    limits: AssetLimits,
    records: Mutex<Records<A>>,
    cache: SharedCache,
    space: SharedSpace,
    /// The lock for decoding and writing, one upload at a time. Many requests together then take no more memory than one, and the same content that
    /// is sent twice at once is stored once. It is taken before the other locks, never after.
    working: Mutex<()>,
}

impl<A: Asset> Store<A> {
    /// Opens or creates a store in the folder `dir`.
    ///
    /// # Errors
    /// [`Error::Internal`] if the folder cannot be used.
    pub(super) fn open(dir: &Path, limits: AssetLimits, cache: SharedCache, space: SharedSpace) -> Result<Self> {
        let (folder, records) = Folder::open::<A>(dir)?;
        records.values().for_each(|record| space.add(record.file_bytes));
        Ok(Self { folder, limits, records: Mutex::new(records), cache, space, working: Mutex::new(()) })
    }

    /// Reads and keeps an upload. Returns it with its id, and true if it is new. The same content, read in the same way, is one upload, under the
    /// name that it had first.
    ///
    /// # Errors
    /// Those of [`Asset::read`]; [`Error::TooLarge`] if the store is full.
    pub fn insert(&self, bytes: Vec<u8>, name: &str, how: Option<A::How>) -> Result<(Arc<A>, String, bool)> {
        let id = id_of(&bytes, how.as_ref())?;
        let _working = lock(&self.working);
        if lock(&self.records).contains_key(&id) {
            return Ok((self.decoded(&id)?, id, false));
        }
        let taken = self.space.take(bytes.len() as u64)?;
        let asset = Arc::new(A::read(&bytes, name, how.clone(), &self.limits)?);
        let created = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let record = Record {
            info: asset.brief(&id)?,
            raw: how,
            extension: asset.extension(&bytes).to_owned(),
            file_bytes: bytes.len() as u64,
            created_unix_s: created.as_secs(),
        };
        self.folder.write(&id, &bytes, &record)?;
        taken.keep();
        lock(&self.records).insert(id.clone(), record);
        lock(&self.cache).put(key::<A>(&id), &asset);
        Ok((asset, id, true))
    }

    /// An upload. It is decoded again if it was forgotten.
    ///
    /// # Errors
    /// [`Error::NotFound`] for an unknown id, or for a text that is not an id at all.
    pub fn get(&self, id: &str) -> Result<Arc<A>> {
        self.record(id)?;
        if let Some(asset) = self.cached(id) {
            return Ok(asset);
        }
        let _working = lock(&self.working);
        self.decoded(id)
    }

    /// The upload of a known id. The lock `working` is held.
    fn decoded(&self, id: &str) -> Result<Arc<A>> {
        if let Some(asset) = self.cached(id) {
            return Ok(asset);
        }
        let record = self.record(id)?;
        let bytes = self.folder.read(id, &record)?;
        let (_, name) = A::id_and_name(&record.info);
        let asset = A::read(&bytes, name, record.raw.clone(), &self.limits).map_err(|cause| {
            Error::internal(format!("the stored {} {id} cannot be read any more: {cause}", A::KIND))
        })?;
        let asset = Arc::new(asset);
        lock(&self.cache).put(key::<A>(id), &asset);
        Ok(asset)
    }

    /// As [`Store::get`], for an id in the request's field at `pointer`.
    ///
    /// # Errors
    /// Those of [`Store::get`]; [`Error::Invalid`] with the pointer when there is no such asset.
    pub fn named(&self, id: &str, pointer: &str) -> Result<Arc<A>> {
        self.get(id).map_err(|e| match e {
            Error::NotFound { .. } => {
                let permitted = format!("an id from /v1/{}s", A::KIND);
                Error::invalid(pointer, format!("there is no {} '{id}'", A::KIND), permitted)
            }
            other => other,
        })
    }

    /// The full description of an upload.
    ///
    /// # Errors
    /// As [`Store::get`].
    pub fn info(&self, id: &str) -> Result<A::Info> {
        self.get(id)?.info(id)
    }

    /// The uploads, oldest first. Nothing is decoded.
    pub fn list(&self) -> Vec<A::Info> {
        let records = lock(&self.records);
        let mut uploads: Vec<_> = records.values().collect();
        uploads.sort_by_key(|record| record.created_unix_s);
        uploads.into_iter().map(|record| record.info.clone()).collect()
    }

    /// Removes an upload from memory and disk. Renders that use it go on.
    ///
    /// # Errors
    /// [`Error::NotFound`] for an unknown id.
    pub fn delete(&self, id: &str) -> Result<()> {
        let _working = lock(&self.working);
        let record = self.record(id)?;
        self.folder.remove(id, &record)?;
        self.space.free(record.file_bytes);
        lock(&self.records).remove(id);
        lock(&self.cache).remove(&key::<A>(id));
        Ok(())
    }

    fn cached(&self, id: &str) -> Option<Arc<A>> {
        lock(&self.cache).get(&key::<A>(id))
    }

    fn record(&self, id: &str) -> Result<Record<A>> {
        let found = if is_id(id) { lock(&self.records).get(id).cloned() } else { None };
        found.ok_or_else(|| Error::NotFound { what: A::KIND, id: id.chars().take(64).collect() })
    }
}

fn key<A: Asset>(id: &str) -> String {
    format!("{} {id}", A::KIND)
}
