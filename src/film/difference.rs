//! A test by z of every pixel's luminance that two films are of the same picture.

use serde::Serialize;

use super::Film;
use crate::error::{Error, Result};
use crate::frame;

/// The significance level: the chance that noise alone makes any pixel count as different.
const ALPHA: f64 = 0.01;
/// The |z| that is drawn in full colour.
const FULL_COLOUR: f64 = 4.0;

/// The judgement of two films of one size. t = (a − b) / √(s_a² + s_b²), with the standard errors of both pixels, follows Student's
/// distribution with Welch's degrees of freedom ν = (s_a² + s_b²)² / (s_a⁴ / (n_a − 1) + s_b⁴ / (n_b − 1)). z is the equally improbable
/// normal variable, √(ν ln(1 + t²/ν)) (8ν + 1) / (8ν + 3) (Wallace, Ann. Math. Stat. 30, 1959).
#[derive(Debug, Clone, Serialize)]
pub struct Difference {
    /// The number of compared pixels: all pixels whose error is known or 0.
    pub pixels: usize,
    /// The number of pixels whose error is not known, since a sample was not finite.
    pub unknown: usize,
    /// The number of pixels beyond the two-sided level of 1 − (1 − α)^(1/pixels), α = 0.01 (Šidák, JASA 62, 1967).
    pub beyond: usize,
    /// The mean luminance of the first film less that of the second.
    pub mean_difference: f64,
    /// The standard error of `mean_difference`.
    pub mean_difference_error: f64,
    /// The mean of z². It is 1 for noise of known size, and less if the pixels' own samples differ by more than noise, as at edges.
    pub mean_z_squared: f64,
    /// The probability of a difference of the means as large as this, or of a Σ z² as large as this, by noise alone. It is the lesser of
    /// the two, corrected for being one of two.
    pub p_value: f64,
    /// True if at least 99.75 % of the pixels are within the level.
    pub agree: bool,
    /// True if both pictures have one seed. Places and random numbers that they share bring the same noise, which is not in their difference: z is too
    /// small then, and a p-value near 1 says little.
    pub correlated: bool,
    #[serde(skip)]
    z: Vec<f64>,
    #[serde(skip)]
    size: [usize; 2],
}

/// The probability that a standard normal variable is beyond ±z.
fn two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// The probability that a χ² variable of `n` degrees of freedom is beyond `x` (Wilson & Hilferty, PNAS 17, 1931).
fn chi_squared_tail(x: f64, n: f64) -> f64 {
    let spread = 2.0 / (9.0 * n);
    0.5 * libm::erfc(((x / n).cbrt() - 1.0 + spread) / (2.0 * spread).sqrt())
}

/// The standard normal variable that is as improbable as Student's t of `freedom` degrees of freedom.
fn normal_score(t: f64, freedom: f64) -> f64 {
    let freedom = freedom.clamp(1.0, 1e6);
    let z = (freedom * (t * t / freedom).ln_1p()).sqrt() * (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0);
    z.copysign(t)
}

/// The probability that the least of `n` independent p-values is as low as `p`.
fn least_of(p: f64, n: f64) -> f64 {
    -(n * (-p).ln_1p()).exp_m1()
}

impl Film {
    /// Compares this film with another one; `correlated` is true if both have one seed.
    ///
    /// # Errors
    /// [`Error::Conflict`] if the two are not pictures of one size with two samples or more.
    pub fn compare(&self, other: &Film, correlated: bool) -> Result<Difference> {
        for film in [self, other] {
            if film.main.stride != 1 || film.main.count < 2 {
                return Err(Error::Conflict("of fewer than two samples a pixel no error is known".into()));
            }
        }
        if self.size != other.size {
            let [a, b] = [self.size, other.size].map(|[w, h]| format!("{w} × {h}"));
            return Err(Error::Conflict(format!("the pictures are of different sizes: {a} and {b}")));
        }
        let (mut sum, mut variance) = (0.0, 0.0);
        let z: Vec<f64> = (0..self.main.pixels())
            .map(|i| {
                let difference = self.main.luminance(i) - other.main.luminance(i);
                let squared = self.main.squared_error(i) + other.main.squared_error(i);
                let rounding = 1e-6 * self.main.luminance(i).abs().max(other.main.luminance(i).abs());
                if squared.is_finite() {
                    (sum, variance) = (sum + difference, variance + squared);
                }
                if difference.abs() <= rounding {
                    return 0.0 * squared;
                }
                let freedom = squared * squared / (self.main.error_spread(i) + other.main.error_spread(i)).max(1e-300);
                normal_score(difference / squared.sqrt().max(1e-30), freedom)
            })
            .collect();
        let pixels = z.iter().filter(|z| z.is_finite()).count();
        let n = pixels.max(1) as f64;
        let level = -((-ALPHA).ln_1p() / n).exp_m1();
        let beyond = z.iter().filter(|z| two_sided(**z) < level).count();
        let squares: f64 = z.iter().filter(|z| z.is_finite()).map(|z| z * z).sum();
        let by_mean = if variance > 0.0 { two_sided(sum / variance.sqrt()) } else { f64::from(u8::from(sum == 0.0)) };
        Ok(Difference {
            pixels,
            unknown: z.len() - pixels,
            beyond,
            mean_difference: sum / n,
            mean_difference_error: variance.sqrt() / n,
            mean_z_squared: squares / n,
            p_value: least_of(by_mean.min(chi_squared_tail(squares, n)), 2.0),
            agree: beyond as f64 <= 0.0025 * n,
            correlated,
            z,
            size: self.size,
        })
    }
}

impl Difference {
    /// The map of z as PNG. A pixel is white if the two films are the same, red if the first is brighter, blue if the second is, and grey
    /// if the error is not known.
    ///
    /// # Errors
    /// [`Error::Internal`] when the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>> {
        let colour = |z: &f64| {
            if !z.is_finite() {
                return [128; 3];
            }
            let c = colorous::RED_BLUE.eval_continuous((0.5 - 0.5 * z / FULL_COLOUR).clamp(0.0, 1.0));
            [c.r, c.g, c.b]
        };
        let bytes: Vec<u8> = self.z.iter().flat_map(colour).collect();
        frame::png(self.size, &bytes, serde_json::to_string(self).map_err(Error::internal)?)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Samples;
    use super::*;

    /// A film whose pixels have the luminance of `value` and a standard error of 0.1.
    fn film(value: impl Fn(usize) -> f32) -> Film {
        let pixels = 100 * 100;
        let mean = (0..pixels).flat_map(|i| [value(i), value(i), value(i), 1.0]).collect();
        // 16 samples of variance 0.16.
        let main = Samples {
            width: 100,
            height: 100,
            stride: 1,
            count: 16,
            mean,
            m2: vec![15.0 * 0.16; pixels],
            ..Samples::default()
        };
        Film { size: [100, 100], main, ..Film::default() }
    }

    /// Normal noise of deviation 0.1 by SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) and Box & Muller.
    fn noise(i: usize, seed: u64) -> f32 {
        let uniform = |n: u64| {
            let mut z = n.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let n = 2 * (seed * 1_000_000 + i as u64) + 1;
        let (u, v) = (1.0 - uniform(n), uniform(n + 1));
        (0.1 * (-2.0 * u.ln()).sqrt() * (2.0 * std::f64::consts::PI * v).cos()) as f32
    }

    #[test]
    fn noise_agrees_and_a_shift_does_not() -> Result<()> {
        let same = film(|i| 1.0 + noise(i, 1)).compare(&film(|i| 1.0 + noise(i, 2)), false)?;
        assert!(same.agree && same.beyond == 0 && same.p_value > 0.01, "{}", same.p_value);
        assert!((same.mean_z_squared - 1.0).abs() < 0.1, "{}", same.mean_z_squared);
        // A shift of a twelfth of a pixel's error is seen in the mean alone.
        let shifted = film(|i| 1.008 + noise(i, 1)).compare(&film(|i| 1.0 + noise(i, 2)), false)?;
        assert!(shifted.agree && shifted.p_value < 1e-4, "{}", shifted.p_value);
        let spotted = film(|i| if i % 100 == 0 { 3.0 } else { 1.0 + noise(i, 1) })
            .compare(&film(|i| 1.0 + noise(i, 2)), false)?;
        assert!(!spotted.agree && spotted.beyond == 100, "{}", spotted.beyond);
        Ok(())
    }

    #[test]
    fn a_pixel_of_unknown_error_says_so() -> Result<()> {
        let mut broken = film(|_| 1.0);
        broken.main.m2[7] = f32::NAN;
        let difference = broken.compare(&film(|_| 1.0), false)?;
        assert_eq!((difference.unknown, difference.pixels), (1, 9999));
        assert!(broken.random_noise().0.is_finite());
        Ok(())
    }

    #[test]
    fn tails_are_those_of_the_tables() {
        // Student's t of 10 degrees of freedom is beyond ±2.228 with a probability of 0.05, of 30 beyond ±2.042.
        assert!((two_sided(normal_score(-2.228, 10.0)) - 0.05).abs() < 1e-3 && normal_score(-2.228, 10.0) < 0.0);
        assert!((two_sided(normal_score(2.042, 30.0)) - 0.05).abs() < 1e-3);
        assert!((two_sided(1.959_964) - 0.05).abs() < 1e-6);
        assert!((chi_squared_tail(124.342, 100.0) - 0.05).abs() < 2e-4);
        assert!((chi_squared_tail(1074.679, 1000.0) - 0.05).abs() < 1e-4);
    }
}
