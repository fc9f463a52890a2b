//! The greatest and the least value: exact against a fine scan, and on steps with second order.

use serde_json::json;

use super::grid::{Grid, eyes, numbers, rays};
use crate::common::engine::House;
use crate::emission_absorption::oracle::Eye;

fn check(grid: &Grid, interpolation: &str) {
    let house = House::shared();
    let negative = Grid { dims: grid.dims, voxels: grid.voxels.iter().map(|v| -v).collect() };
    let (volume, turned) = (grid.store(house), negative.store(house));
    for eye in eyes() {
        let of = |volume, mode: &str| {
            numbers(house, volume, &eye, &json!({"mode": mode, "interpolation": interpolation, "exact": true}))
        };
        let (greatest, least) = (of(&volume, "maximum"), of(&turned, "minimum"));
        for (pixel, d, _) in rays(&eye) {
            let truth = grid.greatest(eye.eye, d, interpolation);
            let said = format!("{:?} {interpolation}, eye {:?}, pixel {pixel}", grid.dims, eye.eye);
            assert_eq!(greatest[pixel].1, truth.is_some(), "{said}");
            // The scan of 200 points a stretch may miss the top by a little. The device may never be above it by more than that.
            let truth = truth.unwrap_or(0.0);
            assert!((greatest[pixel].0 - truth).abs() < 1e-4, "{said}: {} for {truth}", greatest[pixel].0);
            assert!((least[pixel].0 + truth).abs() < 1e-4, "{said}: {} for {}", least[pixel].0, -truth);
        }
    }
}

#[test]
fn exact_ones_are_the_interpolants() {
    check(&Grid::random([7, 5, 9]), "trilinear");
    for dims in [[1, 1, 1], [1, 4, 5], [5, 3, 1], [2, 2, 2]] {
        check(&Grid::random(dims), "trilinear");
    }
}

#[test]
fn nearest_ones_are_the_voxels() {
    // A corner that a ray grazes for a millionth of its length may be seen or not. Smooth voxels make that harmless.
    let smooth =
        |i: usize| ((i % 7) as f32 * 0.9).sin() * 1e-3 + 0.5 * ((i / 7 % 5) as f32 * 0.01) + 1e-4 * (i / 35) as f32;
    check(&Grid { dims: [7, 5, 9], voxels: (0..315).map(smooth).collect() }, "nearest");
    check(&Grid::random([1, 1, 1]), "nearest");
}

#[test]
fn holes_are_passed_over() {
    let mut grid = Grid::random([8, 8, 8]);
    for i in [0, 77, 219, 220, 300, 511] {
        grid.voxels[i] = f32::NAN;
    }
    check(&grid, "trilinear");
}

#[test]
fn on_steps_it_converges_with_second_order_from_below() {
    // The sheet is many voxels thick, so that the interpolant looks smooth to the step. It is aslant, so that each ray meets its crest at another
    // part of a step.
    let house = House::shared();
    let sheet = |x: f64, y: f64, _: f64| (-4.0 * (0.958 * x + 0.287 * y).powi(2)).exp();
    let volume = house.floats([96; 3], sheet);
    let eye = Eye::at([2.1, 1.7, 2.3], 36.0);
    for (mode, interpolation) in [("maximum", "trilinear"), ("maximum", "b_spline")] {
        let of = |more: serde_json::Value| {
            let mut parameters = json!({"mode": mode, "interpolation": interpolation});
            parameters.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            numbers(house, &volume, &eye, &parameters)
        };
        let truth =
            if interpolation == "trilinear" { of(json!({"exact": true})) } else { of(json!({"step_voxels": 0.1})) };
        let errors = [12.0, 6.0, 3.0].map(|step| {
            let got = of(json!({"step_voxels": step}));
            let errors: Vec<f64> =
                rays(&eye).map(|r| r.0).filter(|p| truth[*p].0 > 0.999).map(|p| truth[p].0 - got[p].0).collect();
            assert!(errors.iter().all(|e| *e > -1e-5), "step {step}: above the greatest value");
            errors.iter().sum::<f64>() / errors.len() as f64
        });
        let order = (errors[0] / errors[2]).log2() / 2.0;
        println!("{mode} {interpolation}: {errors:?}, order {order}");
        assert!(order > 1.8, "{errors:?}: order {order}");
    }
}

#[test]
fn the_stated_error_covers_the_real_one() {
    let house = House::shared();
    for volume in [house.file(crate::common::mri_head()), json!({"builtin": "smoke", "resolution": 64})] {
        let film = |exact: bool| {
            house.film(&json!({
                "technique": "projection", "volume": volume, "image": {"width": 96, "height": 96}, "budget": {"samples": 16},
                "projection": {"exact": exact, "output": "value"}
            }))
        };
        let ((truth, _), (film, error)) = (film(true), film(false));
        let real = truth.difference(&film).unwrap();
        println!("{volume}: real {real}, stated {error:?}");
        // Both films went through the same places of the pixels, so the difference is the step's alone.
        assert!(error.total.unwrap() > 0.7 * real, "{volume}: says {error:?}, is {real}");
    }
}
