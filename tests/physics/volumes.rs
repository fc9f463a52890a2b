//! Volumes: read, built, measured and kept; and hostile files, which do nothing to the reader.

mod builtins;
mod contents;
mod formats;
mod grids;
mod hostile;
mod levels;
mod scans;
mod stores;
mod words;
