//! Tomography: what its techniques share. Geometry of measurements, sinograms, phantoms with exact line integrals, filters.

mod data_check;
mod encode;
mod filter;
mod geometry;
mod geometry_request;
mod meta;
mod phantom;
mod shape;
mod shepp_logan;
mod sinogram;
mod transmission;

pub use data_check::{DataCheck, Moments};
pub use filter::{Filter, Filtering};
pub use geometry::Geometry;
pub use geometry_request::{AnglesRequest, GeometryRequest};
pub use meta::{Quantity, SinogramMeta};
pub use phantom::{Phantom, PhantomRequest};
pub use shape::{Ray, Shape, ShapeRequest};
pub use sinogram::{Sinogram, SinogramInfo, SinogramParts};
