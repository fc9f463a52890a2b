//! Statistics against brute force.

use crate::common::writers::*;
use cloudchamber::volume::{NewVolume, Volume, Voxels};

pub fn grid(dims: [usize; 3], voxels: Voxels, slope: f64, inter: f64) -> Volume {
    let (name, format, unit) = ("test".into(), "raw".into(), "mm".into());
    let (spacing, linear, file_affine, notes) = ([1.0; 3], None, None, Vec::new());
    Volume::new(NewVolume { dims, spacing, linear, voxels, slope, inter, name, format, file_affine, unit, notes })
        .unwrap()
}

#[test]
fn a_volume_large_enough_for_threads_is_counted_whole() {
    let mut random = Random(2);
    let bytes: Vec<u8> = (0..65 * 70 * 130).map(|_| random.next() as u8).collect();
    let mut counts = vec![0; 256];
    bytes.iter().for_each(|&value| counts[usize::from(value)] += 1);
    let volume = grid([65, 70, 130], Voxels::U8(bytes), 1.0, 0.0);
    assert_eq!(volume.histogram().unwrap().counts, counts, "a bin a grey level");
    let (shifted, last) = (volume.range(), 65 * 70 * 130 - 1);
    assert_eq!(shifted, [0.0, 255.0]);
    // The extremes are found at any place.
    let one = |at: usize, value: i16| {
        let mut voxels = vec![7i16; last + 1];
        voxels[at] = value;
        grid([65, 70, 130], Voxels::I16(voxels), -0.5, 1.0).range()
    };
    assert_eq!((one(last, -3), one(0, 30000), one(last / 2, 8)), ([-2.5, 2.5], [-14999.0, -2.5], [-3.0, -2.5]));
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
    assert!(volume.values().unwrap().at(0, 0, 0).is_nan() && volume.values().unwrap().at(1, 0, 0).is_nan());
    let histogram = volume.histogram().unwrap();
    assert_eq!((histogram.counts[0], histogram.counts[255]), (1, 8000 - 4));
    assert_eq!(histogram.counts.iter().sum::<u64>() + volume.non_finite(), 8000);

    let nothing = grid([9, 8, 8], Voxels::F32(vec![f32::NAN; 576]), 1.0, 0.0);
    assert_eq!((nothing.non_finite(), nothing.range()), (576, [0.0, 0.0]));
    assert_eq!(nothing.histogram().unwrap().counts.iter().sum::<u64>(), 0);
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
