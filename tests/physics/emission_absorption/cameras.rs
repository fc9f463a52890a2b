//! Cameras in odd places: inside, behind, along an axis, very far away, orthographic.

use glam::DVec3;
use serde_json::{Value, json};

use super::oracle::{Eye, inside};
use crate::common::engine::House;

const SIDE: usize = 32;

fn render(camera: Value) -> Vec<f32> {
    let request = json!({
        "technique": "emission_absorption", "volume": {"builtin": "constant", "resolution": 16}, "camera": camera,
        "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "emission_absorption": {"opacity_threshold": 1,
            "transfer_function": {"points": [{"value": 1, "color": [1, 1, 1], "opacity_per_unit": 0.8}]}}
    });
    let (film, error) = House::shared().film(&request);
    assert!(film.main.mean.iter().all(|v| v.is_finite()), "{camera}");
    assert!(error.total.unwrap().is_finite(), "{camera}");
    film.main.mean.chunks_exact(4).map(|p| p[3]).collect()
}

fn check(eye: &Eye, tolerance: f64) {
    for (pixel, alpha) in render(eye.json()).into_iter().enumerate() {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let length = inside(eye.eye, d, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
        let truth = 1.0 - (-0.8 * length).exp();
        assert!((f64::from(alpha) - truth).abs() < tolerance, "eye {:?}, pixel {pixel}: {alpha} for {truth}", eye.eye);
    }
}

#[test]
fn inside_the_volume() {
    for eye in [[0.1, 0.2, 0.3], [-0.9, 0.0, 0.05], [0.0, 0.999, 0.0]] {
        check(&Eye::at(eye, 60.0), 1e-4);
    }
}

#[test]
fn exactly_along_each_axis() {
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut eye = [0.0; 3];
            eye[axis] = 3.0 * sign;
            // An even number of pixels has rays at each side of the axis, an odd number one exactly along it.
            check(&Eye::at(eye, 40.0), 1e-4);
            let camera = Eye::at(eye, 40.0).json();
            let request = json!({
                "technique": "emission_absorption", "volume": {"builtin": "constant", "resolution": 16}, "camera": camera,
                "image": {"width": 33, "height": 33}, "budget": {"samples": 1},
                "emission_absorption": {"opacity_threshold": 1,
                    "transfer_function": {"points": [{"value": 1, "color": [1, 1, 1], "opacity_per_unit": 0.8}]}}
            });
            let (film, _) = House::shared().film(&request);
            let centre = f64::from(film.main.mean[4 * (16 * 33 + 16) + 3]);
            assert!((centre - (1.0 - (-1.6f64).exp())).abs() < 1e-5, "axis {axis} {sign}: {centre}");
        }
    }
}

#[test]
fn a_million_units_away() {
    // The box fills the picture, seen through a very long lens. All digits of a ray's place come from the plane near the box.
    for eye in [[0.0, 0.0, 1e6], [6e5, 5e5, -7e5]] {
        let fov_y_deg = 2.0 * (1.8 / DVec3::from(eye).length()).atan().to_degrees();
        if fov_y_deg >= 0.1 {
            check(&Eye::at(eye, fov_y_deg), 2e-3);
        }
    }
    check(&Eye::at([0.0, 0.0, 2000.0], 0.1), 2e-3);
    // With a plain lens the box is too small to see: a nearly empty picture is right, and it must have no garbage.
    let alpha = render(json!({"eye": [1e6, 0, 0], "fov_y_deg": 50}));
    assert!(alpha.iter().sum::<f32>() <= 1.0, "{}", alpha.iter().sum::<f32>());
}

#[test]
fn looking_away_is_empty() {
    let alpha = render(json!({"eye": [0, 0, 3], "target": [0, 0, 9], "up": [0, 1, 0], "fov_y_deg": 50}));
    assert!(alpha.iter().all(|a| *a == 0.0));
}

#[test]
fn orthographic_rays_are_parallel() {
    // The target is 3 away and the half angle's tangent is a half, so the picture is 3 units high, and the box is 2/3 of it.
    let camera = json!({"eye": [0, 0, 3], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 53.130102, "projection": "orthographic"});
    let truth = 1.0 - (-1.6f64).exp();
    for (pixel, alpha) in render(camera).into_iter().enumerate() {
        let place = |i: usize| ((i as f64 + 0.5) / SIDE as f64 - 0.5) * 3.0;
        let (x, y) = (place(pixel % SIDE), place(pixel / SIDE));
        let expected = if x.abs() < 1.0 && y.abs() < 1.0 { truth } else { 0.0 };
        assert!((f64::from(alpha) - expected).abs() < 1e-5, "at {x} {y}: {alpha}");
    }
}

#[test]
fn a_matrix_is_the_same_camera() {
    // A quarter turn about y: the camera's -z looks along world -x from (3, 0, 0).
    let matrix = [0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 1.0];
    let by_matrix = render(json!({"camera_to_world": matrix, "fov_y_deg": 40}));
    let by_eye = render(json!({"eye": [3, 0, 0], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 40}));
    assert!(by_matrix.iter().zip(&by_eye).all(|(a, b)| (a - b).abs() < 1e-6));
    assert!(by_eye.iter().sum::<f32>() > 100.0);
}
