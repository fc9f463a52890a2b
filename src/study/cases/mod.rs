//! The cases: one file each, one line here.

mod beer_lambert;
mod ellipsoid;
mod half_space;
mod isosurface;
mod slab;

use super::Case;

/// Every case.
pub const CASES: &[Case] = &[
    beer_lambert::CASE,
    slab::CASE,
    half_space::CASE,
    isosurface::SPHERE,
    isosurface::MARSCHNER_LOBB,
    ellipsoid::MEAN,
    ellipsoid::XRAY,
];
