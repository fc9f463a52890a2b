//! What volumes are taken for: their kind, their window, outliers and what stands for no data.

use cloudchamber::volume::{Contents, DataKind, Volume, Voxels};

use super::grids::grid;
use crate::common::writers::Random;

const SIDE: usize = 40;

/// A smooth blob from 0 to `most`, with a background of 0.
fn blob(most: f32) -> Vec<f32> {
    let at = |i: usize| (i as f32 - 19.5) / 19.5;
    let value = |i: usize| {
        let r = at(i % SIDE).powi(2) + at(i / SIDE % SIDE).powi(2) + at(i / SIDE / SIDE).powi(2);
        most * (1.0 - 1.3 * r).max(0.0)
    };
    (0..SIDE.pow(3)).map(value).collect()
}

fn volume(voxels: Voxels) -> Volume {
    grid([SIDE; 3], voxels, 1.0, 0.0)
}

fn of_floats(values: Vec<f32>) -> Contents {
    volume(Voxels::F32(values)).contents().unwrap().clone()
}

fn words(values: Vec<f32>) -> Voxels {
    Voxels::I16(values.into_iter().map(|v| v as i16).collect())
}

/// With `value` at every `every`th voxel from `first`.
fn with(mut values: Vec<f32>, first: usize, every: usize, value: f32) -> Vec<f32> {
    values.iter_mut().skip(first).step_by(every).for_each(|v| *v = value);
    values
}

#[test]
fn what_is_clean_is_shown_from_end_to_end() {
    for scale in [1e-30, 1.0, 1000.0, 1e25] {
        let found = of_floats(blob(scale));
        assert_eq!((found.kind, found.padding, found.beyond), (DataKind::Intensity, None, false), "{scale:e}");
        let range = volume(Voxels::F32(blob(scale))).range();
        assert_eq!((found.window, found.data), (range, range), "{scale:e}");
    }
}

#[test]
fn a_few_hot_or_cold_voxels_are_left_out_of_the_window() {
    let clean = of_floats(blob(1000.0));
    for hot in [
        with(blob(1000.0), 99, usize::MAX, 1e6),
        with(blob(1000.0), 99, 20_000, 1e9),
        with(blob(1000.0), 7, usize::MAX, -5e4),
    ] {
        let found = of_floats(hot);
        assert!(found.beyond && found.padding.is_none(), "{found:?}");
        assert_eq!((found.kind, found.data), (DataKind::Intensity, clean.data));
        assert!(found.window[0].abs() < 60.0 && (found.window[1] / 1000.0 - 1.0).abs() < 0.1, "{found:?}");
    }
    // Two of very different sizes, one behind the other.
    let two = with(with(blob(1000.0), 99, usize::MAX, 1e6), 5000, usize::MAX, 1e12);
    assert_eq!(of_floats(two).data, clean.data);
}

#[test]
fn what_stands_for_no_data_is_found_and_named() {
    for (value, every) in [(-9999.0, 3), (65_535.0, 4), (-1e20, 50), (1e30, 7)] {
        let found = of_floats(with(blob(1000.0), 0, every, value));
        assert_eq!((found.padding, found.beyond, found.kind), (Some(f64::from(value)), false, DataKind::Intensity));
        assert!(found.window[0] == 0.0 && (found.window[1] / 1000.0 - 1.0).abs() < 0.1, "{found:?}");
        assert!(found.words().contains("no data"), "{}", found.words());
    }
    // 0 is a background, and not what stands for no data.
    let brain: Vec<f32> = blob(100.0).into_iter().map(|v| if v > 0.0 { 1000.0 + v } else { 0.0 }).collect();
    assert_eq!(of_floats(brain).padding, None);
}

#[test]
fn kinds_are_told_apart() {
    let kind = |voxels: Voxels| volume(voxels).contents().unwrap().kind;
    let mut random = Random(3);
    let noisy = |values: Vec<f32>, random: &mut Random| -> Vec<f32> {
        values.into_iter().map(|v| v + random.below(40) as f32 - 20.0).collect()
    };
    let scan = noisy(blob(3000.0), &mut random).into_iter().map(|v| v - 1000.0).collect();
    assert_eq!(kind(words(scan)), DataKind::Hounsfield);
    let magnitude = noisy(blob(800.0), &mut random).into_iter().map(f32::abs).collect();
    assert_eq!(kind(words(magnitude)), DataKind::Intensity);
    let region = |i: usize| ((i % SIDE / 10 * 4 + i / SIDE % SIDE / 8 * 3 + i / SIDE / SIDE / 9 * 5) % 31) as f32;
    let regions: Vec<f32> = (0..SIDE.pow(3)).map(region).collect();
    let steps = blob(40.0).into_iter().map(f32::ceil).collect();
    assert_eq!(kind(words(steps)), DataKind::Intensity, "smooth amounts");
    assert_eq!(kind(words(regions.clone())), DataKind::Labels);
    let far: Vec<f32> = regions.iter().map(|v| v * 31_278_200.0).collect();
    assert_eq!(kind(Voxels::F32(far)), DataKind::Labels);
    let mask = regions.iter().map(|v| u8::from(*v > 3.0)).collect();
    assert_eq!(kind(Voxels::U8(mask)), DataKind::Labels);
    let shifted: Vec<f32> = blob(12.0).into_iter().skip(9).chain([0.0; 9]).collect();
    let map: Vec<f32> = blob(12.0)
        .iter()
        .zip(&shifted)
        .map(|(a, b)| a - 0.6 * b)
        .map(|v| if v.abs() < 0.5 { 0.0 } else { v })
        .collect();
    let found = of_floats(map);
    assert_eq!(found.kind, DataKind::SignedMap);
    assert!(found.window[0] < -3.0 && found.window[1] > 7.0, "{found:?}");
    // What rings a little below 0 is no signed map.
    let ringing: Vec<f32> = blob(100.0).into_iter().map(|v| v - 4.0).collect();
    assert_eq!(of_floats(ringing).kind, DataKind::Intensity);
    assert_eq!(kind(Voxels::F32(vec![f32::NAN; SIDE.pow(3)])), DataKind::Intensity);
    assert_eq!(of_floats(vec![7.5; SIDE.pow(3)]).window, [7.5; 2]);
}

#[test]
fn labels_of_any_size_have_places() {
    let values = [0.0, 997.0, 4095.0, 4096.0, 70_000.0, 312_782_592.0];
    let voxels: Vec<f32> = (0..SIDE.pow(3)).map(|i| values[i / 7 % 6]).collect();
    let labels = volume(Voxels::F32(voxels.clone()));
    let indexed = labels.indexed().unwrap();
    assert_eq!(indexed.sharing, 0);
    assert_eq!(*indexed.values, values.map(f64::from));
    let Voxels::U16(places) = indexed.volume.voxels().unwrap() else { panic!("no words") };
    assert!(places.iter().zip(&voxels).all(|(place, value)| values[usize::from(*place)] == *value));
    let many = volume(Voxels::F32((0..SIDE.pow(3)).map(|i| i as f32).collect()));
    let indexed = many.indexed().unwrap();
    assert_eq!((indexed.values.len(), indexed.sharing), (4096, SIDE.pow(3) - 4096));
    assert_eq!(indexed.volume.range(), [0.0, 4095.0]);
}
