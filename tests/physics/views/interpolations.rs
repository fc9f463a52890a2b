//! Each interpolation against a closed form: the order of their errors, and the rate at which these fall with the voxels.

use cloudchamber::volume::builtin::marschner_lobb_value;
use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::support::{Camera, grid, pixels, request};

const SIDE: usize = 48;
const NAMES: [&str; 4] = ["nearest", "trilinear", "b_spline", "catmull_rom"];

/// Planes through the volume, and cameras across from them. None is along the grid, so that all places between voxels come up alike.
fn views(span: f64) -> [(Camera, DVec3); 3] {
    [(dvec3(0.31, 0.17, 1.0), 0.07), (dvec3(1.0, -0.42, 0.23), -0.11), (dvec3(-0.37, 1.0, 0.71), 0.19)].map(
        |(normal, along)| {
            let normal = normal.normalize();
            let target = normal * along;
            let camera =
                Camera { eye: target + normal * 3.0, target, up: dvec3(0.1, 0.3, 0.2), span, perspective: false };
            (camera, normal)
        },
    )
}

/// The values of slices and their places, at least `margin` inside the cube from −1 to 1.
fn values(volume: &Value, interpolation: &str, span: f64, margin: f64) -> Vec<(DVec3, f64)> {
    let mut values = Vec::new();
    for (camera, normal) in views(span) {
        let plane = json!({"point": camera.target.to_array(), "normal": normal.to_array()});
        let parameters = json!({"plane": plane, "interpolation": interpolation, "output": "value"});
        let film = pixels(&request("slice", volume, &camera.json(), SIDE, parameters));
        let inside = film.into_iter().enumerate().map(|(pixel, p)| (camera.through(pixel, SIDE), f64::from(p[0])));
        values.extend(inside.filter(|(p, _)| p.abs().max_element() < 1.0 - margin));
    }
    assert!(values.len() > 3000, "{} places", values.len());
    values
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v * v, count + 1));
    (sum / f64::from(count)).sqrt()
}

#[test]
fn marschner_lobb_ranks_them_as_the_literature_does() {
    let volume = json!({"builtin": "marschner_lobb", "resolution": 40});
    let errors = NAMES.map(|name| {
        let values = values(&volume, name, 2.0, 2.0 * 2.0 / 40.0);
        rms(values.into_iter().map(|(p, v)| v - marschner_lobb_value(p.x, p.y, p.z)))
    });
    let [nearest, trilinear, b_spline, catmull_rom] = errors;
    assert!(catmull_rom < 0.8 * trilinear, "{errors:?}");
    // The B-spline without a prefilter blurs. At this frequency it loses more than the kinks of the linear interpolation do.
    assert!(1.25 * trilinear < b_spline && b_spline < 0.97 * nearest, "{errors:?}");
    // The ripple itself has a root mean square of 0.07, so even the worst is nearer than a volume without it.
    assert!(nearest < 0.06, "{errors:?}");
}

const WAVE: [DVec3; 2] = [dvec3(2.3, -1.1, 1.7), dvec3(-1.3, 2.9, 0.8)];

/// Two waves, across each other and along no axis.
fn smooth(p: DVec3) -> f64 {
    (WAVE[0].dot(p) + 0.3).sin() + 0.7 * (WAVE[1].dot(p) - 0.8).cos()
}

/// The sum of its second derivatives along the axes.
fn laplacian(p: DVec3) -> f64 {
    -WAVE[0].length_squared() * (WAVE[0].dot(p) + 0.3).sin()
        - 0.7 * WAVE[1].length_squared() * (WAVE[1].dot(p) - 0.8).cos()
}

/// The values of the smooth field from n voxels along each axis, at the same places for every n.
fn sampled(n: usize, interpolation: &str) -> Vec<(DVec3, f64)> {
    let volume = grid([n; 3], [2.0 / n as f64; 3], smooth);
    values(&volume, interpolation, 1.37, 2.0 * 2.0 / 16.0)
}

#[test]
fn errors_fall_with_the_voxels_at_each_ones_order() {
    for (name, least, most) in
        [("nearest", 0.7, 1.3), ("trilinear", 1.7, 2.3), ("b_spline", 1.7, 2.3), ("catmull_rom", 2.7, 4.3)]
    {
        let error = |n| rms(sampled(n, name).into_iter().map(|(p, v)| v - smooth(p)));
        let errors = [16, 32, 64].map(error);
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((least..most).contains(&order), "{name}: {order} from {errors:?}");
        }
    }
}

/// Without a prefilter, its error is known to the leading term: h²/6 times the second derivatives.
#[test]
fn the_b_spline_blurs_by_a_sixth_of_the_laplacian() {
    let h = 2.0 / 64.0;
    let values = sampled(64, "b_spline");
    let blur = rms(values.iter().map(|(p, _)| h * h / 6.0 * laplacian(*p)));
    let beyond = rms(values.iter().map(|(p, v)| v - smooth(*p) - h * h / 6.0 * laplacian(*p)));
    assert!(beyond < 0.005 * blur, "{beyond} of {blur}");
}
