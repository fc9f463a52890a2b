//! Floats as whole numbers of 16 bits: their error, and the volumes that have none.

use std::sync::Arc;

use super::grids::grid;
use crate::common::writers::*;
use cloudchamber::volume::{Volume, Voxels};

/// Floats that lie on no word, from 1e-6 to 1 of `scale`.
fn floats(dims: [usize; 3], scale: f32) -> Vec<f32> {
    let mut random = Random(9);
    (0..dims.iter().product()).map(|_| scale * (random.next() % 999_983) as f32 / 999_983.0).collect()
}

#[test]
fn a_value_is_off_by_half_a_step_at_most() {
    let dims = [70, 65, 61];
    for (scale, slope, inter) in [(1.0, 1.0, 0.0), (1e-20, -3e5, 2.0), (3e30, 1e-3, -1e20), (7.0, 1.0, 1e6)] {
        let volume = grid(dims, Voxels::F32(floats(dims, scale)), slope, inter);
        let words = volume.words(f64::INFINITY).unwrap();
        assert_eq!((words.bytes() * 2, words.range()), (volume.bytes(), volume.range()));
        assert_eq!(
            (words.histogram().unwrap(), words.world_from_index()),
            (volume.histogram().unwrap(), volume.world_from_index())
        );
        // Floats of 24 bits carry the arithmetic, which adds a two-hundredth of a step.
        let bound = 0.505 * volume.word_step();
        for (x, y, z) in
            [(0, 0, 0), (69, 64, 60), (1, 2, 3), (33, 44, 55)].into_iter().chain((0..61).map(|i| (i, i, i)))
        {
            let off = (words.values().unwrap().at(x, y, z) - volume.values().unwrap().at(x, y, z)).abs();
            assert!(off <= bound, "{scale:e} {slope:e} {inter:e}: off by {off:e}, a step is {:e}", volume.word_step());
        }
        let ends = |v: &Volume| {
            (0..dims.iter().product())
                .map(|i| v.values().unwrap().at(i % 70, i / 70 % 65, i / 70 / 65))
                .fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(v), b.max(v)])
        };
        let [low, high] = ends(&words);
        assert!((low - volume.range()[0]).abs() <= bound && (high - volume.range()[1]).abs() <= bound);
    }
}

#[test]
fn words_are_made_once_and_only_of_finite_floats_that_they_resolve() {
    let dims = [9, 8, 7];
    let of = |voxels: Voxels| grid(dims, voxels, 1.0, 0.0);
    let volume = of(Voxels::F32(floats(dims, 1.0)));
    let step = volume.word_step();
    assert!(volume.words(0.99 * step).is_none(), "too coarse");
    let words = volume.words(1.01 * step).unwrap();
    assert!(Arc::ptr_eq(&words, &volume.words(1.0).unwrap()));
    assert!(words.words(1.0).is_none() && of(Voxels::U8(vec![3; 504])).words(1.0).is_none());
    assert!(of(Voxels::F32(vec![2.5; 504])).words(1.0).is_none(), "a range that is a point");
    let mut holed = floats(dims, 1.0);
    holed[5] = f32::NAN;
    assert!(of(Voxels::F32(holed)).words(1.0).is_none(), "a word cannot say that there is no value");
    assert!(of(Voxels::F32(floats(dims, 1e-38))).words(1.0).is_none(), "a range whose inverse is no float");
}
