//! The folder of a store. It has for each upload the body as it came and a JSON record, which is written last.
//!
//! Every file is written under a temporary name, flushed and renamed. A crash leaves at worst a body without a
//! record or a temporary file; both are removed at the next start.

use super::kind::Asset;
use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The number of hexadecimal digits of an id.
const ID_DIGITS: usize = 32;

/// The beginning of the names of files that are being written.
const TEMPORARY: &str = "tmp-";

/// The record of an upload, which stands beside it in `ID.json`.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(bound = "")]
pub(super) struct Record<A: Asset> {
    /// Its description in lists.
    pub info: A::Info,
    /// The way to read its bytes, if they do not tell it themselves.
    pub raw: Option<A::How>,
    /// The extension of the uploaded file, after its content.
    pub extension: String,
    /// The bytes of the uploaded file.
    pub file_bytes: u64,
    /// The time of the upload, in seconds since 1970.
    pub created_unix_s: u64,
}

/// Records by id.
pub(super) type Records<A> = BTreeMap<String, Record<A>>;

impl<A: Asset> Clone for Record<A> {
    fn clone(&self) -> Self {
        let (info, raw, extension) = (self.info.clone(), self.raw.clone(), self.extension.clone());
        Self { info, raw, extension, file_bytes: self.file_bytes, created_unix_s: self.created_unix_s }
    }
}

/// True if the text is an id as this store makes them. Nothing else ever becomes part of a path.
pub(super) fn is_id(text: &str) -> bool {
    text.len() == ID_DIGITS && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// True if the text is an extension as assets have them.
fn is_extension(text: &str) -> bool {
    !text.is_empty()
        && text.bytes().all(|byte| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'.'))
        && !text.contains("..")
}

/// The id of a body: the hash of its bytes and of the way to read them.
pub(super) fn id_of(bytes: &[u8], how: Option<&impl serde::Serialize>) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytes);
    if let Some(how) = how {
        hasher.update(&serde_json::to_vec(how).map_err(Error::internal)?);
    }
    Ok(hasher.finalize().to_hex().chars().take(ID_DIGITS).collect())
}

/// The folder of a store.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Opens or creates the folder, removes the leftovers of a crash, and reads the records.
    pub fn open<A: Asset>(dir: &Path) -> Result<(Self, Records<A>)> {
        fs::create_dir_all(dir).map_err(|cause| failed("create the folder of a store", &cause))?;
        let folder = Self(dir.to_owned());
        let names = folder.names()?;
        let mut records = Records::new();
        for id in names.iter().filter_map(|name| name.strip_suffix(".json")).filter(|id| is_id(id)) {
            match folder.read_record(id) {
                Ok(record) => drop(records.insert(id.to_owned(), record)),
                Err(cause) => tracing::warn!(id, %cause, "what is stored cannot be used"),
            }
        }
        for name in &names {
            // A body whose record cannot be read stays, since another version of this program may know the record.
            let left_over = name.split_once('.').is_some_and(|(id, extension)| {
                is_id(id) && extension != "json" && !names.contains(&format!("{id}.json"))
            });
            if left_over || name.starts_with(TEMPORARY) {
                tracing::info!(name, "removing what an interrupted upload has left");
                folder.remove_file(name)?;
            }
        }
        Ok((folder, records))
    }

    fn names(&self) -> Result<Vec<String>> {
        let entries = fs::read_dir(&self.0).map_err(|cause| failed("list what is stored", &cause))?;
        let names = entries.map(|entry| entry.map(|entry| entry.file_name().into_string()));
        let names: Result<Vec<_>, _> = names.collect::<io::Result<_>>();
        let names = names.map_err(|cause| failed("list what is stored", &cause))?;
        Ok(names.into_iter().filter_map(Result::ok).collect())
    }

    fn read_record<A: Asset>(&self, id: &str) -> Result<Record<A>> {
        let text = fs::read(self.0.join(format!("{id}.json"))).map_err(|cause| failed("read a record", &cause))?;
        let record: Record<A> = serde_json::from_slice(&text).map_err(Error::internal)?;
        let body = fs::metadata(self.body_path(id, &record)).map_err(|cause| failed("find a body", &cause))?;
        if body.len() != record.file_bytes
            || A::id_and_name(&record.info).0 != Some(id)
            || !is_extension(&record.extension)
        {
            return Err(Error::internal("the record does not agree with its body"));
        }
        Ok(record)
    }

    fn body_path<A: Asset>(&self, id: &str, record: &Record<A>) -> PathBuf {
        self.0.join(format!("{id}.{}", record.extension))
    }

    /// Writes an upload: the body first, then the record that makes it count.
    pub fn write<A: Asset>(&self, id: &str, bytes: &[u8], record: &Record<A>) -> Result<()> {
        let text = serde_json::to_vec_pretty(record).map_err(Error::internal)?;
        let body = self.body_path(id, record);
        let written = self
            .write_file(&body, id, bytes)
            .and_then(|()| self.write_file(&self.0.join(format!("{id}.json")), id, &text));
        if written.is_err() {
            // A body without a record takes room for nothing.
            let _ = fs::remove_file(&body);
        }
        written.map_err(|cause| failed("store an upload", &cause))
    }

    fn write_file(&self, path: &Path, id: &str, bytes: &[u8]) -> io::Result<()> {
        let temporary = self.0.join(format!("{TEMPORARY}{id}"));
        let written = File::create(&temporary).and_then(|mut file| {
            file.write_all(bytes)?;
            file.sync_all()
        });
        let renamed = written.and_then(|()| fs::rename(&temporary, path));
        if renamed.is_err() {
            // A full disk is the likely cause, so the space is given back.
            let _ = fs::remove_file(&temporary);
        }
        renamed
    }

    /// The body of an upload.
    pub fn read<A: Asset>(&self, id: &str, record: &Record<A>) -> Result<Vec<u8>> {
        fs::read(self.body_path(id, record)).map_err(|cause| failed("read what is stored", &cause))
    }

    /// Removes an upload. Its record goes first, so that no record is without its body.
    pub fn remove<A: Asset>(&self, id: &str, record: &Record<A>) -> Result<()> {
        self.remove_file(&format!("{id}.json"))?;
        self.remove_file(&format!("{id}.{}", record.extension))
    }

    fn remove_file(&self, name: &str) -> Result<()> {
        match fs::remove_file(self.0.join(name)) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(failed("remove what is stored", &cause)),
            _ => Ok(()),
        }
    }
}

fn failed(what: &str, cause: &io::Error) -> Error {
    Error::internal(format!("cannot {what}: {cause}"))
}
