//! Decoded volumes, the least recently used ones forgotten first.

use super::Volume;
use std::sync::Arc;

/// What a decoded volume is found by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Key {
    /// An upload.
    Id(String),
    /// A built-in: name, resolution, seed.
    Builtin(&'static str, usize, u64),
}

/// Volumes within a limit of bytes. One that is forgotten lives on while somebody holds its `Arc`.
pub(super) struct Cache {
    /// The least recently used first.
    entries: Vec<(Key, Arc<Volume>)>,
    max_bytes: u64,
}

impl Cache {
    /// An empty cache.
    pub fn new(max_bytes: u64) -> Self {
        Self { entries: Vec::new(), max_bytes }
    }

    /// The volume, which becomes the most recently used.
    pub fn get(&mut self, key: &Key) -> Option<Arc<Volume>> {
        let place = self.entries.iter().position(|(other, _)| other == key)?;
        let entry = self.entries.remove(place);
        let volume = Arc::clone(&entry.1);
        self.entries.push(entry);
        Some(volume)
    }

    /// Adds a volume, and forgets as many old ones as it takes. One above the limit is not kept at all.
    pub fn put(&mut self, key: Key, volume: &Arc<Volume>) {
        self.remove(&key);
        if volume.bytes() > self.max_bytes {
            return;
        }
        self.entries.push((key, Arc::clone(volume)));
        while self.bytes() > self.max_bytes {
            self.entries.remove(0);
        }
    }

    /// Forgets a volume.
    pub fn remove(&mut self, key: &Key) {
        self.entries.retain(|(other, _)| other != key);
    }

    /// Bytes of all voxels held, with those of coarser levels.
    pub fn bytes(&self) -> u64 {
        self.entries.iter().map(|(_, volume)| volume.bytes_in_all()).sum()
    }
}
