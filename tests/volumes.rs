//! Volumes: read, built, measured and kept; and what hostile files do to the reader, which is nothing.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "volumes/builtins.rs"]
mod builtins;
#[path = "volumes/formats.rs"]
mod formats;
#[path = "volumes/grids.rs"]
mod grids;
#[path = "volumes/hostile.rs"]
mod hostile;
#[path = "volumes/levels.rs"]
mod levels;
#[path = "volumes/scans.rs"]
mod scans;
#[path = "volumes/stores.rs"]
mod stores;
#[path = "volumes/words.rs"]
mod words;
#[path = "volumes/writers.rs"]
mod writers;
