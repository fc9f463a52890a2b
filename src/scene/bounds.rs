//! The box around a scene's subject, with the grid through which it is seen.

use glam::{DAffine3, DMat3, DVec3};

use crate::volume::Volume;

/// A plane of voxels is a sheet if its depth is less than this part of its other sides.
const SHEET: f64 = 0.1;

/// A box in the world and its number of cells along each axis. A volume's cells are its voxels; a box without a volume has one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// World from index: the box is `[0, dims]` in index units.
    world_from_index: DAffine3,
    dims: [usize; 3],
    /// True if its world axes are a patient's.
    scan: bool,
}

impl Bounds {
    /// A box given by its transform and cells; `scan` is true if its world axes are a patient's.
    pub fn new(world_from_index: DAffine3, dims: [usize; 3], scan: bool) -> Self {
        Self { world_from_index, dims, scan }
    }

    /// The box between two corners, of one cell.
    pub fn of_corners(low: DVec3, high: DVec3) -> Self {
        let world_from_index = DAffine3 { matrix3: DMat3::from_diagonal(high - low), translation: low };
        Self::new(world_from_index, [1; 3], false)
    }

    /// The transform from index units to the world.
    pub fn world_from_index(&self) -> DAffine3 {
        self.world_from_index
    }

    /// The number of cells along each axis.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The sides of a cell, world units.
    pub fn spacing(&self) -> [f64; 3] {
        let linear = self.world_from_index.matrix3;
        [linear.x_axis.length(), linear.y_axis.length(), linear.z_axis.length()]
    }

    /// The smallest side of a cell, world units.
    pub fn smallest_side(&self) -> f64 {
        self.spacing().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The radius of the sphere around the box, world units.
    pub fn radius(&self) -> f64 {
        let [x, y, z] = self.dims.map(|n| n as f64);
        0.5 * self.world_from_index.transform_vector3(DVec3::new(x, y, z)).length()
    }

    /// Its corners in the world.
    pub fn corners(&self) -> [DVec3; 8] {
        let corner = |i: usize| {
            let pick = |axis: usize| if i >> axis & 1 == 1 { self.dims[axis] as f64 } else { 0.0 };
            self.world_from_index.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        };
        std::array::from_fn(corner)
    }

    /// The up direction: z for a scan, y for a subject without a patient.
    pub fn up(&self) -> DVec3 {
        if self.scan { DVec3::Z } else { DVec3::Y }
    }

    /// The direction from the centre to the eye. It shows a patient's face a little from the side and above, and a built-in from the open
    /// side of the chamber. A single plane of voxels across z, such as a reconstructed one, is seen from +z, with x to the right.
    pub fn direction(&self) -> DVec3 {
        let [x, y, z] = std::array::from_fn(|axis| self.dims[axis] as f64 * self.spacing()[axis]);
        match self.scan {
            true => DVec3::new(-0.55, 1.0, 0.3).normalize(),
            false if self.dims[2] == 1 && z < SHEET * x.min(y) => DVec3::Z,
            false => DVec3::new(0.45, 0.32, -1.0).normalize(),
        }
    }

    /// The distance at which every corner is inside a square picture, with a margin of 4 %.
    pub fn distance(&self, up: DVec3, fov_y_deg: f64) -> f64 {
        let back = self.direction();
        let right = up.cross(back).normalize_or(DVec3::X);
        let across = back.cross(right);
        let tangent = (0.5 * fov_y_deg.to_radians()).tan();
        let needs = |c: &DVec3| c.dot(right).abs().max(c.dot(across).abs()) / tangent + c.dot(back);
        1.04 * self.corners().iter().map(needs).fold(f64::MIN_POSITIVE, f64::max)
    }
}

impl From<&Volume> for Bounds {
    fn from(volume: &Volume) -> Self {
        Self::new(volume.world_from_index(), volume.dims(), !matches!(volume.format(), "builtin" | "field"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_between_two_corners_has_them() {
        let [low, high] = [DVec3::new(-1.0, 0.5, 2.0), DVec3::new(3.0, 1.0, 4.0)];
        let bounds = Bounds::of_corners(low, high);
        assert_eq!([bounds.corners()[0], bounds.corners()[7]], [low, high]);
        assert_eq!(bounds.spacing(), [4.0, 0.5, 2.0]);
        assert_eq!(bounds.smallest_side(), 0.5);
        assert!((bounds.radius() - 0.5 * (high - low).length()).abs() < 1e-12);
    }

    #[test]
    fn a_sheet_is_seen_from_the_front() {
        let of =
            |depth: f64| Bounds::of_corners(DVec3::new(-10.0, -8.0, 0.0), DVec3::new(10.0, 8.0, depth)).direction();
        assert_eq!(of(1.0), DVec3::Z);
        assert!(of(2.0).z < 0.0 && of(16.0).z < 0.0);
    }
}
