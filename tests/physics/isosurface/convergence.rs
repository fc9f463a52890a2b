//! The order of the errors: in the step for the plain form, in the voxel for the refined one.

use glam::DVec3;
use serde_json::{Value, json};

use super::depth::{SIDE, depths};
use crate::common::engine::House;
use crate::emission_absorption::oracle::{Eye, inside};
use crate::projection::grid::Grid;

const RADIUS: f64 = 0.7;

fn eye() -> Eye {
    Eye::at([1.3, 0.9, 2.4], 24.0)
}

/// The distance at which a pixel's ray meets the sphere, and the cosine there.
fn sphere(eye: &Eye, pixel: usize) -> Option<(f64, f64)> {
    let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
    let (b, c) = (eye.eye.dot(d), eye.eye.length_squared() - RADIUS * RADIUS);
    let root = (b * b - c).sqrt();
    root.is_finite().then(|| (-b - root, ((eye.eye + d * (-b - root)) / RADIUS).dot(-d)))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    assert!(values.len() > 100, "{} values", values.len());
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean error of the depth of a sphere in a smooth field of n³ voxels.
fn sphere_error(n: usize, interpolation: &str) -> f64 {
    let house = House::shared();
    let volume = house.floats([n; 3], |x, y, z| (-(x * x + y * y + z * z)).exp());
    let parameters = json!({"isovalue": (-RADIUS * RADIUS).exp(), "interpolation": interpolation});
    let eye = eye();
    let found = depths(house, &volume, &eye.json(), &parameters);
    mean((0..SIDE * SIDE).filter_map(|pixel| {
        let (truth, facing) = sphere(&eye, pixel)?;
        (facing > 0.4).then(|| (found[pixel].unwrap() - truth).abs())
    }))
}

#[test]
fn the_depth_of_a_smooth_surface_is_of_the_interpolations_order_in_the_voxel() {
    for (interpolation, order) in [("trilinear", 1.8..2.3), ("b_spline", 1.8..2.3), ("catmull_rom", 2.7..4.3)] {
        let errors = [12, 24, 48].map(|n| sphere_error(n, interpolation));
        let slope = (errors[0] / errors[2]).log2() / 2.0;
        println!("{interpolation}: {errors:?}, order {slope:.2}");
        assert!(order.contains(&slope), "{interpolation}: order {slope:.2} from {errors:?}");
    }
}

/// The start of the first voxel at or above the isovalue along a ray, by a scan in 1000ths of a voxel.
fn face(grid: &Grid, isovalue: f64, eye: &Eye, d: DVec3) -> Option<f64> {
    let (near, far) = inside(eye.eye, d, DVec3::ONE)?;
    let step = 2e-3 / grid.dims[0] as f64;
    let at = |i: usize| near + i as f64 * step;
    (0..((far - near) / step) as usize).find(|i| grid.value(eye.eye + d * at(*i), "nearest") >= isovalue).map(at)
}

#[test]
fn the_plain_forms_depth_is_of_first_order_in_the_step() {
    let house = House::shared();
    let (n, isovalue) = (20, (-RADIUS * RADIUS).exp());
    let centre = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let value = |i: usize| DVec3::new(centre(i % n), centre(i / n % n), centre(i / n / n)).length_squared();
    let grid = Grid { dims: [n; 3], voxels: (0..n * n * n).map(|i| (-value(i)).exp() as f32).collect() };
    let (volume, eye) = (grid.store(house), eye());
    let truth: Vec<Option<f64>> =
        (0..SIDE * SIDE).map(|p| face(&grid, isovalue, &eye, eye.direction(p % SIDE, p / SIDE, SIDE))).collect();
    let overshoot = |step_voxels: f64| {
        let parameters = json!({"isovalue": isovalue, "sampling": "nearest", "step_voxels": step_voxels});
        let found = depths(house, &volume, &eye.json(), &parameters);
        let beyond: Vec<f64> = found.iter().zip(&truth).filter_map(|(f, t)| Some((*f)? - (*t)?)).collect();
        // A corner that is thinner than a step may be missed, and the next voxel is then met instead.
        let step = step_voxels * 2.0 / n as f64;
        let late = beyond.iter().filter(|b| **b > step + 1e-4).count();
        assert!(late * 10 < beyond.len(), "{late} of {} are later than a step", beyond.len());
        assert!(beyond.iter().all(|b| *b > -3e-4), "met before its face");
        mean(beyond.into_iter().filter(|b| *b <= step + 1e-4))
    };
    let errors = [1.0, 0.5, 0.25, 0.125].map(overshoot);
    let order = (errors[0] / errors[3]).log2() / 3.0;
    println!("plain form: {errors:?}, order {order:.2}");
    assert!((order - 1.0).abs() < 0.15, "order {order:.2} from {errors:?}");
    // A sample may be anywhere in the step that has the face.
    assert!((errors[1] / (0.5 * 0.5 * 2.0 / n as f64) - 1.0).abs() < 0.15, "{errors:?}");
}

#[test]
fn the_step_plays_no_part_where_surfaces_are_thick() {
    let house = House::shared();
    let volume = house.floats([32; 3], |x, y, z| (-(x * x + y * y + z * z)).exp());
    let of = |step_voxels: f64| -> Vec<Option<f64>> {
        let own: Value = json!({"isovalue": 0.6, "step_voxels": step_voxels});
        depths(house, &volume, &eye().json(), &own)
    };
    let fine = of(0.25);
    for step_voxels in [0.5, 1.0, 3.0] {
        for (a, b) in of(step_voxels).iter().zip(&fine) {
            // At the rim a chord is shorter than a step.
            if let (Some(a), Some(b)) = (a, b) {
                assert!((a - b).abs() < 3e-4 * 2.0 / 32.0 + 2e-6, "step {step_voxels}: {a} and {b}");
            }
        }
    }
}
