//! The cache of decoded and built things. It forgets the least recently used first.

use std::any::Any;
use std::sync::{Arc, Mutex};

/// A thing that may be kept in memory.
pub trait Resident: Any + Send + Sync {
    /// The bytes in memory. They may grow, as when coarser levels of a volume are made.
    fn resident_bytes(&self) -> u64;
}

/// Things of any kind within one limit of bytes, by keys that name their kind. A forgotten thing lives on while somebody holds its `Arc`.
pub(super) struct Cache {
    /// The entries, the least recently used first.
    entries: Vec<Entry>,
    max_bytes: u64,
}

struct Entry {
    key: String,
    thing: Arc<dyn Any + Send + Sync>,
    /// The same thing, for its size.
    resident: Arc<dyn Resident>,
}

/// One cache for all kinds.
pub(super) type SharedCache = Arc<Mutex<Cache>>;

impl Cache {
    /// An empty cache.
    pub fn new(max_bytes: u64) -> Self {
        Self { entries: Vec::new(), max_bytes }
    }

    /// The thing of a key. It becomes the most recently used.
    pub fn get<A: Resident>(&mut self, key: &str) -> Option<Arc<A>> {
        let place = self.entries.iter().position(|entry| entry.key == key)?;
        let entry = self.entries.remove(place);
        let thing = entry.thing.clone().downcast().ok();
        self.entries.push(entry);
        thing
    }

    /// Adds a thing, and forgets as many old ones as necessary. A thing above the limit is not kept at all.
    pub fn put<A: Resident>(&mut self, key: String, thing: &Arc<A>) {
        self.remove(&key);
        if thing.resident_bytes() > self.max_bytes {
            return;
        }
        self.entries.push(Entry { key, thing: thing.clone(), resident: thing.clone() });
        while self.bytes() > self.max_bytes {
            self.entries.remove(0);
        }
    }

    /// Forgets a thing.
    pub fn remove(&mut self, key: &str) {
        self.entries.retain(|entry| entry.key != key);
    }

    /// The bytes of all things that are kept.
    pub fn bytes(&self) -> u64 {
        self.entries.iter().map(|entry| entry.resident.resident_bytes()).sum()
    }
}
