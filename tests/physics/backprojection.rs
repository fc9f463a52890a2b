//! `backprojection`: the 1/r of a point, and the bytes of any number of lanes.

use serde_json::json;

use crate::common::engine::House;
use crate::tomography::{phantom, reconstructed};

#[test]
fn a_point_becomes_one_over_r() {
    // A small Gaussian of mass M blurs to M / r, farther away than its size.
    let (sigma, value) = (1.0, 2.0);
    let phantom = json!({"shapes": [{"type": "gaussian", "value": value, "axes_mm": [sigma, sigma]}]});
    let geometry = json!({"angles_deg": {"count": 400}, "detector": {"count": [257, 1], "spacing_mm": [0.5, 0.5]}});
    let own = json!({"sinogram": {"projection": {"of": {"phantom": phantom}, "geometry": geometry}},
        "grid": {"dims": [81, 81, 1], "spacing_mm": [1, 1, 1]}});
    let found = reconstructed("backprojection", &own);
    let mass = value * std::f64::consts::TAU * sigma * sigma;
    for (x, y) in [(10i32, 0i32), (0, -20), (14, 14), (-30, 11)] {
        let r = f64::from(x * x + y * y).sqrt();
        let at = found.values[((y + 40) * 81 + x + 40) as usize];
        // The next term of the blurred 1/r is σ² / 2r².
        let truth = mass / r * (1.0 + sigma * sigma / (2.0 * r * r));
        assert!((at / truth - 1.0).abs() < 0.01, "{x} {y}: {at}, {truth}");
    }
    // In the middle it is π times the greatest value of a view, √(2π) σ value.
    let middle = found.values[40 * 81 + 40];
    let truth = std::f64::consts::PI * std::f64::consts::TAU.sqrt() * sigma * value;
    assert!((middle / truth - 1.0).abs() < 0.03, "{middle}, {truth}");
}

#[test]
fn deblurred_afterwards_it_is_the_object_but_for_slow_changes() {
    let phantom_request = json!({"shapes": [{"type": "gaussian", "axes_mm": [9, 9]},
        {"type": "gaussian", "value": 2, "axes_mm": [12, 5], "center_mm": [6, -12, 0], "angle_deg": 25}]});
    let geometry = json!({"angles_deg": {"count": 200}, "detector": {"count": [192, 1]}});
    let of = |deconvolve: bool, side: usize| {
        let own = json!({"sinogram": {"projection": {"of": {"phantom": phantom_request}, "geometry": geometry}},
            "grid": {"dims": [side, side, 1], "spacing_mm": [1, 1, 1]}, "deconvolve": deconvolve});
        reconstructed("backprojection", &own).apart(&phantom(&phantom_request), 1.0, 50.0)[0]
    };
    let (small, large) = (of(true, 128), of(true, 256));
    assert!(of(false, 128) > 10.0, "the plain one is in other units");
    assert!(small < 0.04 && large < 0.4 * small, "a wider margin leaves less: {small:.2e}, {large:.2e}");
}

#[test]
fn every_number_of_lanes_reconstructs_the_same() {
    let own = json!({"sinogram": {"projection": {"of": {"phantom": {"name": "shepp_logan", "dimensions": 3, "radius_mm": 20}},
        "geometry": {"angles_deg": {"count": 70}, "detector": {"count": [50, 9]}}}}, "grid": {"dims": [37, 29, 11], "spacing_mm": [1.1, 1.3, 0.8]}});
    let request = json!({"technique": "slice", "volume": {"fbp": own}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}});
    let of = |house: &House| {
        let field = house.finish(&request).field().expect("a field");
        let values = field.values().unwrap();
        (0..field.voxel_count()).map(|i| values.of(i)).collect::<Vec<f64>>()
    };
    let plain = of(House::of_lanes(1));
    let greatest = plain.iter().fold(0.0f64, |most, v| v.abs().max(most));
    for lanes in [4, 8, 16] {
        let found = of(House::of_lanes(lanes));
        let apart = plain.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 2e-5 * greatest, "{lanes}: {apart} of {greatest}");
    }
}
