//! Reductions against double precision, and the same bits for every number of lanes and threads.

use cloudchamber::device::reduce::{self, Reduction};
use cloudchamber::device::{Buffer, Device};

use super::open;

/// Numbers of both signs and of sizes over twelve orders, without a pattern.
fn number(i: usize, seed: u64) -> f32 {
    let mixed = ((i as u64 + seed * 1_000_003).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33) as u32;
    let sign = if mixed & 1 == 0 { 1.0 } else { -1.0 };
    sign * 10f32.powi((mixed >> 8) as i32 % 13 - 6) * (1.0 + (mixed >> 16) as f32 / 65536.0)
}

fn with_reductions(lanes: Option<u32>) -> Device {
    let mut device = open(lanes, None);
    for variant in reduce::variants() {
        device.build(&reduce::source(), &variant).unwrap();
    }
    device
}

fn upload(device: &Device, values: &[f32]) -> Buffer {
    device.upload(bytemuck::cast_slice(values), 0).unwrap()
}

/// The bits of the sum, the inner product and the extremes.
fn reduced(device: &Device, a: &[f32], b: &[f32]) -> (f64, f64, Option<[f32; 2]>) {
    let mut reduction = Reduction::new(device, a.len()).unwrap();
    let (on_a, on_b) = (upload(device, a), upload(device, b));
    (
        reduction.sum(device, &on_a, a.len()).unwrap(),
        reduction.dot_product(device, &on_a, &on_b, a.len()).unwrap(),
        reduction.extremes(device, &on_a, a.len()).unwrap(),
    )
}

#[test]
fn reductions_are_those_of_double_precision_and_the_same_for_all_lanes() {
    let devices = [None, Some(1), Some(4), Some(8)].map(with_reductions);
    for count in [1, 2, 1023, 1024, 1025, 100_000] {
        let [a, b] = [1, 2].map(|seed| (0..count).map(|i| number(i, seed)).collect::<Vec<f32>>());
        let double = |values: &[f32]| values.iter().map(|v| f64::from(*v)).collect::<Vec<f64>>();
        let (wide_a, wide_b) = (double(&a), double(&b));
        let products: Vec<f64> = wide_a.iter().zip(&wide_b).map(|(a, b)| a * b).collect();
        let within = |found: f64, terms: &[f64], what: &str| {
            let (sum, size) = terms.iter().fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
            assert!((found - sum).abs() <= 1e-12 * size, "{what} of {count}: {found} for {sum}");
        };
        let first = reduced(&devices[0], &a, &b);
        within(first.0, &wide_a, "sum");
        within(first.1, &products, "inner product");
        let ends =
            [a.iter().copied().fold(f32::INFINITY, f32::min), a.iter().copied().fold(f32::NEG_INFINITY, f32::max)];
        assert_eq!(first.2, Some(ends));
        for device in &devices[1..] {
            let other = reduced(device, &a, &b);
            assert_eq!(
                (first.0.to_bits(), first.1.to_bits(), first.2),
                (other.0.to_bits(), other.1.to_bits(), other.2)
            );
        }
    }
}

#[test]
fn a_small_number_between_large_ones_is_not_lost() {
    let device = with_reductions(None);
    let values = [1e8, 1.0, -1e8, 0.5];
    let ones = [1.0; 4];
    let (sum, product, _) = reduced(&device, &values, &ones);
    assert_eq!((sum, product), (1.5, 1.5));
    // (1 + ε)² − 1 = 2 ε + ε² with ε = 2⁻¹³: ε² is past single precision.
    let e = 2f32.powi(-13);
    let (_, product, _) = reduced(&device, &[1.0 + e, 1.0], &[1.0 + e, -1.0]);
    assert_eq!(product, f64::from(e) * (2.0 + f64::from(e)));
}

#[test]
fn numbers_that_are_not_finite_are_no_extremes() {
    let device = with_reductions(None);
    let all = [f32::NAN, 3.0, f32::INFINITY, -2.0, f32::NEG_INFINITY];
    assert_eq!(reduced(&device, &all, &all).2, Some([-2.0, 3.0]));
    let none = [f32::NAN; 3];
    assert_eq!(reduced(&device, &none, &none).2, None);
}

#[test]
fn more_than_there_is_room_for_is_refused() {
    let device = with_reductions(None);
    let buffer = upload(&device, &[1.0; 8]);
    let mut reduction = Reduction::new(&device, 8).unwrap();
    assert!(reduction.sum(&device, &buffer, 9).is_err());
    let mut larger = Reduction::new(&device, 16).unwrap();
    assert!(larger.sum(&device, &buffer, 16).is_err());
}
