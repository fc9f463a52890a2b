//! The parts of a scene: camera, clipping planes, transfer function, window, medium, lights. Each part is made from its wire type and is
//! valid from then on.

pub mod bounds;
pub mod camera;
pub mod clip;
pub mod depth;
pub mod interpolation;
pub mod labels;
pub mod light;
mod light_source;
pub mod lights;
pub mod medium;
pub mod phase;
pub mod presets;
pub mod transfer;
mod transfer_layout;
mod transfer_request;
pub mod transfer_table;
pub mod window;

use crate::volume::Volume;

/// The mean side of a volume's box, world units.
pub(crate) fn mean_side(volume: &Volume) -> f64 {
    let side = |axis: usize| volume.dims()[axis] as f64 * volume.spacing()[axis];
    (side(0) + side(1) + side(2)) / 3.0
}
