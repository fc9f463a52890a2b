//! The truth of a ray in double precision, written anew from the definitions: the camera, the box, the samples.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

/// A camera as the contract describes it.
#[derive(Clone, Copy)]
pub struct Eye {
    pub eye: DVec3,
    pub target: DVec3,
    pub up: DVec3,
    pub fov_y_deg: f64,
}

impl Eye {
    pub fn at(eye: [f64; 3], fov_y_deg: f64) -> Self {
        let eye = DVec3::from(eye);
        let up = if eye.normalize().y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
        Self { eye, target: DVec3::ZERO, up, fov_y_deg }
    }

    pub fn json(&self) -> Value {
        json!({"eye": self.eye.to_array(), "target": self.target.to_array(), "up": self.up.to_array(), "fov_y_deg": self.fov_y_deg})
    }

    /// The direction through the centre of a pixel.
    pub fn direction(&self, column: usize, row: usize, side: usize) -> DVec3 {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let half = (self.fov_y_deg.to_radians() / 2.0).tan();
        let place = |i: usize| ((i as f64 + 0.5) / side as f64 * 2.0 - 1.0) * half;
        (forward + right * place(column) - up * place(row)).normalize()
    }
}

/// The part of a ray inside the box of half size `half`, as distances from the eye.
pub fn inside(eye: DVec3, direction: DVec3, half: DVec3) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (o, d) = (eye[axis], direction[axis]);
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

/// Trilinear interpolation of `n`³ voxels with centres at (i + ½) / n on [−1, 1], constant outside the outermost.
pub fn trilinear(voxels: &dyn Fn(usize, usize, usize) -> f64, n: usize, p: DVec3) -> f64 {
    let at = ((p + 1.0) * (n as f64 / 2.0) - 0.5).clamp(DVec3::ZERO, DVec3::splat((n - 1) as f64));
    let low = [at.x, at.y, at.z].map(|v| (v as usize).min(n - 2));
    let f = at - dvec3(low[0] as f64, low[1] as f64, low[2] as f64);
    let mut sum = 0.0;
    for corner in 0..8 {
        let bit = |axis: usize| corner >> axis & 1;
        let weight = |axis: usize| if bit(axis) == 1 { f[axis] } else { 1.0 - f[axis] };
        sum += weight(0) * weight(1) * weight(2) * voxels(low[0] + bit(0), low[1] + bit(1), low[2] + bit(2));
    }
    sum
}

/// Emission and absorption along a ray by very many midpoints: red, green, blue and opacity.
pub fn march(
    value: &dyn Fn(DVec3) -> f64,
    optics: &dyn Fn(f64) -> ([f64; 3], f64),
    eye: DVec3,
    d: DVec3,
    steps: usize,
) -> [f64; 4] {
    let Some((near, far)) = inside(eye, d, DVec3::ONE) else { return [0.0; 4] };
    let ds = (far - near) / steps as f64;
    let (mut colour, mut through) = ([0.0; 3], 1.0);
    for k in 0..steps {
        let (c, sigma) = optics(value(eye + d * (near + (k as f64 + 0.5) * ds)));
        let alpha = 1.0 - (-sigma * ds).exp();
        colour.iter_mut().zip(c).for_each(|(sum, c)| *sum += through * alpha * c);
        through *= 1.0 - alpha;
    }
    [colour[0], colour[1], colour[2], 1.0 - through]
}
