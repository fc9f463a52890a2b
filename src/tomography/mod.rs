//! Tomography: what its techniques share. Geometry of measurements, phantoms with exact line integrals, filters.

mod data_check;
mod filter;
mod geometry;
mod phantom;
mod shape;
mod shepp_logan;

pub use data_check::{DataCheck, Moments};
pub use filter::{Filter, Filtering};
pub use geometry::{AnglesRequest, Geometry, GeometryRequest};
pub use phantom::{Phantom, PhantomRequest};
pub use shape::{Ray, Shape, ShapeRequest};
