//! Grids of fields on the device: the same bits as the host's, and on the host only if somebody asks.

use std::sync::Arc;

use cloudchamber::device::grid::{self, Grid, NEAR_OVERFLOW};
use cloudchamber::device::reduce;
use cloudchamber::device::{Buffer, Device, DeviceConfig};
use cloudchamber::volume::{DeviceGrid, GridStatistics, NewVolume, Volume, Voxels};
use serde_json::{Value, json};

use super::open;
use crate::common::engine::House;
use crate::common::processes::under_oclgrind;

fn with_grids(mut device: Device) -> Device {
    let of = |source: cloudchamber::device::program::Source| {
        (source.variants)().into_iter().map(move |v| (source.clone(), v))
    };
    for (source, variant) in of(grid::source()).chain(of(reduce::source())) {
        device.build(&source, &variant).unwrap();
    }
    device
}

fn upload(device: &Device, values: &[f32]) -> Buffer {
    device.upload(bytemuck::cast_slice(values), grid::PADDING).unwrap()
}

fn read(device: &Device, buffer: Buffer, voxels: usize) -> Vec<f32> {
    Grid::new(device, buffer, voxels).unwrap().read().unwrap()
}

/// Whole numbers without a pattern.
fn numbers(count: usize) -> Vec<u64> {
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state
    };
    (0..count).map(|_| next()).collect()
}

/// Floats of both signs and many sizes, with equal neighbours.
fn floats(count: usize) -> Vec<f32> {
    let value = |n: &u64| (*n as i64 >> 40) as f32 * 2f32.powi((n % 40) as i32 - 20);
    let mut all: Vec<f32> = numbers(count).iter().map(value).collect();
    all.iter_mut().skip(count / 3).take(count / 5).for_each(|v| *v = 0.25);
    all
}

#[test]
fn floats_of_sums_are_those_of_the_hosts_double_precision() {
    let device = with_grids(open(None, None));
    for (voxels, grids) in [(1, 1), (5, 3), (1000, 2), (4099, 1)] {
        // Sums of all sizes: positive, negative, and such that the total wraps round.
        let sums: Vec<u64> = numbers(voxels * grids).iter().map(|n| ((*n as i64) >> (n % 61)) as u64).collect();
        let scale = 1.0 / (1.2345e-3 * 1_073_741_824.0 * 777.0);
        let expected = (0..voxels).map(|voxel| {
            let total = (0..grids).fold(0u64, |total, grid| total.wrapping_add(sums[grid * voxels + voxel]));
            (total as i64 as f64 * scale) as f32
        });
        let on_device = device.upload(bytemuck::cast_slice(&sums), 0).unwrap();
        let (values, _) = grid::of_sums(&device, &on_device, [voxels, grids], scale).unwrap();
        assert_eq!(read(&device, values, voxels), expected.collect::<Vec<f32>>(), "{voxels} voxels, {grids} grids");
    }
}

#[test]
fn sums_near_the_end_of_their_range_are_told() {
    let device = with_grids(open(None, None));
    let tells = |sums: [u64; 6], grids: usize| {
        let on_device = device.upload(bytemuck::cast_slice(&sums), 0).unwrap();
        grid::of_sums(&device, &on_device, [6 / grids, grids], 1.0).unwrap().1
    };
    assert!(!tells([0, 0, 0, 1 << 60, 0, NEAR_OVERFLOW], 1), "sums with room to spare");
    assert!(
        tells([0, 0, 0, 0, NEAR_OVERFLOW + 1, 0], 1) && tells([0, (NEAR_OVERFLOW + 1).wrapping_neg(), 0, 0, 0, 0], 1)
    );
    // A positive 2^63 is negative: it has wrapped round.
    assert!(tells([0, 1 << 63, 0, 0, 0, 0], 1), "a sum that has wrapped round");
    assert!(tells([0, 1 << 60, 0, 0, (1 << 60) + 1, 0], 2), "the total of two grids");
    let short = device.upload(&[0; 40], 0).unwrap();
    assert!(grid::of_sums(&device, &short, [3, 2], 1.0).is_err(), "fewer sums than there should be");
}

/// The statistics as the host finds them.
fn expected(values: &[f32]) -> GridStatistics {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    finite.sort_by(f32::total_cmp);
    let rank = (finite.len().saturating_sub(1) as f64 * GridStatistics::UPPER) as usize;
    GridStatistics {
        range: finite.first().map(|least| [*least, finite[finite.len() - 1]]),
        non_finite: (values.len() - finite.len()) as u64,
        upper: finite.get(rank).copied().unwrap_or(0.0),
    }
}

fn found(device: &Device, values: &[f32]) -> (GridStatistics, Vec<f32>) {
    let buffer = upload(device, values);
    let statistics = grid::statistics(device, &buffer, values.len()).unwrap();
    (statistics, read(device, buffer, values.len()))
}

#[test]
fn statistics_are_those_of_the_sorted_values() {
    let device = with_grids(open(None, None));
    for count in [1, 2, 499, 500, 501, 1024, 1025, 100_000] {
        let values = floats(count);
        assert_eq!(found(&device, &values), (expected(&values), values), "{count} values");
    }
    for same in [0.0, -3.5, 1e-40, f32::MAX] {
        assert_eq!(found(&device, &[same; 700]).0, expected(&[same; 700]), "all are {same}");
    }
}

#[test]
fn values_that_are_not_finite_become_nan_and_are_counted() {
    let device = with_grids(open(None, None));
    let mut values = floats(3000);
    (values[3], values[1700], values[2999]) = (f32::INFINITY, f32::NEG_INFINITY, f32::NAN);
    let (statistics, after) = found(&device, &values);
    assert_eq!((statistics, statistics.non_finite), (expected(&values), 3));
    for (before, after) in values.iter().zip(after) {
        assert!(if before.is_finite() { *before == after } else { after.is_nan() }, "{before} became {after}");
    }
    let none = found(&device, &[f32::NAN, f32::INFINITY]).0;
    assert_eq!(none, GridStatistics { range: None, non_finite: 2, upper: 0.0 });
}

fn parts(dims: [usize; 3], voxels: Vec<f32>) -> NewVolume {
    NewVolume {
        dims,
        spacing: [0.5, 1.0, 2.0],
        linear: None,
        voxels: Voxels::F32(voxels),
        slope: 1.0,
        inter: 0.0,
        name: "grid".into(),
        format: "field".into(),
        file_affine: None,
        unit: "mm".into(),
        notes: Vec::new(),
    }
}

/// The same volume, its voxels on the host and on the device.
fn twins(device: &Device) -> (Volume, Volume) {
    let dims = [13, 9, 11];
    let values: Vec<f32> = floats(dims.iter().product()).iter().map(|v| v.abs().min(40.0)).collect();
    let buffer = upload(device, &values);
    let statistics = grid::statistics(device, &buffer, values.len()).unwrap();
    let grid = Arc::new(Grid::new(device, buffer, values.len()).unwrap());
    let away = Volume::on_device(parts(dims, Vec::new()), grid, &statistics).unwrap();
    (Volume::new(parts(dims, values)).unwrap(), away)
}

#[test]
fn a_volume_on_the_device_is_that_of_the_host() {
    let (here, away) = twins(&with_grids(open(None, None)));
    assert_eq!((away.range(), away.non_finite(), away.bytes()), (here.range(), here.non_finite(), here.bytes()));
    assert_eq!((away.spacing(), away.world_from_index()), (here.spacing(), here.world_from_index()));
    assert!(here.is_on_host() && !away.is_on_host(), "nobody has asked for its voxels");
    assert_eq!(away.histogram().unwrap(), here.histogram().unwrap());
    assert_eq!(away.bright_mean().unwrap(), here.bright_mean().unwrap());
    assert_eq!(away.voxels().unwrap(), here.voxels().unwrap());
    assert!(away.is_on_host() && away.device_grid().is_some(), "voxels that are read stay on the device");
}

#[test]
fn words_made_on_the_device_are_those_of_the_host() {
    let device = with_grids(open(None, None));
    let (here, away) = twins(&device);
    let (of_host, of_device) = (here.words(f64::MAX).unwrap(), away.words(f64::MAX).unwrap());
    let (_, scale) = of_device.device_grid().unwrap();
    let Voxels::F32(values) = here.voxels().unwrap() else { panic!("the grid has floats") };
    let made = grid::in_words(&device, &upload(&device, values), values.len(), scale.unwrap()).unwrap();
    let mut words = vec![0u16; values.len()];
    device.read(&made, 0, &mut words).unwrap();
    assert_eq!(&Voxels::U16(words), of_host.voxels().unwrap());
    assert!(!of_device.is_on_host());
    assert_eq!(of_device.voxels().unwrap(), of_host.voxels().unwrap(), "on the host they are the same too");
    let Voxels::U16(of_words) = of_host.voxels().unwrap() else { panic!("they are words") };
    let mut sorted = of_words.clone();
    sorted.sort_unstable();
    let rank = ((sorted.len() - 1) as f64 * GridStatistics::UPPER) as usize;
    let upper = f64::from(sorted[rank]) * of_host.slope() + of_host.inter();
    assert_eq!(of_device.upper(), Some(upper), "the quantile of the words");
    let told =
        |v: &Volume| (v.voxel_type(), v.slope(), v.inter(), v.range(), v.histogram().unwrap().clone(), v.bytes());
    assert_eq!(told(&of_device), told(&of_host));
}

#[test]
fn a_volume_that_leaves_the_device_keeps_its_voxels() {
    let (here, away) = twins(&with_grids(open(None, None)));
    let words = away.words(f64::MAX).unwrap();
    away.leave_device().unwrap();
    assert!(away.device_grid().is_none() && words.device_grid().is_none(), "the device's memory is free");
    assert_eq!(away.voxels().unwrap(), here.voxels().unwrap());
    assert_eq!(words.voxels().unwrap(), here.words(f64::MAX).unwrap().voxels().unwrap());
}

#[test]
fn a_grid_without_room_behind_it_is_refused() {
    let device = open(None, None);
    let short = device.upload(&[0; 16], 0).unwrap();
    assert!(Grid::new(&device, short, 4).is_err());
}

/// A job with a small field.
fn simulated(technique: &str, own: &Value) -> Value {
    let mut request = json!({"technique": technique, "image": {"width": 16, "height": 16}, "budget": {"samples": 1},
        "volume": {"photon_transport": {"photons": 2000, "grid": [10, 11, 12]}}});
    request[technique] = own.clone();
    request
}

#[test]
fn a_field_is_looked_at_and_exported_without_a_trip_through_the_host() {
    let house = House::shared();
    for (technique, own) in [
        ("emission_absorption", json!({})),
        ("emission_absorption", json!({"interpolation": "b_spline"})),
        ("projection", json!({"mode": "maximum"})),
        ("slice", json!({})),
        ("isosurface", json!({"isovalue": 0.001})),
    ] {
        let field = house.finish(&simulated(technique, &own)).field().unwrap();
        assert!(!field.is_on_host() && field.range()[1] > 0.0, "{technique} {own}");
    }
    let mut export = simulated("histogram", &json!({"bins": 4}));
    export.as_object_mut().unwrap().retain(|field, _| field != "image" && field != "budget");
    let field = house.export(&export).field().unwrap();
    assert!(!field.is_on_host(), "the histogram counts on the device");
    assert!(field.values().unwrap().at(5, 5, 1) > 0.0 && field.is_on_host(), "whoever asks gets it");
}

#[test]
fn grids_are_clean_under_oclgrind() {
    let log = under_oclgrind("device::grids::grids_are_clean_under_oclgrind", || {
        let config = DeviceConfig { target: "oclgrind".into(), lanes: Some(4), ..DeviceConfig::pocl() };
        let device = with_grids(Device::open(&config).unwrap());
        let values = [1.0, f32::NAN, 3.0, f32::INFINITY, -2.0];
        assert_eq!(found(&device, &values).0, expected(&values));
        let sums = device.upload(bytemuck::cast_slice(&[1u64, 2, 3, 4, 5, 6]), 0).unwrap();
        let (totals, _) = grid::of_sums(&device, &sums, [3, 2], 0.5).unwrap();
        assert_eq!(read(&device, totals, 3), [2.5, 3.5, 4.5]);
        let scale = cloudchamber::volume::WordScale { first: 1.0, per_value: 2.0 };
        drop(grid::in_words(&device, &upload(&device, &[1.0, 2.0, 3.0]), 3, scale).unwrap());
    });
    assert_eq!(log.trim(), "");
}
