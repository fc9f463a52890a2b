//! Pictures of the same subject from elsewhere, on other grids and between the voxels.

mod interpolations;
mod places;
mod proportions;
mod support;
mod turned;
mod words;
