//! Volumes: read, built, measured and kept; and what hostile files do to the reader, which is nothing.

mod builtins;
mod formats;
mod grids;
mod hostile;
mod levels;
mod scans;
mod stores;
mod words;
