//! The values along a ray through a grid on [−1, 1]³, in double precision and written anew from the definitions.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::emission_absorption::oracle::{Eye, inside};

pub const SIDE: usize = 24;

pub struct Grid {
    pub dims: [usize; 3],
    pub voxels: Vec<f32>,
}

/// Numbers from 0 to 1 that look random.
pub fn noise(i: usize) -> f32 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x ^= x >> 29;
    x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (x >> 40) as f32 / (1u64 << 24) as f32
}

impl Grid {
    pub fn random(dims: [usize; 3]) -> Self {
        Self { dims, voxels: (0..dims.iter().product()).map(noise).collect() }
    }

    pub fn store(&self, house: &House) -> Value {
        let [nx, ny, _] = self.dims;
        house.floats(self.dims, |x, y, z| {
            let i = |p: f64, n: usize| ((p + 1.0) * 0.5 * n as f64) as usize;
            f64::from(self.voxels[i(x, nx) + nx * (i(y, ny) + ny * i(z, self.dims[2]))])
        })
    }

    fn voxel(&self, at: [i64; 3]) -> f64 {
        let i: [usize; 3] = std::array::from_fn(|a| at[a].clamp(0, self.dims[a] as i64 - 1) as usize);
        f64::from(self.voxels[i[0] + self.dims[0] * (i[1] + self.dims[1] * i[2])])
    }

    /// The interpolant at a point: sums of voxels times weights along each axis. A NaN among them makes it NaN.
    pub fn value(&self, p: DVec3, interpolation: &str) -> f64 {
        let u = (p + 1.0) * 0.5 * dvec3(self.dims[0] as f64, self.dims[1] as f64, self.dims[2] as f64);
        if interpolation == "nearest" {
            return self.voxel(u.floor().to_array().map(|v| v as i64));
        }
        let low = (u - 0.5).floor();
        let f = u - 0.5 - low;
        let (first, weights) = match interpolation {
            "trilinear" => (0, f.to_array().map(|f| vec![1.0 - f, f])),
            "b_spline" => (-1, f.to_array().map(|f| (0..4).map(|i| b_spline(f + 1.0 - f64::from(i))).collect())),
            _ => (-1, f.to_array().map(|f| (0..4).map(|i| catmull_rom(f + 1.0 - f64::from(i))).collect())),
        };
        let mut sum = 0.0;
        for (k, wz) in weights[2].iter().enumerate() {
            for (j, wy) in weights[1].iter().enumerate() {
                for (i, wx) in weights[0].iter().enumerate() {
                    let at = [i, j, k].map(|v| v as i64 + first);
                    sum += wx * wy * wz * self.voxel(std::array::from_fn(|a| at[a] + low[a] as i64));
                }
            }
        }
        sum
    }

    /// The places along a ray at which the interpolant changes its polynomial, with the ray's ends.
    fn stretches(&self, eye: DVec3, d: DVec3, interpolation: &str) -> Vec<f64> {
        let Some((near, far)) = inside(eye, d, DVec3::ONE) else { return Vec::new() };
        let shift = if interpolation == "nearest" { 0.0 } else { 0.5 };
        let mut t = vec![near, far];
        for axis in 0..3 {
            for i in 0..self.dims[axis] {
                let plane = (i as f64 + shift) / self.dims[axis] as f64 * 2.0 - 1.0;
                let at = (plane - eye[axis]) / d[axis];
                if at > near && at < far {
                    t.push(at);
                }
            }
        }
        t.sort_by(f64::total_cmp);
        t
    }

    /// ∫ v ds and the length that has a value, by many points of Gauss's rule in every stretch.
    pub fn integral(&self, eye: DVec3, d: DVec3, interpolation: &str) -> (f64, f64) {
        let (mut sum, mut length) = (0.0, 0.0);
        for pair in self.stretches(eye, d, interpolation).windows(2) {
            let ds = (pair[1] - pair[0]) / 8.0;
            let at = |i: usize, g: f64| self.value(eye + d * (pair[0] + (i as f64 + g) * ds), interpolation);
            let (a, b) = (0.5 - 0.15f64.sqrt(), 0.5 + 0.15f64.sqrt());
            let part: f64 = (0..8).map(|i| (5.0 * at(i, a) + 8.0 * at(i, 0.5) + 5.0 * at(i, b)) / 18.0 * ds).sum();
            if !part.is_nan() {
                sum += part;
                length += 8.0 * ds;
            }
        }
        (sum, length)
    }

    /// The greatest value along a ray, by a fine scan of every stretch.
    pub fn greatest(&self, eye: DVec3, d: DVec3, interpolation: &str) -> Option<f64> {
        let t = self.stretches(eye, d, interpolation);
        let scan = |pair: &[f64]| -> Vec<f64> {
            (0..=200)
                .map(|i| {
                    self.value(
                        eye + d * (pair[0] + (pair[1] - pair[0]) * (f64::from(i) + 1e-6) / 200.00001),
                        interpolation,
                    )
                })
                .collect()
        };
        t.windows(2).flat_map(scan).filter(|v| !v.is_nan()).reduce(f64::max)
    }
}

fn b_spline(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 { 2.0 / 3.0 - x * x + 0.5 * x.powi(3) } else { (2.0 - x).max(0.0).powi(3) / 6.0 }
}

fn catmull_rom(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        1.5 * x.powi(3) - 2.5 * x * x + 1.0
    } else if x < 2.0 {
        -0.5 * x.powi(3) + 2.5 * x * x - 4.0 * x + 2.0
    } else {
        0.0
    }
}

/// Eyes at odd angles, along an axis, and inside. None is on a face between voxels, where `nearest` could be either of them.
pub fn eyes() -> Vec<Eye> {
    let outside = [[2.1, 1.7, 2.3], [0.0, 0.0, 3.0], [-3.0, 0.4, 0.2], [0.1, 0.23, -0.3]];
    outside.into_iter().map(|at| Eye::at(at, 42.0)).collect()
}

/// The numbers of a request's film, and true if the pixel is not transparent, for one sample through the pixels' centres.
pub fn numbers(house: &House, volume: &Value, eye: &Eye, parameters: &Value) -> Vec<(f64, bool)> {
    let mut request = json!({
        "technique": "projection", "volume": volume, "camera": eye.json(), "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": 1}, "projection": parameters
    });
    request["projection"]["output"] = "value".into();
    let (film, _) = house.film(&request);
    assert!(film.main.mean.iter().all(|v| v.is_finite()), "{request}");
    film.main.mean.chunks_exact(4).map(|p| (f64::from(p[0]), p[3] > 0.5)).collect()
}

/// The rays of those numbers that do not only graze the box. A graze has few digits in single precision.
pub fn rays(eye: &Eye) -> impl Iterator<Item = (usize, DVec3, f64)> {
    let eye = *eye;
    (0..SIDE * SIDE).filter_map(move |pixel| {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let length = inside(eye.eye, d, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
        (length > 0.05).then_some((pixel, d, length))
    })
}
