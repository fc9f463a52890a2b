//! The camera as the HTTP contract describes it, and pictures of a function of rays.

use glam::DVec3;
use serde_json::{Value, json};

/// The number of sub-pixels along a side of a pixel, for the mean over it.
const SUB_PIXELS: usize = 8;

/// A camera of parallel rays that looks at the origin.
#[derive(Debug, Clone, Copy)]
pub struct Eye {
    /// The position of the camera.
    pub eye: DVec3,
    /// The side of the visible square, world units.
    pub wide: f64,
}

impl Eye {
    fn up(&self) -> DVec3 {
        if self.eye.normalize().y.abs() > 0.9 { DVec3::X } else { DVec3::Y }
    }

    /// The value of a request's `camera`.
    pub fn json(&self) -> Value {
        let fov = 2.0 * (0.5 * self.wide / self.eye.length()).atan().to_degrees();
        json!({"eye": self.eye.to_array(), "target": [0, 0, 0], "up": self.up().to_array(), "fov_y_deg": fov, "projection": "orthographic"})
    }

    /// The direction of all rays.
    pub fn forward(&self) -> DVec3 {
        -self.eye.normalize()
    }

    /// The origin of the ray of a place in the picture, from 0 to 1, left to right and top to bottom.
    pub fn origin(&self, x: f64, y: f64) -> DVec3 {
        let forward = self.forward();
        let right = forward.cross(self.up()).normalize();
        let up = right.cross(forward);
        self.eye + right * (x - 0.5) * self.wide - up * (y - 0.5) * self.wide
    }

    /// The values of `of` (a ray's origin) at the centres of `side` × `side` pixels, and their means over the pixels.
    pub fn picture(&self, side: usize, of: impl Fn(DVec3) -> f64) -> [Vec<f64>; 2] {
        let at = |x: f64, y: f64| of(self.origin(x / side as f64, y / side as f64));
        let pixels = || (0..side * side).map(|i| ((i % side) as f64, (i / side) as f64));
        let centres = pixels().map(|(x, y)| at(x + 0.5, y + 0.5)).collect();
        let sub = |i: usize| (i as f64 + 0.5) / SUB_PIXELS as f64;
        let mean = |(x, y): (f64, f64)| {
            let all = (0..SUB_PIXELS * SUB_PIXELS).map(|i| at(x + sub(i % SUB_PIXELS), y + sub(i / SUB_PIXELS)));
            all.sum::<f64>() / (SUB_PIXELS * SUB_PIXELS) as f64
        };
        [centres, pixels().map(mean).collect()]
    }
}

/// The part of a ray inside the box of half size `half`, as distances from its origin.
pub fn inside(origin: DVec3, direction: DVec3, half: DVec3) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (origin[axis], direction[axis]);
        if d.abs() < 1e-15 {
            if o.abs() > half[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[axis] - o) / d, (half[axis] - o) / d);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (far > near).then_some((near, far))
}
