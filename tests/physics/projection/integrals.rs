//! Line integrals against the host reference, for every interpolation, anisotropic and degenerate grids, and with holes.

use serde_json::json;

use super::grid::{Grid, eyes, numbers, rays};
use crate::common::engine::House;

fn check(grid: &Grid, interpolation: &str) {
    let house = House::shared();
    let volume = grid.store(house);
    let sigma = 0.9;
    for eye in eyes() {
        let of = |mode: &str| {
            let parameters =
                json!({"mode": mode, "interpolation": interpolation, "sigma_per_value": sigma, "zero_value": 0.1});
            numbers(house, &volume, &eye, &parameters)
        };
        let (sum, mean, xray) = (of("sum"), of("mean"), of("xray"));
        for (pixel, d, _) in rays(&eye) {
            let (truth, length) = grid.integral(eye.eye, d, interpolation);
            let said = format!("{:?} {interpolation}, eye {:?}, pixel {pixel}", grid.dims, eye.eye);
            assert!((sum[pixel].0 - truth).abs() < 1e-4, "{said}: sum {} for {truth}", sum[pixel].0);
            let through = (-sigma * (truth - 0.1 * length)).exp();
            assert!((xray[pixel].0 - through).abs() < 1e-4, "{said}: X-ray {} for {through}", xray[pixel].0);
            // The mean over a very short stretch has few digits and is not tested.
            if length > 0.05 {
                assert!(
                    (mean[pixel].0 - truth / length).abs() < 1e-4,
                    "{said}: mean {} for {}",
                    mean[pixel].0,
                    truth / length
                );
                assert!(mean[pixel].1, "{said}");
            }
        }
    }
}

#[test]
fn trilinear_is_exact() {
    check(&Grid::random([7, 5, 9]), "trilinear");
    check(&Grid::random([16, 16, 16]), "trilinear");
}

#[test]
fn nearest_is_exact() {
    check(&Grid::random([7, 5, 9]), "nearest");
}

#[test]
fn splines_are_exact() {
    for interpolation in ["b_spline", "catmull_rom"] {
        check(&Grid::random([6, 5, 7]), interpolation);
    }
}

#[test]
fn degenerate_grids_are_exact() {
    for dims in [[1, 1, 1], [1, 4, 5], [4, 1, 3], [5, 3, 1], [2, 2, 2], [1, 1, 6]] {
        for interpolation in ["trilinear", "nearest", "catmull_rom"] {
            check(&Grid::random(dims), interpolation);
        }
    }
}

#[test]
fn holes_are_empty() {
    for interpolation in ["trilinear", "nearest"] {
        let mut grid = Grid::random([8, 8, 8]);
        for i in [0, 77, 219, 220, 300, 511] {
            grid.voxels[i] = f32::NAN;
        }
        check(&grid, interpolation);
    }
}

#[test]
fn holes_are_counted_and_nothing_but_holes_is_transparent() {
    let house = House::shared();
    for mode in ["maximum", "minimum", "mean", "sum"] {
        let volume = house.floats([6, 6, 6], |_, _, _| f64::NAN);
        let job = house.finish(&json!({
            "technique": "projection", "volume": volume, "image": {"width": 16, "height": 16}, "budget": {"samples": 2},
            "projection": {"mode": mode}
        }));
        let film = house.film_of(&job);
        assert!(film.main.mean.iter().all(|v| *v == 0.0), "{mode}");
        assert_eq!(job.resource()["counts"]["non_finite_voxels"], 216);
        assert_eq!(job.resource()["counts"]["non_finite_samples"], 0);
    }
}

#[test]
fn the_step_plays_no_part() {
    let house = House::shared();
    let volume = Grid::random([12, 12, 12]).store(house);
    for mode in ["sum", "mean", "xray"] {
        let request = |samples: u32| {
            json!({
                "technique": "projection", "volume": volume, "image": {"width": 64, "height": 64},
                "budget": {"samples": samples}, "projection": {"mode": mode, "output": "value"}
            })
        };
        for samples in [1, 16] {
            let (_, error) = house.film(&request(samples));
            assert_eq!(error.discretisation, Some(0.0), "{mode}: {error:?}");
            assert!(error.noise.unwrap() > 0.0, "the place in the pixel plays one: {mode}: {error:?}");
        }
    }
}
