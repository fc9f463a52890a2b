//! The camera: validated, in double precision, with the view that the device gets of it.

use glam::{DMat3, DMat4, DVec3};

use super::bounds::Bounds;
use crate::device::structs::View;
use crate::error::{Error, Result};
use crate::request::CameraRequest;
use crate::volume::Volume;

/// The vertical angle of view if none is given: the contract's 53.13 degrees, twice the angle whose tangent is a half.
const DEFAULT_FOV_Y_DEG: f64 = 53.13;
/// The greatest deviation of a rotation's columns from orthonormal. A client's single-precision matrix is within it.
const RIGID_TOLERANCE: f64 = 1e-3;

/// A valid camera. Directions are unit vectors in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    eye: DVec3,
    target: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    fov_y_deg: f64,
    perspective: bool,
}

fn finite(v: [f64; 3], at: &str) -> Result<DVec3> {
    let v = DVec3::from(v);
    if v.is_finite() && v.abs().max_element() <= 1e13 {
        Ok(v)
    } else {
        Err(Error::invalid(at, "out of range", "-1e13 to 1e13"))
    }
}

impl Camera {
    /// A camera from a request. It frames the box in the fields that the request leaves out.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `/camera`.
    pub fn from_request(request: Option<&CameraRequest>, bounds: &Bounds) -> Result<Self> {
        let empty = CameraRequest::default();
        let r = request.unwrap_or(&empty);
        let fov_y_deg = r.fov_y_deg.unwrap_or(DEFAULT_FOV_Y_DEG);
        let perspective = r.projection.as_deref() != Some("orthographic");
        if let Some(matrix) = &r.camera_to_world {
            for (given, name) in [(r.eye.is_some(), "eye"), (r.target.is_some(), "target"), (r.up.is_some(), "up")] {
                if given {
                    let permitted = "either camera_to_world, or eye with target and up";
                    return Err(Error::invalid(format!("/camera/{name}"), "given beside camera_to_world", permitted));
                }
            }
            return Self::from_matrix(matrix, fov_y_deg, perspective);
        }
        let target = r.target.map_or(Ok(DVec3::ZERO), |t| finite(t, "/camera/target"))?;
        let up = r.up.map_or(Ok(bounds.up()), |u| finite(u, "/camera/up"))?;
        let eye = match r.eye {
            Some(eye) => finite(eye, "/camera/eye")?,
            None => target + bounds.direction() * bounds.distance(up, fov_y_deg),
        };
        Self::look_at(eye, target, up, fov_y_deg, perspective)
    }

    fn look_at(eye: DVec3, target: DVec3, up: DVec3, fov_y_deg: f64, perspective: bool) -> Result<Self> {
        let Some(forward) = (target - eye).try_normalize() else {
            return Err(Error::invalid("/camera/eye", "the eye is at the target", "a point other than target"));
        };
        let Some(right) =
            up.try_normalize().map(|u| forward.cross(u)).filter(|r| r.length() > 1e-6).map(DVec3::normalize)
        else {
            return Err(Error::invalid(
                "/camera/up",
                "up is zero or along the view direction",
                "a direction across the view direction",
            ));
        };
        Ok(Self { eye, target, right, up: right.cross(forward), forward, fov_y_deg, perspective })
    }

    /// `m` is column-major with the camera looking along -z.
    fn from_matrix(m: &[f64], fov_y_deg: f64, perspective: bool) -> Result<Self> {
        let at = "/camera/camera_to_world";
        let columns: [f64; 16] =
            m.try_into().map_err(|_| Error::invalid(at, "wrong number of elements", "16 numbers"))?;
        let matrix = DMat4::from_cols_array(&columns);
        let rotation = DMat3::from_mat4(matrix);
        let rigid = "a rigid transform: orthonormal axes, no scale, no mirror, last row 0 0 0 1";
        if !matrix.is_finite() || columns.iter().any(|c| c.abs() > 1e13) {
            return Err(Error::invalid(at, "not finite or out of range", "numbers from -1e13 to 1e13"));
        }
        if rotation.determinant().abs() < 1e-9 {
            return Err(Error::invalid(at, "the matrix is singular", rigid));
        }
        let skew = (rotation.transpose() * rotation - DMat3::IDENTITY)
            .to_cols_array()
            .into_iter()
            .fold(0.0, |m: f64, e| m.max(e.abs()));
        let last_row = [columns[3], columns[7], columns[11], columns[15] - 1.0];
        if skew > RIGID_TOLERANCE || rotation.determinant() < 0.0 || last_row.iter().any(|e| e.abs() > RIGID_TOLERANCE)
        {
            return Err(Error::invalid(at, "the matrix scales, shears, mirrors or projects", rigid));
        }
        let eye = matrix.w_axis.truncate();
        let (right, forward) = (rotation.x_axis.normalize(), -rotation.z_axis.normalize());
        // At the origin any distance does.
        let reach = if eye == DVec3::ZERO { 1.0 } else { eye.length() };
        let target = eye + forward * reach;
        Ok(Self { eye, target, right, up: right.cross(forward), forward, fov_y_deg, perspective })
    }

    /// The camera as a client would send it: eye, target, up and angle.
    pub fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "eye": self.eye.to_array(), "target": self.target.to_array(), "up": self.up.to_array(),
            "fov_y_deg": self.fov_y_deg, "projection": if self.perspective { "perspective" } else { "orthographic" },
        })
    }

    /// True if what another camera sees is much alike: it looks in a direction less than 15° away, from less than a quarter of the distance to the
    /// target away, with much the same angle.
    pub fn is_near(&self, other: &Self) -> bool {
        let (turn, way) = (self.forward.dot(other.forward), self.eye.distance(other.eye));
        let angle = self.fov_y_deg / other.fov_y_deg;
        let alike = self.perspective == other.perspective && (0.8..1.25).contains(&angle);
        alike && turn > 15f64.to_radians().cos() && way < 0.25 * self.eye.distance(self.target)
    }

    /// The unit vector from the scene towards the eye, from which a headlight shines.
    pub fn towards_eye(&self) -> DVec3 {
        -self.forward
    }

    /// The height of the visible section at the distance of the target, world units.
    pub fn height_at_target(&self) -> f64 {
        2.0 * (self.target - self.eye).length() * (0.5 * self.fov_y_deg.to_radians()).tan()
    }

    /// The device's view of an image of `size` pixels of a box: the plane near the box and its pixels. It is computed in double precision,
    /// so that a far eye costs no digits. Its first pixel is the one at `left`, `top`. The fields of the pass are left at zero.
    pub(crate) fn device_view(&self, size: [u32; 2], [left, top]: [u32; 2], bounds: &Bounds) -> View {
        let index_from_world = bounds.world_from_index().inverse();
        let radius = bounds.radius();
        // The plane goes through the box's centre; an eye inside or behind gets one just ahead of it instead.
        let ahead = (-self.eye.dot(self.forward)).max(0.1 * radius);
        let reach = if self.perspective { ahead } else { (self.target - self.eye).length() };
        let pixel = 2.0 * reach * (0.5 * self.fov_y_deg.to_radians()).tan() / f64::from(size[1]);
        let (right, down) = (self.right * pixel, -self.up * pixel);
        let from_middle = |pixel: u32, size: u32| f64::from(pixel) - f64::from(size) / 2.0;
        let corner = right * from_middle(left, size[0]) + down * from_middle(top, size[1]);
        let plane_centre = self.eye + self.forward * ahead;
        let towards = if self.perspective { self.forward * ahead + corner } else { self.forward };
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let linear = |v: DVec3| narrow(index_from_world.transform_vector3(v));
        View {
            plane: narrow(index_from_world.transform_point3(plane_centre + corner)),
            right: linear(right),
            down: linear(down),
            towards: linear(towards),
            towards_world: narrow(towards),
            right_world: narrow(right),
            down_world: narrow(down),
            t_eye: ahead as f32,
            perspective: if self.perspective { -1 } else { 0 },
            dims: bounds.dims().map(|n| n as i32),
            // A gradient is a covector: it goes to the world by the transpose of index-from-world. The sign of the slope does
            // not matter, since lights are two-sided.
            world_gradient_from_index: bounds.world_from_index().matrix3.inverse().to_cols_array().map(|v| v as f32),
            isotropic_squared: isotropic_squared(bounds),
            jittered: 1,
            place: 0.5,
            ..View::default()
        }
    }
}

/// See [`View::isotropic_squared`].
fn isotropic_squared(bounds: &Bounds) -> f32 {
    let from_index = bounds.world_from_index().matrix3.inverse();
    let square = from_index * from_index.transpose();
    let side = square.x_axis.x;
    let even = (square - DMat3::from_diagonal(DVec3::splat(side))).abs_diff_eq(DMat3::ZERO, 1e-6 * side);
    if even { side as f32 } else { 0.0 }
}

/// [`View::flat_squared`] of a volume: the squared gradient that rounding alone may cause, if values are interpolated to about 2^-15 of
/// their range.
pub(crate) fn flat_squared(volume: &Volume) -> f32 {
    let [low, high] = volume.range();
    let voxel = volume.smallest_side();
    (3e-5 * (high - low) / volume.slope().abs() / voxel).powi(2) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_picture_is_seen_as_in_the_whole() -> Result<()> {
        let bounds = Bounds::from(&crate::volume::builtin::build("sphere", 16, 0)?);
        for perspective in [true, false] {
            let (eye, up) = (DVec3::new(0.7, 0.5, 3.0), DVec3::Y);
            let camera = Camera::look_at(eye, DVec3::new(0.1, 0.0, 0.0), up, 40.0, perspective)?;
            let [whole, part] = [[0, 0], [30, 7]].map(|corner| camera.device_view([64, 48], corner, &bounds));
            for axis in 0..3 {
                let moved = 30.0 * whole.right[axis] + 7.0 * whole.down[axis];
                assert!(
                    (part.plane[axis] - whole.plane[axis] - moved).abs() < 1e-4,
                    "{:?}, {:?}",
                    part.plane,
                    whole.plane
                );
                let rotated = if perspective { moved } else { 0.0 };
                assert!((part.towards[axis] - whole.towards[axis] - rotated).abs() < 1e-4, "{:?}", part.towards);
            }
        }
        Ok(())
    }
}
