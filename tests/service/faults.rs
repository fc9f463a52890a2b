//! Broken and hostile input: each gets a problem document with its fault, and the service goes on.

mod bodies;
mod cameras;
mod fields;
mod films;
mod protocol;
mod survival;
mod voxels;
