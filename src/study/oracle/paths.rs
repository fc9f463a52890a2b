//! Light in a grid by the plainest Monte Carlo there is: analogue collisions, exact cell by cell.

use glam::DVec3;

use super::{Grid, Random, inside};

/// A scattering medium. The grid's values are extinction; the part `albedo` of it is scattered by Henyey and Greenstein's phase function.
#[derive(Debug, Clone)]
pub struct Medium {
    /// The extinction.
    pub extinction: Grid,
    /// The scattered part of the extinction.
    pub albedo: f64,
    /// The mean cosine of the scattering angle.
    pub g: f64,
}

/// A sun without width and an even sky.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    /// The unit vector to the sun.
    pub to_sun: DVec3,
    /// The irradiance on a plane that faces the sun.
    pub irradiance: f64,
    /// The sky's radiance, from everywhere.
    pub sky: f64,
}

/// Henyey and Greenstein's phase function, per steradian.
pub fn henyey_greenstein(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

impl Medium {
    /// One estimate of the radiance that comes to `p` against the unit vector `d`.
    pub fn radiance(&self, light: &Light, random: &mut Random, mut p: DVec3, mut d: DVec3) -> f64 {
        let mut sum = 0.0;
        let mut weight = 1.0;
        while let Some(s) = self.extinction.free_path(p, d, -random.unit().ln()) {
            p += d * s;
            weight *= self.albedo;
            let through = (-self.extinction.depth(p, light.to_sun)).exp();
            sum += weight * henyey_greenstein(self.g, d.dot(light.to_sun)) * light.irradiance * through;
            if weight < 0.1 {
                if random.unit() < 0.5 {
                    return sum;
                }
                weight *= 2.0;
            }
            d = random.turned(d, self.g);
        }
        sum + weight * light.sky
    }

    /// The end of a photon from `p`: the weights that leave by the faces −x, +x, −y, … , and the absorbed weight.
    pub fn photon(&self, random: &mut Random, mut p: DVec3) -> [f64; 7] {
        let mut tally = [0.0; 7];
        let (mut d, mut weight) = (random.direction(), 1.0);
        while let Some(s) = self.extinction.free_path(p, d, -random.unit().ln()) {
            p += d * s;
            tally[6] += weight * (1.0 - self.albedo);
            weight *= self.albedo;
            if weight < 1e-9 {
                return tally;
            }
            d = random.turned(d, self.g);
        }
        let end = p + d * inside(p, d, self.extinction.half).map_or(0.0, |way| way.1);
        let at = (end / self.extinction.half).abs();
        let axis = (0..3).fold(0, |best, a| if at[a] > at[best] { a } else { best });
        tally[2 * axis + usize::from(end[axis] > 0.0)] += weight;
        tally
    }
}
