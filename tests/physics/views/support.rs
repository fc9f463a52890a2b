//! Volumes with a spacing, and a camera whose projection is worked out here rather than taken from the program.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;

/// A raw volume of floats. `value` is called at voxel centres, in world units from the volume's centre.
pub fn grid(dims: [usize; 3], spacing: [f64; 3], value: impl Fn(DVec3) -> f64) -> Value {
    let mut bytes = Vec::new();
    let centre = |axis: usize, i: usize| (i as f64 - (dims[axis] as f64 - 1.0) / 2.0) * spacing[axis];
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                let v = value(dvec3(centre(0, x), centre(1, y), centre(2, z))) as f32;
                bytes.extend_from_slice(&v.to_le_bytes());
            }
        }
    }
    let query = cloudchamber::volume::RawQuery {
        dims: Some(dims.map(|n| n.to_string()).join(",")),
        r#type: Some("f32".into()),
        spacing: Some(spacing.map(|s| s.to_string()).join(",")),
        endian: None,
    };
    let (_, id, _) = House::shared().assets().volumes().insert(bytes, "views", query.parse().unwrap()).unwrap();
    json!({"id": id})
}

/// A camera that looks at `target`, with a square picture.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    pub eye: DVec3,
    pub target: DVec3,
    pub up: DVec3,
    /// The height of the picture at the target, world units.
    pub span: f64,
    pub perspective: bool,
}

impl Camera {
    /// An orthographic camera that looks at the origin, with y up, or else z.
    pub fn orthographic(eye: DVec3, span: f64) -> Self {
        let up = if eye.normalize().y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
        Self { eye, target: DVec3::ZERO, up, span, perspective: false }
    }

    pub fn json(&self) -> Value {
        let reach = (self.target - self.eye).length();
        json!({
            "eye": self.eye.to_array(), "target": self.target.to_array(), "up": self.up.to_array(),
            "fov_y_deg": 2.0 * (0.5 * self.span / reach).atan().to_degrees(),
            "projection": if self.perspective { "perspective" } else { "orthographic" }
        })
    }

    /// The directions to the right, up and ahead.
    pub fn axes(&self) -> (DVec3, DVec3, DVec3) {
        let ahead = (self.target - self.eye).normalize();
        let right = ahead.cross(self.up).normalize();
        (right, right.cross(ahead), ahead)
    }

    /// The place of a world point in a picture of `side` pixels: column and row, with pixel centres at whole numbers.
    pub fn project(&self, p: DVec3, side: usize) -> (f64, f64) {
        let (right, up, ahead) = self.axes();
        let from = p - self.eye;
        let reach = (self.target - self.eye).length();
        let shrink = if self.perspective { reach / from.dot(ahead) } else { 1.0 };
        let pixel = self.span / side as f64;
        let middle = (side as f64 - 1.0) / 2.0;
        (middle + from.dot(right) * shrink / pixel, middle - from.dot(up) * shrink / pixel)
    }

    /// The middle of an orthographic camera's pixel, on the plane through the target.
    pub fn through(&self, pixel: usize, side: usize) -> DVec3 {
        let (right, up, _) = self.axes();
        let place = |i: usize| ((i as f64 + 0.5) / side as f64 - 0.5) * self.span;
        self.target + right * place(pixel % side) - up * place(pixel / side)
    }
}

/// The request of one sample a pixel. `parameters` go under the technique's name.
pub fn request(technique: &str, volume: &Value, camera: &Value, side: usize, parameters: Value) -> Value {
    json!({
        "technique": technique, "volume": volume, "camera": camera, "image": {"width": side, "height": side},
        "budget": {"samples": 1}, technique: parameters
    })
}

/// The four numbers of each pixel of the finished picture.
pub fn pixels(request: &Value) -> Vec<[f32; 4]> {
    let (film, _) = House::shared().film(request);
    assert!(film.main.mean.iter().all(|v| v.is_finite()), "{request}");
    film.main.mean.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
}
