//! The room on disk that all kinds of uploads share.

use std::sync::{Arc, Mutex};

use super::lock;
use crate::error::{Error, Result};

/// Bytes on disk within one limit.
pub(super) struct Space {
    used: Mutex<u64>,
    most: u64,
}

/// Bytes that are given back unless they are kept.
pub(super) struct Taken<'a> {
    space: &'a Space,
    bytes: u64,
}

/// One room for all kinds.
pub(super) type SharedSpace = Arc<Space>;

impl Space {
    /// An empty room of `most` bytes.
    pub fn new(most: u64) -> Self {
        Self { used: Mutex::new(0), most }
    }

    /// Takes bytes for an upload.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if there are not so many left.
    pub fn take(&self, bytes: u64) -> Result<Taken<'_>> {
        let mut used = lock(&self.used);
        if used.saturating_add(bytes) > self.most {
            let what = format!("the store with these {bytes} bytes added to its {used}");
            return Err(Error::TooLarge { what, limit: format!("{} bytes", self.most) });
        }
        *used += bytes;
        Ok(Taken { space: self, bytes })
    }

    /// Counts what is there already, whatever the limit.
    pub fn add(&self, bytes: u64) {
        *lock(&self.used) += bytes;
    }

    /// Gives bytes back.
    pub fn free(&self, bytes: u64) {
        let mut used = lock(&self.used);
        *used = used.saturating_sub(bytes);
    }

    /// The bytes of all uploads.
    pub fn used(&self) -> u64 {
        *lock(&self.used)
    }
}

impl Taken<'_> {
    /// Keeps them.
    pub fn keep(mut self) {
        self.bytes = 0;
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        self.space.free(self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_kept_comes_back() {
        let space = Space::new(10);
        space.take(6).expect("room").keep();
        drop(space.take(4).expect("room"));
        assert!(space.take(5).is_err());
        assert_eq!(space.used(), 6);
        space.free(6);
        space.add(11);
        assert!(space.take(0).is_err() && space.used() == 11);
    }
}
