//! References of the host in double precision, written from the definitions and sharing no code with the techniques.

mod eye;
mod grid;
mod paths;

pub use eye::{Eye, inside};
pub use grid::Grid;
pub use paths::{Light, Medium, henyey_greenstein};

use glam::DVec3;
use rayon::prelude::*;

use crate::split_mix::SplitMix64;

/// A generator. It has nothing in common with the kernels' generator.
#[derive(Debug, Clone)]
pub struct Random(SplitMix64);

impl Random {
    /// A generator with a stream of its own for every seed.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add(1)))
    }

    /// A number strictly between 0 and 1.
    pub fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    /// A unit vector, uniform over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        self.turned(DVec3::Z, 0.0)
    }

    /// A unit vector whose cosine with `d` follows Henyey and Greenstein's distribution.
    pub fn turned(&mut self, d: DVec3, g: f64) -> DVec3 {
        let u = 2.0 * self.unit() - 1.0;
        let cosine =
            if g.abs() < 1e-6 { u } else { (1.0 + g * g - ((1.0 - g * g) / (1.0 + g * u)).powi(2)) / (2.0 * g) };
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (right, up) = d.any_orthonormal_pair();
        let (sin, cos) = (std::f64::consts::TAU * self.unit()).sin_cos();
        (d * cosine + (right * cos + up * sin) * sine).normalize()
    }
}

/// Means of `count` estimates of several numbers each, and their standard errors, on all cores. They are the same on any number of cores.
pub fn means<const N: usize>(
    count: usize,
    seed: u64,
    estimate: impl Fn(&mut Random) -> [f64; N] + Sync,
) -> [[f64; 2]; N] {
    const CHUNKS: usize = 256;
    let each = count.div_ceil(CHUNKS);
    let chunk = |chunk: usize| -> [[f64; 2]; N] {
        let mut random = Random::new(seed.wrapping_mul(1_000_003).wrapping_add(chunk as u64));
        let mut sums = [[0.0; 2]; N];
        for _ in 0..each {
            for (sum, value) in sums.iter_mut().zip(estimate(&mut random)) {
                sum[0] += value;
                sum[1] += value * value;
            }
        }
        sums
    };
    let sums: Vec<[[f64; 2]; N]> = (0..CHUNKS).into_par_iter().map(chunk).collect();
    let n = (each * CHUNKS) as f64;
    std::array::from_fn(|i| {
        let total = |part: usize| sums.iter().map(|s| s[i][part]).sum::<f64>() / n;
        let mean = total(0);
        [mean, ((total(1) - mean * mean).max(0.0) / n).sqrt()]
    })
}
