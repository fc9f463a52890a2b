//! Closed forms: an ellipsoid's chords, Beer and Lambert's law through a box, a ramp.

use glam::{DVec3, dvec3};
use serde_json::json;

use super::grid::{Grid, eyes, numbers, rays};
use crate::common::engine::House;
use crate::emission_absorption::oracle::{Eye, inside};

const AXES: DVec3 = dvec3(0.8, 0.55, 0.65);

/// The part of a ray inside the ellipsoid, and c of |p/axes|² = c (t − t₁)(t − t₂) + 1 along it.
fn chord(eye: DVec3, d: DVec3) -> Option<(f64, f64)> {
    let (o, d) = (eye / AXES, d / AXES);
    let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
    let root = b * b - a * c;
    (root > 0.0).then(|| (2.0 * root.sqrt() / a, a))
}

/// The mean error over the rays of ∫ v ds of a phantom that is sampled at n³ voxels.
fn error_at(n: usize, value: impl Fn(DVec3) -> f64, truth: impl Fn(DVec3, DVec3) -> f64) -> f64 {
    let house = House::shared();
    let volume = house.floats([n; 3], |x, y, z| value(dvec3(x, y, z)));
    let eye = Eye::at([2.1, 1.7, 2.3], 36.0);
    let got = numbers(house, &volume, &eye, &json!({"mode": "sum"}));
    let errors: Vec<f64> = rays(&eye).map(|(pixel, d, _)| (got[pixel].0 - truth(eye.eye, d)).abs()).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn order(errors: &[f64]) -> f64 {
    (errors[0] / errors[errors.len() - 1]).log2() / (errors.len() - 1) as f64
}

#[test]
fn an_ellipsoids_projection_is_its_chord() {
    // Voxels are inside or outside. The edge is off by up to half a voxel, either way, so the chord converges with first order.
    let solid = |p: DVec3| if (p / AXES).length_squared() < 1.0 { 1.0 } else { 0.0 };
    let length = |eye: DVec3, d: DVec3| chord(eye, d).map_or(0.0, |(length, _)| length);
    let errors = [16, 32, 64, 128].map(|n| error_at(n, solid, length));
    println!("solid ellipsoid: {errors:?}, order {}", order(&errors));
    assert!(order(&errors) > 0.9 && errors[3] < 0.01, "{errors:?}");
}

#[test]
fn a_smooth_ellipsoids_projection_converges_with_second_order() {
    // 1 − q² within q < 1 is −c (t − t₁)(t − t₂) along the chord, whose integral is c L³ / 6.
    let smooth = |p: DVec3| (1.0 - (p / AXES).length_squared()).max(0.0);
    let truth = |eye: DVec3, d: DVec3| chord(eye, d).map_or(0.0, |(length, c)| c * length.powi(3) / 6.0);
    let errors = [16, 32, 64, 128].map(|n| error_at(n, smooth, truth));
    println!("smooth ellipsoid: {errors:?}, order {}", order(&errors));
    assert!((1.8..2.3).contains(&order(&errors)) && errors[3] < 1e-4, "{errors:?}");
}

#[test]
fn an_xray_of_a_constant_box_is_beer_and_lamberts_law() {
    let house = House::shared();
    let volume = json!({"builtin": "constant", "resolution": 32});
    for at in [[0.0, 0.0, 3.0], [2.1, 1.7, 2.3], [-3.0, 0.4, 0.2], [0.1, -4.0, 1.0], [5.0, 5.0, -5.0], [0.3, 0.1, 0.2]]
    {
        for sigma in [0.05, 0.7, 3.0] {
            let eye = Eye::at(at, 40.0);
            let got =
                numbers(house, &volume, &eye, &json!({"mode": "xray", "sigma_per_value": sigma, "zero_value": 0}));
            for (pixel, d, length) in rays(&eye) {
                let truth = (-sigma * length).exp();
                assert!((got[pixel].0 - truth).abs() < 1e-4 * truth, "{at:?}, {sigma}: {} for {truth}", got[pixel].0);
                assert!(inside(eye.eye, d, DVec3::ONE).is_some());
            }
        }
    }
}

#[test]
fn past_the_volume_all_of_the_light_gets_through() {
    let house = House::shared();
    let eye = Eye { target: dvec3(0.0, 0.0, 9.0), ..Eye::at([0.0, 0.0, 3.0], 40.0) };
    let volume = json!({"builtin": "constant", "resolution": 8});
    assert!(numbers(house, &volume, &eye, &json!({"mode": "xray"})).iter().all(|p| *p == (1.0, true)));
    for mode in ["maximum", "minimum", "mean", "sum"] {
        assert!(numbers(house, &volume, &eye, &json!({"mode": mode})).iter().all(|p| *p == (0.0, false)), "{mode}");
    }
}

#[test]
fn all_modes_of_a_constant_are_the_constant() {
    let house = House::shared();
    let volume = house.floats([5, 6, 7], |_, _, _| 0.75);
    for interpolation in ["nearest", "trilinear", "b_spline", "catmull_rom"] {
        for mode in ["maximum", "minimum", "mean"] {
            for eye in eyes() {
                let got = numbers(house, &volume, &eye, &json!({"mode": mode, "interpolation": interpolation}));
                for (pixel, ..) in rays(&eye) {
                    assert!(
                        (got[pixel].0 - 0.75).abs() < 1e-5 && got[pixel].1,
                        "{mode} {interpolation}: {:?}",
                        got[pixel]
                    );
                }
            }
        }
    }
}

/// ∫ clamp(u(t), −e, e) dt, with u going evenly from a to b over the length.
fn clamped_ramp(a: f64, b: f64, e: f64, length: f64) -> f64 {
    let integral = |u: f64| match u {
        u if u < -e => -e * u - 0.5 * e * e,
        u if u > e => e * u - 0.5 * e * e,
        u => 0.5 * u * u,
    };
    if (b - a).abs() < 1e-9 { a.clamp(-e, e) * length } else { (integral(b) - integral(a)) / (b - a) * length }
}

#[test]
fn a_ramp_and_its_clamped_border_integrate_in_closed_form() {
    let house = House::shared();
    let slope = dvec3(0.7, -1.3, 0.4);
    let dims = [6, 11, 4];
    let volume = house.floats(dims, |x, y, z| 2.0 + slope.dot(dvec3(x, y, z)));
    for eye in eyes() {
        let got = numbers(house, &volume, &eye, &json!({"mode": "sum"}));
        for (pixel, d, length) in rays(&eye) {
            let (near, far) = inside(eye.eye, d, DVec3::ONE).unwrap();
            let (from, to) = (eye.eye + d * near, eye.eye + d * far);
            let ramps = (0..3).map(|a| slope[a] * clamped_ramp(from[a], to[a], 1.0 - 1.0 / dims[a] as f64, length));
            let truth = 2.0 * length + ramps.sum::<f64>();
            assert!((got[pixel].0 - truth).abs() < 1e-4, "{:?} {pixel}: {} for {truth}", eye.eye, got[pixel].0);
        }
    }
    // The reference of the other tests must give the same, and is checked by this.
    let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let at = |i: usize| dvec3(centre(i % 6, 6), centre(i / 6 % 11, 11), centre(i / 66, 4));
    let grid = Grid { dims, voxels: (0..6 * 11 * 4).map(|i| (2.0 + slope.dot(at(i))) as f32).collect() };
    let eye = DVec3::new(0.0, 0.0, 3.0);
    let d = DVec3::new(0.1, 0.2, -1.0).normalize();
    let (near, far) = inside(eye, d, DVec3::ONE).unwrap();
    let (from, to) = (eye + d * near, eye + d * far);
    let ramps = (0..3).map(|a| slope[a] * clamped_ramp(from[a], to[a], 1.0 - 1.0 / dims[a] as f64, far - near));
    let truth = 2.0 * (far - near) + ramps.sum::<f64>();
    assert!((grid.integral(eye, d, "trilinear").0 - truth).abs() < 1e-6);
}
