//! The sums of a film's variances against double precision, for grids of all kinds.

use cloudchamber::device::variance::{self, VariancePass};
use cloudchamber::device::{Buffer, Device, DeviceConfig};

use super::open;
use crate::common::processes::under_oclgrind;

/// Numbers in 0…1 without a pattern.
fn number(i: usize, seed: usize) -> f32 {
    ((i + seed * 1_000_003).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f32 / (1u32 << 24) as f32
}

fn with_variance(lanes: Option<u32>) -> Device {
    let mut device = open(lanes, None);
    variance::build(&mut device).unwrap();
    device
}

/// A film of `pixels` pixels: colours of which a thirteenth are infinite, and squared deviations of which an eleventh are not known.
struct Film {
    colours: Vec<f32>,
    deviations: Vec<f32>,
}

impl Film {
    fn new(pixels: usize) -> Self {
        let colour = |i: usize| if i.is_multiple_of(52) { f32::INFINITY } else { 3.0 + number(i, 1) };
        let deviation = |i: usize| if i.is_multiple_of(11) { f32::NAN } else { number(i, 2) };
        Self { colours: (0..4 * pixels).map(colour).collect(), deviations: (0..pixels).map(deviation).collect() }
    }

    fn upload(&self, device: &Device) -> Buffer {
        let all = [bytemuck::cast_slice(&self.colours), bytemuck::cast_slice(&self.deviations)].concat();
        device.upload(&all, 0).unwrap()
    }

    /// The variance of the cluster with its upper left pixel at x, y, by its definition.
    fn variance(&self, pass: &VariancePass, x: usize, y: usize) -> f64 {
        let width = pass.width as usize;
        let pixels = [0, 1, width, width + 1].map(|n| y * width + x + n);
        if pass.of_colours == 0 {
            return pixels.map(|i| f64::from(self.deviations[i])).iter().sum();
        }
        let of = |i: usize| {
            [0.2126, 0.7152, 0.0722].iter().zip(&self.colours[4 * i..]).map(|(k, c)| k * f64::from(*c)).sum::<f64>()
        };
        let luminances = pixels.map(of);
        let mean = luminances.iter().sum::<f64>() / 4.0;
        luminances.iter().map(|l| (l - mean).powi(2)).sum()
    }

    /// The sums by their definition.
    fn sums(&self, pass: &VariancePass) -> Vec<f64> {
        let (side, across) = (pass.side as usize, (pass.side * pass.cells[0]) as usize);
        let mut sums = vec![0.0; 2 * side * across];
        for y in 0..side * pass.cells[1] as usize {
            let half = usize::from(!(y / side).is_multiple_of(pass.sparse as usize));
            for x in 0..across {
                let variance = self.variance(pass, 2 * x, 2 * y);
                sums[(half * side + y % side) * across + x] += if variance.is_finite() { variance } else { 0.0 };
            }
        }
        sums
    }
}

/// Compares the sums of all kinds, on one device.
fn compare(device: &Device) -> Vec<f32> {
    let mut all = Vec::new();
    // A film may be wider and higher than the grid's cells.
    for (width, height, side, cells, sparse) in
        [(12, 8, 2, [3, 2], 1), (13, 9, 2, [3, 2], 2), (41, 31, 5, [4, 3], 2), (6, 26, 3, [1, 4], 4)]
    {
        let film = Film::new((width * height) as usize);
        let on_device = film.upload(device);
        for of_colours in [0, 1] {
            let pass = VariancePass { width, height, side, cells, sparse, of_colours };
            let found = variance::of_clusters(device, &on_device, &pass).unwrap();
            let truth = film.sums(&pass);
            assert_eq!(found.len(), truth.len());
            for (found, truth) in found.iter().zip(&truth) {
                assert!((f64::from(*found) - truth).abs() <= 2e-6 * (1.0 + truth), "{pass:?}: {found} for {truth}");
            }
            all.extend(found);
        }
    }
    all
}

#[test]
fn variances_are_those_of_double_precision_and_the_same_for_all_lanes() {
    let all = [None, Some(1), Some(4), Some(8)].map(|lanes| compare(&with_variance(lanes)));
    assert!(all.iter().all(|sums| *sums == all[0]));
}

#[test]
fn the_kernel_of_variances_is_clean_under_oclgrind() {
    let name = "device::variances::the_kernel_of_variances_is_clean_under_oclgrind";
    let log = under_oclgrind(name, || {
        let config = DeviceConfig { target: "oclgrind".into(), lanes: Some(1), ..DeviceConfig::pocl() };
        let mut device = Device::open(&config).unwrap();
        variance::build(&mut device).unwrap();
        compare(&device);
    });
    assert_eq!(log.trim(), "");
}
