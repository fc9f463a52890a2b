//! The mean value along a bright ray of a volume. Projections scale their windows and extinctions by it.

use super::Values;

/// The rays a side and the samples a ray of [`bright_mean`].
const LOOK_RAYS: usize = 32;
const LOOK_SAMPLES: usize = 128;

/// The mean of the voxels with values in `data` along a bright ray: one in fifty of the rays along the grid's axes is brighter. A mean over the whole
/// volume would say little of a few vessels in much air.
pub(super) fn bright_mean(dims: [usize; 3], values: Values<'_>, data: [f64; 2]) -> f64 {
    let mut means: Vec<f64> = (0..3).flat_map(|axis| means_along(dims, values, data, axis)).collect();
    means.sort_by(f64::total_cmp);
    means.get(means.len().saturating_sub(1) * 49 / 50).copied().unwrap_or(0.0)
}

/// The means of the rays along one axis that meet such a voxel.
fn means_along(dims: [usize; 3], values: Values<'_>, [low, high]: [f64; 2], axis: usize) -> Vec<f64> {
    let (across, down) = ((axis + 1) % 3, (axis + 2) % 3);
    let count = |axis: usize, most: usize| dims[axis].min(most);
    let place = |i: usize, of: usize, n: usize| (2 * i + 1) * n / (2 * of);
    let (wide, deep, samples) = (count(across, LOOK_RAYS), count(down, LOOK_RAYS), count(axis, LOOK_SAMPLES));
    let ray = |n: usize| {
        let mut at = [0; 3];
        (at[across], at[down]) = (place(n / deep, wide, dims[across]), place(n % deep, deep, dims[down]));
        let (mut sum, mut found) = (0.0, 0.0);
        for k in 0..samples {
            at[axis] = place(k, samples, dims[axis]);
            let value = values.at(at[0], at[1], at[2]);
            if (low..=high).contains(&value) {
                (sum, found) = (sum + value, found + 1.0);
            }
        }
        (found > 0.0).then(|| sum / found)
    };
    (0..wide * deep).filter_map(ray).collect()
}
