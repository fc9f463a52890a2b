//! Idempotency keys: the same key with the same body gives the same render.

use std::collections::{HashMap, VecDeque};

use crate::error::{Error, Result};

/// The number of keys that are remembered.
const KEYS: usize = 4096;

/// The keys with the hash of their body and the id of the render that they made, and the order in which they came.
#[derive(Default)]
pub(super) struct Idempotency {
    by_key: HashMap<String, (blake3::Hash, String)>,
    order: VecDeque<String>,
}

impl Idempotency {
    /// The id of the render that was made with a key before.
    ///
    /// # Errors
    /// [`Error::Conflict`] when the key came with another body.
    pub fn made_by(&self, key: &str, body: blake3::Hash) -> Result<Option<String>> {
        match self.by_key.get(key) {
            Some((before, _)) if *before != body => {
                Err(Error::Conflict("this Idempotency-Key came with another body before".into()))
            }
            known => Ok(known.map(|(_, id)| id.clone())),
        }
    }

    /// Remembers a key. Past the limit, the oldest key is forgotten.
    pub fn remember(&mut self, key: String, body: blake3::Hash, id: String) {
        if self.order.len() >= KEYS
            && let Some(oldest) = self.order.pop_front()
        {
            self.by_key.remove(&oldest);
        }
        self.order.push_back(key.clone());
        self.by_key.insert(key, (body, id));
    }
}
