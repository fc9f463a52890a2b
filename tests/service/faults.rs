//! Broken and hostile input: each is told what is wrong in a problem document, and the service lives on.

mod bodies;
mod cameras;
mod fields;
mod films;
mod protocol;
mod survival;
mod voxels;
