//! The error that a field of random work causes in a picture.

use std::f64::consts::SQRT_2;

use super::{Film, by_chance};

/// The error of a picture by its field, relative.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldError {
    /// The standard error: the change of the picture since the field had half its work.
    pub change: f64,
    /// The upper bound that 95 of 100 pictures keep.
    pub bound: f64,
}

/// The least degrees of freedom of a difference. Of fewer, a bound would say nothing.
const LEAST_FREEDOM: f64 = 3.0;

impl FieldError {
    /// The error of a film, from the film of half as much work. The difference of a mean to that of its first half has the variance of the mean itself.
    /// Noise shifts the greatest of many values by a multiple of its deviation: a shift of s / √w after the work w changes by (√2 − 1) of what is left
    /// from half of w to w. So an `extremum` may be wrong by 1 + √2 times the change. `None` if the two have not the same pixels.
    pub fn of(film: &Film, half: &Film, extremum: bool) -> Option<Self> {
        let change = film.difference(half)?;
        let apart = |i: usize| film.main.luminance(i) - half.main.luminance(i);
        let apart: Vec<f64> = (0..film.main.pixels()).map(apart).collect();
        let freedom = freedom(&apart, film.main.width).max(LEAST_FREEDOM);
        let shifted = if extremum { 1.0 + SQRT_2 } else { 1.0 };
        Some(Self { change, bound: change * by_chance(freedom, 1.0).max(shifted) })
    }
}

/// The degrees of freedom of the mean square of differences: 3 (Σ d²)² / Σ d⁴, which is their number if all are alike and normal, over the number of
/// pixels that are alike. Of neighbours with a correlation of r these are (1 + r²) / (1 − r²) along a row, and as many along a column.
pub fn freedom(apart: &[f64], width: usize) -> f64 {
    let sum = |of: &dyn Fn(&f64) -> f64| apart.iter().map(of).sum::<f64>();
    let (squares, fourths) = (sum(&|d| d * d), sum(&|d| d.powi(4)));
    let neighbours: f64 = apart.chunks(width.max(1)).flat_map(|row| row.windows(2)).map(|pair| pair[0] * pair[1]).sum();
    let correlation = if squares > 0.0 { (neighbours / squares).clamp(0.0, 0.99).powi(2) } else { 0.0 };
    let alike = ((1.0 + correlation) / (1.0 - correlation)).powi(2);
    if fourths > 0.0 { 3.0 * squares * squares / fourths / alike } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::super::{Samples, Sums};
    use super::*;
    use crate::split_mix::SplitMix64;

    /// A picture of 32 × 32 grey pixels.
    fn grey(pixels: &[f64]) -> Film {
        let mean = pixels.iter().flat_map(|v| [*v as f32, *v as f32, *v as f32, 1.0]).collect();
        let main = Samples { width: 32, height: 32, stride: 1, count: 1, mean, ..Samples::default() };
        let sums = Sums { luminance: pixels.iter().sum(), ..Sums::default() };
        Film { size: [32, 32], main, sums, ..Film::default() }
    }

    #[test]
    fn noise_shifts_an_extremum_by_more_than_its_change() {
        let mut random = SplitMix64::new(4);
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        // The greatest of 50 values of 1, with a deviation of 0.1 after half of the work.
        let (mut half, mut whole) = (vec![f64::MIN; 1024], vec![f64::MIN; 1024]);
        for pixel in (0..1024).flat_map(|pixel| [pixel; 50]) {
            let [first, second] = [0; 2].map(|_| 1.0 + 0.1 * normal());
            half[pixel] = half[pixel].max(first);
            whole[pixel] = whole[pixel].max(0.5 * (first + second));
        }
        let of = |extremum| FieldError::of(&grey(&whole), &grey(&half), extremum).map_or(f64::NAN, |field| field.bound);
        let is = (whole.iter().map(|v| (v - 1.0).powi(2)).sum::<f64>() / 1024.0).sqrt()
            / (whole.iter().sum::<f64>() / 1024.0);
        assert!(of(false) < 0.7 * is && (is..1.3 * is).contains(&of(true)), "{is}: {}, {}", of(false), of(true));
    }

    #[test]
    fn pixels_that_are_alike_count_as_one() {
        let mut random = SplitMix64::new(3);
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        let apart: Vec<f64> = (0..64 * 64).map(|_| normal()).collect();
        let found = freedom(&apart, 64);
        assert!((found / 4096.0 - 1.0).abs() < 0.1, "{found}");
        let blocks: Vec<f64> = (0..64 * 64).map(|i| apart[i / 64 / 4 * 64 + i % 64 / 4]).collect();
        let found = freedom(&blocks, 64);
        assert!((128.0..512.0).contains(&found), "256 blocks: {found}");
        let mut few = vec![0.0; 4096];
        few[77] = 1.0;
        assert!(freedom(&few, 64) < 3.1, "one pixel");
        assert!(freedom(&[0.0; 9], 3).is_nan());
    }
}
