//! What `single_scatter` and `volume_path` share: their parameters, and the plan made of them.

mod device;
mod parameters;
mod plan;

pub use device::Scattering;
pub use parameters::{Majorant, Parameters, Tracking};
pub(super) use plan::{Scatterer, source};
