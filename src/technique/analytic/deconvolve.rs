//! The deblurring of a plain backprojection, after it: the lecture's order.

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

/// Divides the planes of a backprojection by the Fourier transform of its point response.
///
/// A point becomes 1/r, whose transform in two dimensions is 1/|ν| at ν cycles per mm. So each plane's transform is multiplied by |ν|. The grid has a
/// margin, since the transform takes it for periodic; what is beyond the margin is missing, as slow changes of the result. The object ends before the
/// grid does: the mean of the outermost voxels is taken to be 0.
pub(super) fn deconvolve(values: &mut [f32], [wide, high]: [usize; 2], spacing_mm: [f64; 2]) {
    values.par_chunks_mut(wide * high).for_each(|plane| {
        let mut waves: Vec<Complex<f64>> = plane.iter().map(|v| Complex::new(f64::from(*v), 0.0)).collect();
        transform(&mut waves, [wide, high], FftDirection::Forward);
        let frequency = |i: usize, n: usize, spacing: f64| i.min(n - i) as f64 / (n as f64 * spacing);
        for (i, wave) in waves.iter_mut().enumerate() {
            let (x, y) = (frequency(i % wide, wide, spacing_mm[0]), frequency(i / wide, high, spacing_mm[1]));
            *wave *= x.hypot(y) / (wide * high) as f64;
        }
        transform(&mut waves, [wide, high], FftDirection::Inverse);
        let is_end = |i: usize, n: usize| i == 0 || i + 1 == n;
        let is_rim = |i: usize| is_end(i % wide, wide) || is_end(i / wide, high);
        let rim: Vec<f64> = waves.iter().enumerate().filter(|(i, _)| is_rim(*i)).map(|(_, wave)| wave.re).collect();
        let zero = rim.iter().sum::<f64>() / rim.len().max(1) as f64;
        plane.iter_mut().zip(&waves).for_each(|(v, wave)| *v = (wave.re - zero) as f32);
    });
}

/// The transform of a plane, in place and without a factor: its rows, then its columns.
fn transform(plane: &mut [Complex<f64>], [wide, high]: [usize; 2], direction: FftDirection) {
    let mut planner = FftPlanner::new();
    planner.plan_fft(wide, direction).process(plane);
    let columns = planner.plan_fft(high, direction);
    let mut column = vec![Complex::default(); high];
    for x in 0..wide {
        (0..high).for_each(|y| column[y] = plane[y * wide + x]);
        columns.process(&mut column);
        (0..high).for_each(|y| plane[y * wide + x] = column[y]);
    }
}

/// A grid of [wide, high, deep] voxels without `margin` of them on each side along x and y.
pub(super) fn cropped(values: &[f32], [wide, high]: [usize; 2], margin: [usize; 2]) -> Vec<f32> {
    let rows = values.chunks_exact(wide).enumerate().filter(|(row, _)| {
        let y = row % high;
        (margin[1]..high - margin[1]).contains(&y)
    });
    rows.flat_map(|(_, row)| row[margin[0]..wide - margin[0]].iter().copied()).collect()
}
