//! The cases: one file each, one line here.

mod beer_lambert;
mod chamber;
mod cloud;
mod composite;
mod ellipsoid;
mod fbp;
mod half_space;
mod isosurface;
mod project;
pub mod scattering;
mod slab;

use super::Case;

/// Every case.
pub const CASES: &[Case] = &[
    beer_lambert::CASE,
    slab::CASE,
    chamber::CASE,
    cloud::CASE,
    scattering::THIN,
    scattering::MEDIUM,
    scattering::THICK,
    half_space::CASE,
    isosurface::SPHERE,
    isosurface::MARSCHNER_LOBB,
    composite::CASE,
    ellipsoid::MEAN,
    ellipsoid::XRAY,
    fbp::CASE,
    project::CASE,
];
