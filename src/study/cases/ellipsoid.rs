//! Projections of an ellipsoid phantom against its chords.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::Bench;
use crate::study::oracle::{Eye, inside};
use crate::study::{Case, Scale, Setting, Trial, Truth, view};

/// The mean's entry in the list.
pub const MEAN: Case = Case {
    name: "ellipsoid_mean",
    title: "The mean along rays through an ellipsoid",
    when: "edges, and want a mean along rays",
    choose: "`nearest` or trilinear alike: the edge is what is wrong, and only smaller voxels help",
    trial: |b, s| trial(b, s, "mean"),
};
/// The X-ray's entry in the list.
pub const XRAY: Case = Case {
    name: "ellipsoid_xray",
    title: "An X-ray of an ellipsoid",
    when: "a body, and want its X-ray",
    choose: "`nearest`: half the time of trilinear for the same error",
    trial: |b, s| trial(b, s, "xray"),
};

const AXES: DVec3 = dvec3(0.7, 0.5, 0.85);
const SIGMA: f64 = 1.5;
const SIDE: usize = 96;
/// The number of points along a side of a voxel. The voxel's value is the mean of its points.
const SUB_VOXELS: usize = 4;

/// The length of a ray inside of the ellipsoid.
fn chord(origin: DVec3, direction: DVec3) -> f64 {
    let (o, d) = (origin / AXES, direction / AXES);
    let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
    2.0 * (b * b - a * c).max(0.0).sqrt() / a
}

fn trial(bench: &Bench, scale: Scale, mode: &str) -> Result<std::result::Result<Trial, String>> {
    let eye = Eye { eye: dvec3(2.0, 1.2, 3.0), wide: 2.2 };
    let forward = eye.forward();
    let xray = mode == "xray";
    let [centres, values] = eye.picture(SIDE, |origin| {
        let own = chord(origin, forward);
        let whole = inside(origin, forward, DVec3::ONE).map_or(0.0, |(near, far)| far - near);
        match (xray, whole > 0.0) {
            (true, _) => (-SIGMA * own).exp(),
            (false, true) => own / whole,
            (false, false) => 0.0,
        }
    });
    let mut settings = Vec::new();
    for interpolation in ["trilinear", "nearest"] {
        for n in scale.pick(vec![16, 32, 64], vec![16, 32, 64, 128, 256]) {
            let volume = phantom(bench, n)?;
            let mut own = json!({"mode": mode, "interpolation": interpolation, "output": "value"});
            if xray {
                own["sigma_per_value"] = json!(SIGMA);
                own["zero_value"] = json!(0);
            }
            let request = view("projection", &volume, &eye.json(), SIDE, 1, &own);
            settings.push(Setting::stepped(interpolation, "voxel side", 2.0 / n as f64, None, request));
        }
    }
    let words =
        if xray { "closed form: exp(−σ · chord)" } else { "closed form: chord over the way through the box" };
    let truth = Truth { words: words.into(), values, centres: Some(centres), size: Some([SIDE; 2]), known_to: 1e-5 };
    Ok(Ok(Trial { truth, settings }))
}

/// The ellipsoid in `n`³ voxels, each with the part of it that is inside.
fn phantom(bench: &Bench, n: usize) -> Result<Value> {
    let voxel = 2.0 / n as f64;
    let sub = |i: usize| ((i as f64 + 0.5) / SUB_VOXELS as f64 - 0.5) * voxel;
    let within = |p: DVec3| (p / AXES).length_squared() <= 1.0;
    bench.floats([n; 3], [2.0; 3], |p| {
        let p = DVec3::from(p);
        let from_surface = ((p / AXES).length() - 1.0).abs();
        if from_surface > 2.0 * voxel / AXES.min_element() {
            return f64::from(u8::from(within(p)));
        }
        let points = (0..SUB_VOXELS.pow(3)).map(|i| {
            p + dvec3(sub(i % SUB_VOXELS), sub(i / SUB_VOXELS % SUB_VOXELS), sub(i / SUB_VOXELS / SUB_VOXELS))
        });
        points.filter(|q| within(*q)).count() as f64 / SUB_VOXELS.pow(3) as f64
    })
}
