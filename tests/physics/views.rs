//! Pictures of the same thing from elsewhere, on other grids and between the voxels.

mod interpolations;
mod places;
mod proportions;
mod support;
mod turned;
mod words;
