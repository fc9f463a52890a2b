//! Broken and hostile input: each is told what is wrong in a problem document, and the service lives on.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

#[path = "faults/bodies.rs"]
mod bodies;
#[path = "faults/cameras.rs"]
mod cameras;
#[path = "faults/fields.rs"]
mod fields;
#[path = "faults/films.rs"]
mod films;
#[path = "faults/protocol.rs"]
mod protocol;
#[path = "api/support.rs"]
mod support;
#[path = "faults/survival.rs"]
mod survival;
#[path = "faults/voxels.rs"]
mod voxels;
#[path = "volumes/writers.rs"]
#[allow(dead_code, reason = "the volume tests use the rest")]
mod writers;
