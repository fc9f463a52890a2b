//! Light on a sphere in closed form.

use glam::DVec3;
use serde_json::{Value, json};

use super::depth::SIDE;
use crate::common::engine::House;
use crate::emission_absorption::oracle::Eye;

const RADIUS: f64 = 0.6;

/// The first channel of each pixel of a sphere in exp(−r²), and true if the pixel shows anything.
fn lit(eye: &Eye, light: &Value, parameters: &Value) -> Vec<(f64, bool)> {
    let house = House::shared();
    let volume = house.floats([48; 3], |x, y, z| (-(x * x + y * y + z * z)).exp());
    let mut own = json!({"isovalue": (-RADIUS * RADIUS).exp(), "color": [1, 0.5, 0.25], "light": light});
    own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
    let (film, _) = house.film(&json!({
        "technique": "isosurface", "volume": volume, "camera": eye.json(), "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": 1}, "isosurface": own
    }));
    film.main.mean.chunks_exact(4).map(|p| (f64::from(p[0]), p[3] > 0.5)).collect()
}

/// The point where the ray of a pixel first meets the sphere, and the ray.
fn meets(eye: &Eye, pixel: usize) -> Option<(DVec3, DVec3)> {
    let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
    let (b, c) = (eye.eye.dot(d), eye.eye.length_squared() - RADIUS * RADIUS);
    let root = (b * b - c).sqrt();
    let t = if c < 0.0 { -b + root } else { -b - root };
    (root.is_finite() && t > 0.0).then(|| (eye.eye + d * t, d))
}

#[test]
fn lamberts_law_holds_on_a_sphere_from_outside_and_from_within() {
    let light = json!({"direction": [1, 2, 3], "ambient": 0, "diffuse": 1, "specular": 0});
    let towards = DVec3::new(1.0, 2.0, 3.0).normalize();
    for eye in [Eye::at([1.3, 0.9, 2.4], 30.0), Eye::at([0.1, -0.2, 0.15], 70.0)] {
        for (normals, interpolation, most) in
            [("central", "trilinear", 5e-3), ("analytic", "b_spline", 5e-3), ("analytic", "trilinear", 0.05)]
        {
            let found = lit(&eye, &light, &json!({"normals": normals, "interpolation": interpolation}));
            let mut compared = 0;
            for (pixel, (value, shown)) in found.into_iter().enumerate() {
                let Some((point, d)) = meets(&eye, pixel) else { continue };
                let normal = point / RADIUS;
                if normal.dot(d).abs() > 0.3 {
                    let truth = normal.dot(towards).abs();
                    assert!(
                        shown && (value - truth).abs() < most,
                        "{normals} {interpolation} {pixel}: {value} for {truth}"
                    );
                    compared += 1;
                }
            }
            assert!(compared > 100, "{compared} pixels");
        }
    }
}

#[test]
fn the_highlight_is_blinn_and_phongs() {
    let eye = Eye::at([0.0, 0.3, 2.6], 30.0);
    let light = json!({"direction": [0.5, 0.4, 1], "ambient": 0.1, "diffuse": 0.5, "specular": 0.4, "shininess": 12});
    let towards = DVec3::new(0.5, 0.4, 1.0).normalize();
    let mut brightest: f64 = 0.0;
    for (pixel, (value, _)) in lit(&eye, &light, &json!({})).into_iter().enumerate() {
        let Some((point, d)) = meets(&eye, pixel) else { continue };
        let normal = point / RADIUS;
        if normal.dot(d).abs() > 0.3 {
            let half = (towards - d).normalize();
            let glint = 0.4 * normal.dot(half).abs().powi(12);
            let truth = 0.1 + 0.5 * normal.dot(towards).abs() + glint;
            brightest = brightest.max(glint);
            assert!((value - truth).abs() < 0.02, "{pixel}: {value} for {truth}");
        }
    }
    assert!(brightest > 0.35, "the highlight is in the picture: {brightest}");
}

#[test]
fn a_headlight_shines_from_the_camera() {
    let eye = Eye::at([1.3, 0.9, 2.4], 20.0);
    let found = lit(&eye, &json!({"ambient": 0, "diffuse": 1, "specular": 0}), &json!({}));
    let forward = -eye.eye.normalize();
    for (pixel, (value, _)) in found.into_iter().enumerate() {
        let Some((point, d)) = meets(&eye, pixel) else { continue };
        if (point / RADIUS).dot(d).abs() > 0.3 {
            let truth = (point / RADIUS).dot(forward).abs();
            assert!((value - truth).abs() < 5e-3, "{pixel}: {value} for {truth}");
        }
    }
}
