//! Ambient occlusion with a known hidden part of the sky: none over a plane, all in a small hollow, half beside a high wall.

use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 16;

/// The mean over the picture of the sky's light on a white surface, and its standard error.
fn sky(volume: &Value, camera: &Value, isovalue: f64, radius: f64) -> (f64, f64) {
    let house = House::shared();
    let samples = 16;
    let (film, error) = house.film(&json!({
        "technique": "isosurface", "volume": volume, "camera": camera, "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": samples},
        "isosurface": {"isovalue": isovalue, "color": [1, 1, 1], "light": {"ambient": 1, "diffuse": 0, "specular": 0},
            "ambient_occlusion": {"radius": radius, "rays": 16}}
    }));
    let pixels: Vec<f64> = film.main.mean.chunks_exact(4).map(|p| f64::from(p[0])).collect();
    let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
    // The film's noise is the standard error of a pixel relative to the mean. Pixels are independent.
    (mean, error.noise.unwrap() * mean / SIDE as f64)
}

/// A camera on z that sees a square of half a unit around the origin.
fn from_z() -> Value {
    json!({"eye": [0, 0, 3], "up": [0, 1, 0], "fov_y_deg": 4})
}

#[test]
fn nothing_hides_the_sky_over_a_plane() {
    let volume = House::shared().floats([24; 3], |x, y, z| -z + 0.3 * x - 0.2 * y);
    let (mean, _) = sky(&volume, &from_z(), 0.0, 0.5);
    assert_eq!(mean, 1.0);
}

#[test]
fn a_small_hollow_is_dark() {
    // The camera is inside a hollow of radius 0.3, and surfaces further away than 0.6 hide nothing.
    let volume = House::shared().floats([48; 3], |x, y, z| (x * x + y * y + z * z).sqrt());
    let inside = json!({"eye": [0.05, 0, 0.1], "target": [0, 0, -1], "up": [0, 1, 0], "fov_y_deg": 60});
    let (mean, _) = sky(&volume, &inside, 0.3, 0.65);
    assert!(mean < 1e-6, "{mean}");
}

#[test]
fn a_high_wall_hides_half_of_the_sky_less_what_is_out_of_reach() {
    // The scene has the floor z = 0 and the wall x = -0.02, which is 0.12 from the camera's target: far enough that the floor is flat there on the
    // grid.
    let volume = House::shared().floats([64; 3], |x, _, z| (-z).max(-0.02 - x));
    let camera = json!({"eye": [0.1, 0, 3], "target": [0.1, 0, 0], "up": [0, 1, 0], "fov_y_deg": 0.1});
    let (mean, error) = sky(&volume, &camera, 0.0, 0.9);
    // Directions with the cosine's density are the points of a disc, evenly spread (Malley). A ray of length 0.9 reaches the wall if its point is
    // beyond the chord at 0.12 / 0.9.
    let chord: f64 = 0.12 / 0.9;
    let truth = 1.0 - (chord.acos() - chord * (1.0 - chord * chord).sqrt()) / std::f64::consts::PI;
    // A ray's last sample is up to a step short of the radius, which is worth 0.003.
    assert!((mean - truth).abs() < 3.5 * error + 0.003, "{mean} ± {error} for {truth}");
    assert!(error > 0.0 && error < 0.01, "{error}");
}

#[test]
fn what_is_out_of_reach_or_clipped_away_hides_nothing() {
    let volume = House::shared().floats([64; 3], |x, _, z| (-z).max(-0.3 - x));
    let camera = json!({"eye": [0.03, 0, 3], "target": [0.03, 0, 0], "up": [0, 1, 0], "fov_y_deg": 0.1});
    assert_eq!(sky(&volume, &camera, 0.0, 0.25).0, 1.0);
    let dark = sky(&volume, &camera, 0.0, 0.9).0;
    assert!(dark < 0.8, "{dark}");
    let house = House::shared();
    let (film, _) = house.film(&json!({
        "technique": "isosurface", "volume": volume, "camera": camera, "image": {"width": 4, "height": 4}, "budget": {"samples": 2},
        "clip": {"planes": [{"normal": [1, 0, 0], "point": [-0.2, 0, 0]}]},
        "isosurface": {"isovalue": 0, "color": [1, 1, 1], "light": {"ambient": 1, "diffuse": 0, "specular": 0},
            "ambient_occlusion": {"radius": 0.9}}
    }));
    assert!(film.main.mean.chunks_exact(4).all(|p| p[0] == 1.0));
}
