//! Several surfaces, some of them transparent, and the order in which they are composited.

use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 17;

/// Nested spheres of r = 0.8, 0.6, 0.4 in the field 1 − r, lit evenly; the middle pixel's red, green, blue and alpha.
fn middle(surfaces: &Value, parameters: &Value) -> [f32; 4] {
    let house = House::shared();
    let volume = house.floats([40; 3], |x, y, z| 1.0 - (x * x + y * y + z * z).sqrt());
    let mut own = json!({"surfaces": surfaces, "light": {"ambient": 1, "diffuse": 0, "specular": 0}});
    own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
    let (film, _) = house.film(&json!({
        "technique": "isosurface", "volume": volume, "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "camera": {"eye": [0, 0, 3], "up": [0, 1, 0], "fov_y_deg": 30}, "isosurface": own
    }));
    let at = 4 * (SIDE / 2 * SIDE + SIDE / 2);
    film.main.mean[at..at + 4].try_into().unwrap()
}

fn near(found: [f32; 4], truth: [f64; 4]) {
    for (a, b) in found.iter().zip(truth) {
        assert!((f64::from(*a) - b).abs() < 1e-5, "{found:?} for {truth:?}");
    }
}

fn surface(isovalue: f64, color: [f64; 3], opacity: f64) -> Value {
    json!({"isovalue": isovalue, "color": color, "opacity": opacity})
}

#[test]
fn what_is_in_front_hides_its_part_of_what_is_behind() {
    let [a, b, c] =
        [surface(0.2, [1.0, 0.0, 0.0], 0.3), surface(0.4, [0.0, 1.0, 0.0], 0.5), surface(0.6, [0.0, 0.0, 1.0], 1.0)];
    let truth = [0.3, 0.7 * 0.5, 0.7 * 0.5, 1.0];
    for order in [json!([a, b, c]), json!([c, a, b]), json!([b, c, a])] {
        near(middle(&order, &json!({})), truth);
    }
}

#[test]
fn a_ray_meets_the_far_side_of_a_transparent_surface() {
    // The order is red, green, green, red: the ray meets each surface twice.
    let pair = json!([surface(0.2, [1.0, 0.0, 0.0], 0.3), surface(0.4, [0.0, 1.0, 0.0], 0.5)]);
    let through = 0.7 * 0.5 * 0.5;
    near(middle(&pair, &json!({})), [0.3 + through * 0.3, 0.7 * 0.5 + 0.7 * 0.5 * 0.5, 0.0, 1.0 - through * 0.7]);
    let single = json!([surface(0.4, [1.0, 0.5, 0.0], 0.25)]);
    near(middle(&single, &json!({})), [0.25 + 0.75 * 0.25, 0.5 * (0.25 + 0.75 * 0.25), 0.0, 1.0 - 0.75 * 0.75]);
}

#[test]
fn surfaces_within_one_step_keep_their_order() {
    // With steps of a third of the box, the ray passes several values between two samples, rising and falling.
    let all = json!([
        surface(0.30, [1.0, 0.0, 0.0], 0.5),
        surface(0.31, [0.0, 1.0, 0.0], 0.5),
        surface(0.32, [0.0, 0.0, 1.0], 0.5)
    ]);
    let half = |n: i32| 0.5f64.powi(n);
    let truth = [half(1) + half(6), half(2) + half(5), half(3) + half(4), 1.0 - half(6)];
    for step_voxels in [0.5, 2.0, 8.0] {
        near(middle(&all, &json!({"step_voxels": step_voxels})), truth);
    }
}

#[test]
fn depth_is_that_of_the_first_however_transparent() {
    let surfaces = json!([surface(0.4, [1.0; 3], 0.1), surface(0.2, [1.0; 3], 0.1)]);
    let [depth, .., alpha] = middle(&surfaces, &json!({"output": "depth"}));
    // 1 − r is linear between voxels except for its bend across the ray, which is of second order in the voxel.
    assert!((depth - (3.0 - 0.8)).abs() < 2e-3 && alpha == 1.0, "{depth}, {alpha}");
}
