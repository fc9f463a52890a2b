//! The test signal of Marschner & Lobb (Visualization 1994) from above, with its surface ρ = ½ as a height over x and y.

use std::f64::consts::PI;

use cloudchamber::volume::builtin::{MARSCHNER_LOBB_ALPHA, MARSCHNER_LOBB_FREQUENCY};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 48;
/// The width of the picture, world units. It is about two of the 40 voxels less than the volume at each side, and in no ratio of whole numbers to
/// them, so that all places between voxels come up alike.
const SPAN: f64 = 1.763;
const EYE: f64 = 3.0;
const TOWARDS_LIGHT: DVec3 = dvec3(1.0, 2.0, 3.0);
const NAMES: [&str; 3] = ["trilinear", "b_spline", "catmull_rom"];

fn ripple(r: f64) -> f64 {
    (2.0 * PI * MARSCHNER_LOBB_FREQUENCY * (PI * r / 2.0).cos()).cos()
}

/// The height of the surface: sin(πz/2) = α ρᵣ at ρ = ½.
fn height(x: f64, y: f64) -> f64 {
    (MARSCHNER_LOBB_ALPHA * ripple(x.hypot(y))).asin() * 2.0 / PI
}

fn normal(x: f64, y: f64) -> DVec3 {
    let h = 1e-6;
    let slope = |dx: f64, dy: f64| (height(x + dx, y + dy) - height(x - dx, y - dy)) / (2.0 * h);
    dvec3(-slope(h, 0.0), -slope(0.0, h), 1.0).normalize()
}

/// The root mean square over the picture of the first channel less the truth.
fn error(resolution: usize, own: &Value, interpolation: &str, truth: impl Fn(f64, f64) -> f64) -> f64 {
    let mut parameters = json!({"isovalue": 0.5, "interpolation": interpolation, "color": [1, 1, 1]});
    parameters.as_object_mut().unwrap().extend(own.as_object().unwrap().clone());
    let fov_y_deg = 2.0 * (0.5 * SPAN / EYE).atan().to_degrees();
    let (film, _) = House::shared().film(&json!({
        "technique": "isosurface", "volume": {"builtin": "marschner_lobb", "resolution": resolution},
        "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "camera": {"eye": [0, 0, EYE], "up": [0, 1, 0], "fov_y_deg": fov_y_deg, "projection": "orthographic"},
        "isosurface": parameters
    }));
    let place = |i: usize| ((i as f64 + 0.5) / SIDE as f64 - 0.5) * SPAN;
    let squares = film.main.mean.chunks_exact(4).enumerate().map(|(pixel, p)| {
        assert_eq!(p[3], 1.0, "the surface is everywhere");
        (f64::from(p[0]) - truth(place(pixel % SIDE), -place(pixel / SIDE))).powi(2)
    });
    (squares.sum::<f64>() / (SIDE * SIDE) as f64).sqrt()
}

fn depth_error(resolution: usize, interpolation: &str) -> f64 {
    error(resolution, &json!({"output": "depth"}), interpolation, |x, y| EYE - height(x, y))
}

fn light_error(resolution: usize, normals: &str, interpolation: &str) -> f64 {
    let light = json!({"direction": TOWARDS_LIGHT.to_array(), "ambient": 0, "diffuse": 1, "specular": 0});
    let own = json!({"normals": normals, "light": light});
    error(resolution, &own, interpolation, |x, y| normal(x, y).dot(TOWARDS_LIGHT.normalize()).abs())
}

/// Each interpolation's errors from 40, 80 and 160 voxels a side.
fn errors(error: impl Fn(usize, &str) -> f64) -> [[f64; 3]; 3] {
    NAMES.map(|name| [40, 80, 160].map(|n| error(n, name)))
}

/// The order of an error in the voxel while the ripples take some voxels. At 40 voxels a side they take two.
fn order(errors: [f64; 3]) -> f64 {
    (errors[1] / errors[2]).log2()
}

#[test]
fn its_depth_ranks_the_interpolations_as_their_orders_do() {
    let all = errors(depth_error);
    println!("depth: {all:?}");
    let [trilinear, b_spline, catmull_rom] = all;
    for i in 0..3 {
        // The B-spline without a prefilter blurs the ripples, which costs more than the kinks of the linear interpolation.
        assert!(catmull_rom[i] < 0.8 * trilinear[i] && 1.25 * trilinear[i] < b_spline[i], "{all:?}");
    }
    // The linear interpolation and the cubic B-spline reproduce lines, and Catmull-Rom reproduces parabolas (Mitchell & Netravali, SIGGRAPH 1988).
    for (errors, expected) in [(trilinear, 1.7..2.3), (b_spline, 1.7..2.3), (catmull_rom, 2.7..4.3)] {
        assert!(expected.contains(&order(errors)), "order {} of {errors:?}", order(errors));
    }
}

#[test]
fn its_normals_are_of_second_order_but_for_the_linear_interpolants_own() {
    let (central, analytic) =
        (errors(|n, i| light_error(n, "central", i)), errors(|n, i| light_error(n, "analytic", i)));
    println!("central: {central:?}, analytic: {analytic:?}");
    // Differences over two voxels are of second order, whatever their interpolation; so are the gradients of the cubics (Möller et al., "Evaluation
    // and Design of Filters Using a Taylor Series Expansion", IEEE TVCG 3(2), 1997).
    for errors in central.into_iter().chain([analytic[1], analytic[2]]) {
        assert!((1.7..3.3).contains(&order(errors)), "order {} of {errors:?}", order(errors));
    }
    for i in 0..3 {
        assert!(central[2][i] < 0.95 * central[0][i] && 1.1 * central[0][i] < central[1][i], "{central:?}");
        assert!(analytic[2][i] < 0.9 * analytic[0][i], "{analytic:?}");
    }
    // The gradient of the linear interpolation jumps from voxel to voxel. Even differences of its values are better.
    assert!(analytic[0][2] > 5.0 * central[0][2] && analytic[0][2] > 5.0 * analytic[1][2], "{central:?}, {analytic:?}");
}
