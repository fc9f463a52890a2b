//! Pictures of the same thing from elsewhere, on other grids and between the voxels.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "views/interpolations.rs"]
mod interpolations;
#[path = "views/places.rs"]
mod places;
#[path = "views/proportions.rs"]
mod proportions;
#[path = "views/support.rs"]
mod support;
#[path = "views/turned.rs"]
mod turned;
#[path = "views/words.rs"]
mod words;
#[allow(dead_code, reason = "only the NIfTI header is wanted here")]
#[path = "volumes/writers.rs"]
mod writers;
