//! The range of a grid's raw values.

use super::parallel;
use super::voxels::{Sample, Voxels, with_slice};

/// The least and the greatest raw value, if any is a number.
pub(super) fn raw_range(voxels: &Voxels) -> Option<[f64; 2]> {
    let [low, high] = with_slice!(voxels, min_max);
    (low <= high).then_some([low, high])
}

fn min_max<T: Sample>(voxels: &[T]) -> [f64; 2] {
    let parts = parallel::over_ranges(voxels.len(), voxels.len(), |range| {
        let part = voxels.get(range).unwrap_or_default().iter();
        // A comparison with NaN is false, so NaN is passed over.
        part.fold([T::HIGHEST, T::LOWEST], |[low, high], &v| {
            [if v < low { v } else { low }, if v > high { v } else { high }]
        })
    });
    let ends = |[low, high]: [T; 2]| [low.to_f64(), high.to_f64()];
    parts.into_iter().map(ends).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], [c, d]| [a.min(c), b.max(d)])
}
