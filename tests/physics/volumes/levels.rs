//! Coarser levels against means by brute force.

use std::sync::Arc;

use super::grids::grid;
use crate::common::writers::*;
use cloudchamber::volume::{MOST_LEVEL, NewVolume, Volume, Voxels};

fn random_floats(n: usize) -> Vec<f32> {
    let mut random = Random(5);
    (0..n).map(|_| (random.next() % 1000) as f32 - 300.0).collect()
}

/// The mean over the box from `low` to `high` in index space, by `places` places along each side.
fn mean_in(volume: &Volume, low: [f64; 3], high: [f64; 3], places: [usize; 3]) -> f64 {
    let at = |a: usize, i: usize| (low[a] + (high[a] - low[a]) * (i as f64 + 0.5) / places[a] as f64) as usize;
    let (wide, tall, count) = (places[0], places[1], places.iter().product());
    let value = |i: usize| volume.values().unwrap().at(at(0, i % wide), at(1, i / wide % tall), at(2, i / wide / tall));
    (0..count).map(value).sum::<f64>() / count as f64
}

#[test]
fn a_voxel_of_a_level_is_the_mean_of_what_it_covers() {
    for (dims, level, expected) in [([8, 6, 4], 1, [4, 3, 2]), ([7, 5, 9], 1, [4, 3, 5]), ([9, 10, 3], 2, [3, 3, 1])] {
        let volume = Arc::new(grid(dims, Voxels::F32(random_floats(dims.iter().product())), 2.0, -7.0));
        let coarse = volume.level(level).unwrap();
        assert_eq!(coarse.dims(), expected, "{dims:?}");
        for z in 0..expected[2] {
            for y in 0..expected[1] {
                for x in 0..expected[0] {
                    let end = |i: usize, a: usize| i as f64 * dims[a] as f64 / expected[a] as f64;
                    let low = [end(x, 0), end(y, 1), end(z, 2)];
                    let high = [end(x + 1, 0), end(y + 1, 1), end(z + 1, 2)];
                    // No place is on a voxel's face, and each part has places in proportion to its size.
                    let truth = mean_in(&volume, low, high, dims);
                    assert!(
                        (coarse.values().unwrap().at(x, y, z) - truth).abs() < 1e-3,
                        "{dims:?} {x} {y} {z}: {truth}"
                    );
                }
            }
        }
        assert_eq!(
            (coarse.range(), coarse.histogram().unwrap()),
            (volume.range(), volume.histogram().unwrap()),
            "colours stay"
        );
        assert!((coarse.world_half_size() - volume.world_half_size()).length() < 1e-12, "and the box");
    }
}

#[test]
fn axes_whose_voxels_are_wide_stay_until_the_others_are() {
    let parts = NewVolume {
        dims: [20, 20, 10],
        spacing: [0.8, 0.8, 2.4],
        linear: None,
        voxels: Voxels::I16((0..4000).map(|i| i as i16).collect()),
        slope: 1.0,
        inter: 0.0,
        name: "ct".into(),
        format: "raw".into(),
        file_affine: None,
        unit: "mm".into(),
        notes: Vec::new(),
    };
    let volume = Arc::new(Volume::new(parts).unwrap());
    let dims = |level: usize| volume.level(level).unwrap().dims();
    assert_eq!((dims(0), dims(1), dims(2), dims(3)), ([20, 20, 10], [10, 10, 10], [5, 5, 8], [3, 3, 4]));
    assert_eq!((dims(MOST_LEVEL), dims(99)), ([1; 3], [1; 3]), "beyond the coarsest is the coarsest");
    assert!(
        Arc::ptr_eq(&volume.level(0).unwrap(), &volume)
            && Arc::ptr_eq(&volume.level(1).unwrap(), &volume.level(1).unwrap())
    );
    for level in 0..4 {
        let coarse = volume.level(level).unwrap();
        let side = |a: usize| coarse.dims()[a] as f64 * coarse.spacing()[a];
        let sides = [side(0), side(1), side(2)];
        assert!(sides.iter().zip([16.0, 16.0, 24.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{sides:?}");
    }
}

#[test]
fn what_has_no_value_does_not_count() {
    let mut values = vec![4.0f32; 64];
    values[0] = f32::NAN;
    values[1] = 12.0;
    // These are all voxels of the box that ends at the last voxel.
    for (x, y, z) in (0..8).map(|i| (2 + i % 2, 2 + i / 2 % 2, 2 + i / 4)) {
        values[x + 4 * (y + 4 * z)] = f32::NAN;
    }
    let coarse = Arc::new(grid([4; 3], Voxels::F32(values), 1.0, 0.0)).level(1).unwrap();
    assert!(
        (coarse.values().unwrap().at(0, 0, 0) - (6.0 * 4.0 + 12.0) / 7.0).abs() < 1e-6,
        "{}",
        coarse.values().unwrap().at(0, 0, 0)
    );
    assert!(coarse.values().unwrap().at(1, 1, 1).is_nan() && coarse.non_finite() == 1);
    let bytes = Arc::new(grid([2, 2, 1], Voxels::U8(vec![0, 255, 255, 0]), 0.5, 1.0)).level(1).unwrap();
    assert_eq!(bytes.values().unwrap().at(0, 0, 0), 128.0 * 0.5 + 1.0, "to the nearest of its type");
}
