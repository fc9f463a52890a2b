//! `isosurface` against a double-precision host reference of where rays cross, closed forms of light and layers, and what is asked.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

#[path = "isosurface/agreement.rs"]
mod agreement;
#[path = "isosurface/asked.rs"]
mod asked;
#[path = "isosurface/cameras.rs"]
mod cameras;
#[path = "isosurface/convergence.rs"]
mod convergence;
#[path = "isosurface/depth.rs"]
mod depth;
#[path = "isosurface/falling.rs"]
mod falling;
#[allow(dead_code, reason = "of another technique's reference, the grid and its interpolants")]
#[path = "projection/grid.rs"]
mod grid;
#[path = "isosurface/layers.rs"]
mod layers;
#[path = "isosurface/light.rs"]
mod light;
#[path = "isosurface/marschner_lobb.rs"]
mod marschner_lobb;
#[path = "isosurface/occlusion.rs"]
mod occlusion;
#[allow(dead_code, reason = "of another technique's reference, the camera and the box")]
#[path = "emission_absorption/oracle.rs"]
mod rays;
#[path = "isosurface/skewed.rs"]
mod skewed;
#[path = "isosurface/thick.rs"]
mod thick;
#[path = "isosurface/voids.rs"]
mod voids;
#[allow(dead_code, reason = "only the files' headers and the random numbers are wanted here")]
#[path = "volumes/writers.rs"]
mod writers;
