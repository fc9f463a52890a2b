//! Surfaces of functions whose value and gradient are known: a sphere, and Marschner and Lobb's test signal (IEEE Visualization 1994).

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::Bench;
use crate::study::oracle::Eye;
use crate::study::{Case, Scale, Setting, Trial, Truth, view};

/// The sphere's entry in the list.
pub const SPHERE: Case = Case {
    name: "isosurface_sphere",
    title: "The lit surface of a sphere, by interpolation and resolution",
    when: "a smooth surface, sampled well",
    choose: "trilinear with central differences; more voxels before a better filter",
    trial: sphere,
};
/// The test signal's entry in the list.
pub const MARSCHNER_LOBB: Case = Case {
    name: "isosurface_marschner_lobb",
    title: "The lit surface of Marschner and Lobb's test signal, by interpolation and resolution",
    when: "a surface with detail near the grid's own",
    choose: "more voxels with trilinear first; where there are no more, `catmull_rom` with analytic normals has a third of its error for several times its time",
    trial: marschner_lobb,
};

const SIDE: usize = 128;

fn sphere(bench: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    // Values and all derivatives fall from the centre: e^(−r²).
    let eye = Eye { eye: dvec3(0.0, 0.0, 4.0), wide: 0.9 };
    let value = |p: DVec3| (-p.length_squared()).exp();
    let truth = picture(eye, value, |p| -2.0 * p * value(p), (-0.36f64).exp());
    settings(bench, scale, eye, value, (-0.36f64).exp(), truth, "closed form: a sphere of radius 0.6 under a headlight")
}

fn marschner_lobb(bench: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    use std::f64::consts::PI;
    let (alpha, frequency) = (0.25, 6.0);
    let value = move |p: DVec3| {
        let ripple = (2.0 * PI * frequency * (0.5 * PI * p.x.hypot(p.y)).cos()).cos();
        (1.0 - (0.5 * PI * p.z).sin() + alpha * (1.0 + ripple)) / (2.0 * (1.0 + alpha))
    };
    let gradient = move |p: DVec3| {
        // In double precision a central difference over 1e-5 is exact to 1e-9 here.
        let h = 1e-5;
        dvec3(
            value(p + DVec3::X * h) - value(p - DVec3::X * h),
            value(p + DVec3::Y * h) - value(p - DVec3::Y * h),
            value(p + DVec3::Z * h) - value(p - DVec3::Z * h),
        ) / (2.0 * h)
    };
    let eye = Eye { eye: dvec3(0.0, 0.0, 4.0), wide: 1.2 };
    let truth = picture(eye, value, gradient, 0.5);
    settings(
        bench,
        scale,
        eye,
        value,
        0.5,
        truth,
        "closed form: the signal's own level 0.5 and gradient under a headlight",
    )
}

/// The first crossing of `level` along each ray, lit by a headlight: |n · v|.
fn picture(eye: Eye, value: impl Fn(DVec3) -> f64, gradient: impl Fn(DVec3) -> DVec3, level: f64) -> [Vec<f64>; 2] {
    let forward = eye.forward();
    let ahead = eye.eye.length();
    eye.picture(SIDE, |origin| {
        let at = |t: f64| value(origin + forward * t) - level;
        let n = 400;
        let place = |i: i32| ahead - 1.0 + 2.0 * f64::from(i) / f64::from(n);
        let Some(i) = (1..=n).find(|i| (at(place(i - 1)) < 0.0) != (at(place(*i)) < 0.0)) else { return 0.0 };
        let (mut a, mut b) = (place(i - 1), place(i));
        for _ in 0..50 {
            let middle = 0.5 * (a + b);
            if (at(middle) < 0.0) == (at(a) < 0.0) { a = middle } else { b = middle }
        }
        gradient(origin + forward * a).normalize().dot(forward).abs()
    })
}

fn settings(
    bench: &Bench,
    scale: Scale,
    eye: Eye,
    value: impl Fn(DVec3) -> f64,
    level: f64,
    [centres, values]: [Vec<f64>; 2],
    words: &str,
) -> Result<std::result::Result<Trial, String>> {
    let mut settings = Vec::new();
    let sides = scale.pick(vec![24, 48, 96], vec![24, 48, 96, 192]);
    let volumes: Vec<Value> =
        sides.iter().map(|n| bench.floats([*n; 3], [2.0; 3], |p| value(DVec3::from(p)))).collect::<Result<_>>()?;
    for (line, interpolation, normals, order) in [
        ("trilinear", "trilinear", "central", 2.0),
        ("Catmull-Rom, analytic normals", "catmull_rom", "analytic", 2.0),
        ("B-spline, analytic normals", "b_spline", "analytic", 2.0),
    ] {
        for (n, volume) in sides.iter().zip(&volumes) {
            let own = json!({"isovalue": level, "color": [1, 1, 1], "interpolation": interpolation, "normals": normals,
                "light": {"ambient": 0, "diffuse": 1, "specular": 0}});
            let request = view("isosurface", volume, &eye.json(), SIDE, 1, &own);
            settings.push(Setting::stepped(line, "voxel side", 2.0 / *n as f64, Some(order), request));
        }
    }
    let truth = Truth { words: words.into(), values, centres: Some(centres), size: Some([SIDE; 2]), known_to: 1e-6 };
    Ok(Ok(Trial { truth, settings }))
}
