//! The values of voxels, whatever their type.

use super::{Volume, Voxels};

/// The values of a volume's voxels, scaled.
#[derive(Clone, Copy)]
pub struct Values<'a> {
    pub(super) volume: &'a Volume,
    pub(super) voxels: &'a Voxels,
}

impl Values<'_> {
    /// The value of voxel (x, y, z); NaN if it has none, or outside of the grid.
    pub fn at(&self, x: usize, y: usize, z: usize) -> f64 {
        let [nx, ny, nz] = self.volume.dims();
        if x >= nx || y >= ny || z >= nz { f64::NAN } else { self.of(x + nx * (y + ny * z)) }
    }

    /// The value of voxel `i` in memory; NaN if it has none, or past the end.
    pub fn of(&self, i: usize) -> f64 {
        f64::from(self.voxels.get_f32(i)) * self.volume.slope() + self.volume.inter()
    }
}
