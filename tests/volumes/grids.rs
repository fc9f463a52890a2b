//! Statistics and cells against brute force.

use super::writers::*;
use cloudchamber::volume::{CELL, NewVolume, Volume, Voxels};

pub fn grid(dims: [usize; 3], voxels: Voxels, slope: f64, inter: f64) -> Volume {
    let (name, format, unit) = ("test".into(), "raw".into(), "mm".into());
    let (spacing, linear, file_affine, notes) = ([1.0; 3], None, None, Vec::new());
    Volume::new(NewVolume { dims, spacing, linear, voxels, slope, inter, name, format, file_affine, unit, notes })
        .unwrap()
}

/// Each voxel whose value a sample in the cell can read.
fn brute_force_cell(volume: &Volume, cell: [usize; 3]) -> [f32; 2] {
    let mut ends = [f32::INFINITY, f32::NEG_INFINITY];
    let near = |axis: usize, c: usize| {
        let last = volume.dims()[axis] as i64 - 1;
        let first = (c * CELL) as i64 - 1;
        (first..=first + 9).map(move |i| i.clamp(0, last) as usize)
    };
    for z in near(2, cell[2]) {
        for y in near(1, cell[1]) {
            for x in near(0, cell[0]) {
                let value = volume.value(x, y, z) as f32;
                ends = [ends[0].min(value), ends[1].max(value)];
            }
        }
    }
    ends
}

fn assert_cells(volume: &Volume) {
    let [nx, ny, nz] = volume.cells().dims();
    assert_eq!([nx, ny, nz], volume.dims().map(|n| n.div_ceil(8)));
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let found = volume.cells().min_max()[x + nx * (y + ny * z)];
                assert_eq!(found, brute_force_cell(volume, [x, y, z]), "cell {x} {y} {z}");
            }
        }
    }
}

#[test]
fn cells_span_what_a_sample_can_read() {
    let mut random = Random(1);
    for dims in [[19, 9, 17], [1, 1, 1], [8, 8, 8], [7, 16, 25]] {
        let count = dims.iter().product();
        let bytes: Vec<u8> = (0..count).map(|_| random.next() as u8).collect();
        assert_cells(&grid(dims, Voxels::U8(bytes), 1.0, 0.0));
        let shorts: Vec<i16> = (0..count).map(|_| random.next() as i16).collect();
        assert_cells(&grid(dims, Voxels::I16(shorts), -0.25, 100.0));
        let words: Vec<u16> = (0..count).map(|_| random.next() as u16).collect();
        assert_cells(&grid(dims, Voxels::U16(words), 1.0, -1024.0));
        let holes: Vec<f32> =
            (0..count).map(|i| if i % 3 == 0 { f32::NAN } else { random.below(1000) as f32 }).collect();
        assert_cells(&grid(dims, Voxels::F32(holes), 2.0, 1.0));
    }
}

#[test]
fn a_volume_large_enough_for_threads_has_the_same_cells() {
    let mut random = Random(2);
    let bytes: Vec<u8> = (0..65 * 70 * 130).map(|_| random.next() as u8).collect();
    let mut counts = vec![0; 256];
    bytes.iter().for_each(|&value| counts[usize::from(value)] += 1);
    let volume = grid([65, 70, 130], Voxels::U8(bytes), 1.0, 0.0);
    assert_cells(&volume);
    assert_eq!(volume.histogram().counts, counts, "a bin a grey level");
}

#[test]
fn infinities_become_nan_and_are_counted() {
    let mut values = vec![1.0f32; 20 * 20 * 20];
    values[0] = f32::INFINITY;
    values[1] = f32::NEG_INFINITY;
    values[2] = f32::NAN;
    values[3] = -5.0;
    let volume = grid([20; 3], Voxels::F32(values), 1.0, 0.0);
    assert_eq!((volume.non_finite(), volume.range()), (3, [-5.0, 1.0]));
    assert!(volume.value(0, 0, 0).is_nan() && volume.value(1, 0, 0).is_nan());
    let histogram = volume.histogram();
    assert_eq!((histogram.counts[0], histogram.counts[255]), (1, 8000 - 4));
    assert_eq!(histogram.counts.iter().sum::<u64>() + volume.non_finite(), 8000);

    let nothing = grid([9, 8, 8], Voxels::F32(vec![f32::NAN; 576]), 1.0, 0.0);
    assert_eq!((nothing.non_finite(), nothing.range()), (576, [0.0, 0.0]));
    assert!(nothing.cells().min_max().iter().all(|[min, max]| min > max));
    assert_eq!(nothing.histogram().counts.iter().sum::<u64>(), 0);
    assert_eq!(nothing.cells().empty_distance(&|_, _| true), [255, 255]);
}

#[test]
fn empty_distance_is_the_chebyshev_distance() {
    let dims = [11, 7, 9];
    for (seed, one_in) in [(1, 3), (2, 40), (3, 400), (4, usize::MAX)] {
        let mut random = Random(seed);
        // Whole cells are set, and their neighbours' footprints reach into them: ask the cells, not the voxels.
        let blocks: Vec<u8> = (0..693).map(|_| u8::from(random.below(one_in) == 0)).collect();
        let mut voxels = vec![0u8; 88 * 56 * 72];
        for (i, voxel) in voxels.iter_mut().enumerate() {
            let [x, y, z] = [i % 88, i / 88 % 56, i / (88 * 56)].map(|u| u / 8);
            *voxel = blocks[x + 11 * (y + 7 * z)];
        }
        let volume = grid([88, 56, 72], Voxels::U8(voxels), 1.0, 0.0);
        let place = |i: usize| [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])].map(|u| u as i64);
        let occupied: Vec<_> = (0..693).filter(|&i| volume.cells().min_max()[i][1] > 0.5).map(place).collect();
        let distance = |i: usize| {
            let apart = |other: &[i64; 3]| (0..3).map(|axis| (place(i)[axis] - other[axis]).abs()).max().unwrap();
            occupied.iter().map(apart).min().map_or(255, |apart| apart.min(255) as u8)
        };
        let expected: Vec<u8> = (0..693).map(distance).collect();
        assert_eq!(volume.cells().empty_distance(&|_, max| max > 0.5), expected, "one in {one_in}");
    }
}

#[test]
fn distances_end_at_255() {
    let mut voxels = vec![0u8; 8 * 300];
    voxels[0] = 1;
    let distance = grid([2400, 1, 1], Voxels::U8(voxels), 1.0, 0.0).cells().empty_distance(&|_, max| max > 0.0);
    assert_eq!((distance[0], distance[1], distance[254], distance[255], distance[299]), (0, 1, 254, 255, 255));
}

#[test]
fn dims_that_do_not_fit_the_voxels_are_an_internal_error() {
    let parts = NewVolume {
        dims: [2, 2, 2],
        spacing: [1.0; 3],
        linear: None,
        voxels: Voxels::U8(vec![0; 7]),
        slope: 1.0,
        inter: 0.0,
        name: String::new(),
        format: "field".into(),
        file_affine: None,
        unit: "unit".into(),
        notes: Vec::new(),
    };
    assert_eq!(Volume::new(parts).unwrap_err().status().0, 500);
}
