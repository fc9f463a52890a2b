//! The part of a volume that is shown: clipping planes and a crop box, the same for every view.

use glam::DVec3;

use super::bounds::Bounds;
use crate::device::structs::{PLANES, View};
use crate::error::{Error, Result};
use crate::request::ClipRequest;

/// Valid planes: n · p + d is not negative where the volume is shown; world units.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clip {
    planes: Vec<(DVec3, f64)>,
}

impl Clip {
    /// Checks a request.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `/clip`.
    pub fn from_request(request: Option<&ClipRequest>) -> Result<Self> {
        let Some(request) = request else { return Ok(Self::default()) };
        let mut planes = Vec::new();
        for (i, plane) in request.planes.iter().flatten().enumerate() {
            let at = format!("/clip/planes/{i}/normal");
            let normal = DVec3::from(plane.normal)
                .try_normalize()
                .ok_or_else(|| Error::invalid(at, "the normal is zero", "a direction of any length"))?;
            planes.push((normal, -normal.dot(DVec3::from(plane.point))));
        }
        if let Some(crop) = &request.crop {
            for axis in 0..3 {
                if crop.max[axis] <= crop.min[axis] {
                    let permitted = format!("more than {}", crop.min[axis]);
                    return Err(Error::invalid(format!("/clip/box/max/{axis}"), "the box is empty", permitted));
                }
                planes.push((DVec3::AXES[axis], -crop.min[axis]));
                planes.push((-DVec3::AXES[axis], crop.max[axis]));
            }
        }
        Ok(Self { planes })
    }

    /// True if the planes remove the whole box: all its corners are on the wrong side of one plane.
    pub fn removes_all(&self, bounds: &Bounds) -> bool {
        let corners = bounds.corners();
        self.planes.iter().any(|(n, d)| corners.iter().all(|corner| n.dot(*corner) + d <= 0.0))
    }

    /// Writes the planes into the device's view, in index units.
    pub fn apply(&self, bounds: &Bounds, view: &mut View) {
        let world_from_index = bounds.world_from_index();
        view.planes = self.planes.len().min(PLANES) as i32;
        for (i, (n, d)) in self.planes.iter().take(PLANES).enumerate() {
            let normal = world_from_index.matrix3.transpose() * *n;
            let offset = n.dot(world_from_index.translation) + d;
            let numbers = [normal.x, normal.y, normal.z, offset].map(|v| (v / normal.length()) as f32);
            view.plane_index[4 * i..4 * i + 4].copy_from_slice(&numbers);
        }
    }
}
