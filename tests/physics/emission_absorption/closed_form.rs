//! Closed forms: Beer–Lambert, opacity against step, Lambert's law, and a ray's colours against the host reference.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::oracle::{Eye, inside, march, trilinear};
use crate::common::engine::House;

const SIDE: usize = 48;

/// A box of one value, everywhere white with an opacity of `sigma` per unit.
fn constant_box(eye: &Eye, sigma: f64, step_voxels: f64) -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"builtin": "constant", "resolution": 32}, "camera": eye.json(),
        "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "emission_absorption": {"opacity_threshold": 1, "step_voxels": step_voxels,
            "transfer_function": {"points": [{"value": 1, "color": [1, 1, 1], "opacity_per_unit": sigma}]}}
    })
}

#[test]
fn beer_lambert_through_a_box_at_any_angle() {
    for eye in [[0.0, 0.0, 3.0], [2.1, 1.7, 2.3], [-3.0, 0.4, 0.2], [0.1, -4.0, 1.0], [5.0, 5.0, -5.0]] {
        for sigma in [0.05, 0.7, 3.0] {
            let eye = Eye::at(eye, 40.0);
            let (film, _) = House::shared().film(&constant_box(&eye, sigma, 1.0));
            let mut worst: f64 = 0.0;
            for (pixel, p) in film.main.mean.chunks_exact(4).enumerate() {
                let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
                let length = inside(eye.eye, d, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
                let truth = -(-sigma * length).exp_m1();
                // At the silhouette, the ray grazes an edge, and its length has few digits in single precision.
                if length > 0.05 {
                    worst = worst.max((f64::from(p[3]) - truth).abs() / truth);
                } else if length == 0.0 {
                    assert!(p[3].abs() < 1e-3, "something where there is nothing: {p:?}");
                }
            }
            assert!(worst < 1e-4, "relative error {worst:e} for sigma {sigma} from {:?}", eye.eye);
        }
    }
}

#[test]
fn opacity_does_not_depend_on_the_step() {
    let eye = Eye::at([2.0, 1.0, 2.5], 45.0);
    for step_voxels in [0.25, 0.5, 1.0, 2.0, 4.0] {
        let (film, _) = House::shared().film(&constant_box(&eye, 1.3, step_voxels));
        for (pixel, p) in film.main.mean.chunks_exact(4).enumerate() {
            let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
            let length = inside(eye.eye, d, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
            let truth = 1.0 - (-1.3 * length).exp();
            assert!(
                (f64::from(p[3]) - truth).abs() < 1.0 / 255.0,
                "step {step_voxels}, pixel {pixel}: {} for {truth}",
                p[3]
            );
        }
    }
}

#[test]
fn colours_and_opacities_follow_the_host_reference() {
    // The volume has no symmetry at all, so that a swapped axis or a half-voxel shift shows.
    let n = 24;
    let value =
        |x: f64, y: f64, z: f64| 0.5 + 0.2 * (2.0 * x + 0.3).sin() + 0.2 * (1.5 * y - z).cos() * (x + 0.7 * z).sin();
    let centre = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let points = [(0.2, [0.0, 0.0, 1.0], 0.0), (0.45, [0.9, 0.2, 0.1], 0.8), (0.7, [0.1, 1.0, 0.3], 3.0)];
    let optics = |v: f64| {
        let v = v.clamp(points[0].0, points[2].0);
        let i = usize::from(v > points[1].0);
        let f = (v - points[i].0) / (points[i + 1].0 - points[i].0);
        let mix = |a: f64, b: f64| a + (b - a) * f;
        (std::array::from_fn(|c| mix(points[i].1[c], points[i + 1].1[c])), mix(points[i].2, points[i + 1].2))
    };
    let json_points: Vec<Value> =
        points.iter().map(|(v, c, s)| json!({"value": v, "color": c, "opacity_per_unit": s})).collect();
    let eye = Eye::at([1.9, 1.2, 2.6], 42.0);
    let house = House::shared();
    let request = json!({
        "technique": "emission_absorption", "volume": house.floats([n, n, n], value), "camera": eye.json(),
        "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "emission_absorption": {"opacity_threshold": 1, "step_voxels": 0.05, "transfer_function": {"points": json_points}}
    });
    let (film, _) = house.film(&request);
    let voxels = |x: usize, y: usize, z: usize| value(centre(x), centre(y), centre(z));
    let field = |p: DVec3| trilinear(&voxels, n, p);
    // A single sample starts anywhere in its first step of 1/240 unit. In a pixel that much of the front's light may be missed or doubled, and on
    // average none of it.
    let (mut signed, mut compared) = ([0.0; 4], 0.0);
    for pixel in (0..SIDE * SIDE).step_by(7) {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let truth = march(&field, &optics, eye.eye, d, 1500);
        for (c, truth) in truth.iter().enumerate() {
            let got = f64::from(film.main.mean[4 * pixel + c]);
            assert!((got - truth).abs() < 6e-3, "pixel {pixel}, channel {c}: {got} for {truth}");
            signed[c] += got - truth;
        }
        compared += 1.0;
    }
    assert!(
        signed.iter().all(|s: &f64| (s / compared).abs() < 3e-4),
        "mean differences {signed:?} over {compared} pixels"
    );
}

#[test]
fn a_slope_is_as_bright_as_lambert_says() {
    // Values rise along x, so the gradient is (1, 0, 0) everywhere, and the box is opaque.
    let house = House::shared();
    let volume = house.floats([32, 32, 32], |x, _, _| x);
    for (light, cosine) in [
        ([1.0, 0.0, 0.0], 1.0),
        ([1.0, 3.0f64.sqrt(), 0.0], 0.5),
        ([0.0, 0.0, 1.0], 0.0),
        ([-1.0, 0.0, 1.0], 0.5f64.sqrt()),
    ] {
        let request = json!({
            "technique": "emission_absorption", "volume": volume, "camera": Eye::at([0.0, 0.0, 4.0], 20.0).json(),
            "image": {"width": 16, "height": 16}, "budget": {"samples": 1},
            "emission_absorption": {"shading": true, "opacity_threshold": 1,
                "light": {"direction": light, "ambient": 0.1, "diffuse": 0.8, "specular": 0},
                "transfer_function": {"points": [{"value": 0, "color": [1, 0.5, 0.25], "opacity_per_unit": 1000}]}}
        });
        let (film, _) = house.film(&request);
        let p = &film.main.mean[4 * (8 * 16 + 8)..];
        for (c, base) in [1.0, 0.5, 0.25].into_iter().enumerate() {
            let truth = base * (0.1 + 0.8 * cosine);
            assert!((f64::from(p[c]) - truth).abs() < 2e-3, "light {light:?}, channel {c}: {} for {truth}", p[c]);
        }
    }
}

#[test]
fn what_is_up_and_right_in_the_world_is_so_in_the_picture() {
    let house = House::shared();
    let volume = house.floats([16, 16, 16], |x, y, _| if x > 0.0 && y > 0.0 { 1.0 } else { 0.0 });
    let request = |eye: DVec3| {
        json!({
            "technique": "emission_absorption", "volume": volume,
            "camera": {"eye": eye.to_array(), "up": [0, 1, 0], "fov_y_deg": 40}, "image": {"width": 32, "height": 32},
            "emission_absorption": {"transfer_function": {"points": [
                {"value": 0.4, "color": [1, 1, 1], "opacity_per_unit": 0}, {"value": 0.6, "color": [1, 1, 1], "opacity_per_unit": 9}]}}
        })
    };
    let quadrants = |eye: DVec3| {
        let (film, _) = house.film(&request(eye));
        let sum = |columns: std::ops::Range<usize>, rows: std::ops::Range<usize>| -> f32 {
            rows.flat_map(|r| columns.clone().map(move |c| r * 32 + c)).map(|i| film.main.mean[4 * i]).sum()
        };
        [sum(0..16, 0..16), sum(16..32, 0..16), sum(0..16, 16..32), sum(16..32, 16..32)]
    };
    let front = quadrants(dvec3(0.0, 0.0, 4.0));
    assert!(front[1] > 20.0 * (front[0] + front[2] + front[3]), "from +z, x is right and y up: {front:?}");
    let back = quadrants(dvec3(0.0, 0.0, -4.0));
    assert!(back[0] > 20.0 * (back[1] + back[2] + back[3]), "from -z, x is left: {back:?}");
}
