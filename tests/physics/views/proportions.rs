//! Millimetres are millimetres along every axis, whatever the length and the number of the voxels.

use std::f64::consts::PI;
use std::sync::Arc;

use cloudchamber::film::{ErrorEstimate, Film};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::support::{Camera, grid, pixels, request};
use crate::common::engine::House;

/// The number of pixels is great enough for areas: at 48 the count of a true disc is up to 1 % off.
const SIDE: usize = 96;
const SPAN: f64 = 44.0;
const RADIUS: f64 = 15.0;
/// The volume has 48 mm along every axis.
const DIMS: [usize; 3] = [60, 60, 20];
const SPACING: [f64; 3] = [0.8, 0.8, 2.4];

/// The field: the distance from the centre in millimetres.
fn distances() -> Value {
    grid(DIMS, SPACING, DVec3::length)
}

/// Cameras along x, y and z, from a different side each.
fn cameras() -> [Camera; 3] {
    [DVec3::X, DVec3::NEG_Y, DVec3::Z].map(|axis| Camera::orthographic(axis * 100.0, SPAN))
}

/// Checks that width and height are the diameter within a pixel, that the area is a disc's within 2 %, and that its middle is the picture's.
fn assert_round(inside: &[bool], what: &str) {
    let pixel = SPAN / SIDE as f64;
    let places = || inside.iter().enumerate().filter(|(_, inside)| **inside).map(|(i, _)| (i % SIDE, i / SIDE));
    let extent = |along: fn((usize, usize)) -> usize| {
        let (low, high) = (places().map(along).min().unwrap(), places().map(along).max().unwrap());
        assert!((low + high).abs_diff(SIDE - 1) <= 1, "{what}: from {low} to {high} is not in the middle");
        (high - low + 1) as f64 * pixel
    };
    let (width, height) = (extent(|p| p.0), extent(|p| p.1));
    let area = places().count() as f64 * pixel * pixel;
    let disc = PI * RADIUS * RADIUS;
    assert!(
        (width - 2.0 * RADIUS).abs() <= pixel && (height - 2.0 * RADIUS).abs() <= pixel,
        "{what}: {width}, {height}"
    );
    assert!((area / disc - 1.0).abs() < 0.02, "{what}: an area of {area} for {disc}");
}

#[test]
fn a_sphere_of_long_voxels_stays_round_as_a_surface() {
    let volume = distances();
    for camera in cameras() {
        for interpolation in ["trilinear", "b_spline", "catmull_rom"] {
            let parameters = json!({"isovalue": RADIUS, "interpolation": interpolation});
            let film = pixels(&request("isosurface", &volume, &camera.json(), SIDE, parameters));
            let inside: Vec<bool> = film.iter().map(|p| p[3] > 0.5).collect();
            assert_round(&inside, &format!("{interpolation} from {}", camera.eye));
        }
    }
}

#[test]
fn its_depth_is_that_of_a_sphere_along_every_axis() {
    let volume = distances();
    for camera in cameras() {
        let parameters = json!({"isovalue": RADIUS, "output": "depth"});
        let film = pixels(&request("isosurface", &volume, &camera.json(), SIDE, parameters));
        let mut compared = 0;
        for (pixel, got) in film.into_iter().enumerate() {
            let off_axis = camera.through(pixel, SIDE).length();
            // Towards the rim the ray only grazes the sphere.
            if off_axis < 0.7 * RADIUS {
                let truth = 100.0 - (RADIUS * RADIUS - off_axis * off_axis).sqrt();
                let off = f64::from(got[0]) - truth;
                // The chords of a convex field lie above it, so the surface lies deeper, by less than the chords' height over cos 45°.
                assert!((-1e-3..chords(RADIUS) * 1.5).contains(&off), "from {}: {} for {truth}", camera.eye, got[0]);
                compared += 1;
            }
        }
        assert!(compared > 1000, "{compared} pixels to compare");
    }
}

/// The greatest height of trilinear interpolation above a distance of `r`: for each axis, h²/8 of its second derivative, which is 1/r.
fn chords(r: f64) -> f64 {
    SPACING.iter().map(|h| h * h / 8.0 / (r - SPACING[2])).sum()
}

/// Checks that a film has the distance of each pixel's ray from the centre.
fn assert_distances(film: &[[f32; 4]], camera: &Camera, what: &str) {
    let mut compared = 0;
    for (pixel, got) in film.iter().enumerate() {
        let truth = camera.through(pixel, SIDE).length();
        // At the cone's tip the second derivative has no bound, and beyond a voxel's middle from the faces there is no other voxel.
        if truth > 6.0 && truth < 21.0 {
            let off = f64::from(got[0]) - truth;
            assert!((-1e-3..chords(truth)).contains(&off), "{what}, pixel {pixel}: {} for {truth}", got[0]);
            compared += 1;
        }
    }
    assert!(compared > 4000, "{compared} pixels to compare");
}

#[test]
fn its_least_value_along_a_ray_and_its_slice_are_round_too() {
    let volume = distances();
    for camera in cameras() {
        let towards = (camera.eye / 100.0).to_array();
        let least = json!({"mode": "minimum", "exact": true, "output": "value"});
        let plane = json!({"plane": {"point": [0, 0, 0], "normal": towards}, "output": "value"});
        for (technique, parameters) in [("projection", least), ("slice", plane)] {
            let film = pixels(&request(technique, &volume, &camera.json(), SIDE, parameters));
            let what = format!("{technique} from {}", camera.eye);
            let inside: Vec<bool> = film.iter().map(|p| p[3] > 0.5 && f64::from(p[0]) < RADIUS).collect();
            assert_round(&inside, &what);
            assert_distances(&film, &camera, &what);
        }
    }
}

/// Soft blobs that fade out well within the cube from -1 to 1, from `n` voxels along each axis.
fn blobs(n: usize, shift: DVec3) -> Value {
    let blob = |p: DVec3, at: DVec3, width: f64| (-(p - shift - at).length_squared() / (width * width)).exp();
    grid([n; 3], [2.0 / n as f64; 3], |p| {
        blob(p, dvec3(0.15, -0.1, 0.05), 0.4) + 0.8 * blob(p, dvec3(-0.3, 0.25, -0.2), 0.3)
    })
}

/// The forms: unshaded, shaded, and a surface.
fn forms() -> [(&'static str, Value); 3] {
    let points = json!([
        {"value": 0.1, "color": [1, 0.3, 0.1], "opacity_per_unit": 0},
        {"value": 0.6, "color": [0.2, 0.9, 0.4], "opacity_per_unit": 2},
        {"value": 1.1, "color": [0.3, 0.4, 1], "opacity_per_unit": 4}
    ]);
    [
        ("emission_absorption", json!({"transfer_function": {"points": points}})),
        ("emission_absorption", json!({"transfer_function": {"points": points}, "shading": true})),
        ("isosurface", json!({"isovalue": 0.5})),
    ]
}

/// A picture of the blobs. The step is given in world units, so that it is the same whatever the voxels.
fn of_blobs(n: usize, shift: DVec3, step: f64, (technique, parameters): &(&str, Value)) -> (Arc<Film>, ErrorEstimate) {
    let camera = json!({"eye": [1.9, 1.1, 2.3], "fov_y_deg": 34});
    let mut request = request(technique, &blobs(n, shift), &camera, 32, parameters.clone());
    request[technique]["step_voxels"] = (step * n as f64 / 2.0).into();
    request["budget"]["samples"] = 64.into();
    House::shared().film(&request)
}

#[test]
fn twice_the_voxels_show_the_same() {
    // The voxel is that of the coarser grid. A surface's rim is thinner than a voxel, and the film of a step of that length would report an error.
    let voxel = 2.0 / 32.0;
    let step = 0.5 * voxel;
    for form in forms() {
        let of = |n| of_blobs(n, DVec3::ZERO, step, &form);
        let [(coarsest, _), (coarse, error), (fine, _)] = [16, 32, 64].map(of);
        let (before, off) = (coarsest.difference(&coarse).unwrap(), coarse.difference(&fine).unwrap());
        let order = (before / off).log2();
        assert!((1.7..2.3).contains(&order), "{form:?}: order {order}, {before} and {off}");
        // So the interpolation's own error is a quarter of the one with voxels of twice the side. The rest is the film's own error estimate.
        let bound = error.total.unwrap() + before / 4.0;
        assert!(error.total.unwrap() < 0.06, "{form:?}: an error of {} would bound anything", error.total.unwrap());
        assert!(off < bound, "{form:?}: {off} for {bound}");
        let (halved, _) = of_blobs(64, DVec3::ZERO, 0.5 * step, &form);
        let off = coarse.difference(&halved).unwrap();
        assert!(off < bound, "{form:?}, half the step: {off} for {bound}");
        // A shift by half a voxel, the commonest mistake of resampling, is beyond the bound.
        let (shifted, _) = of_blobs(64, DVec3::splat(0.5 * voxel), step, &form);
        let off = coarse.difference(&shifted).unwrap();
        assert!(off > 2.0 * bound, "{form:?}: {off} is not beyond {bound}");
    }
}
