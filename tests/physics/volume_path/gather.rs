//! The same scene through photons from the light and through paths from the eye: `photon_transport`'s gather, integrated here along the rays in
//! double precision, against the pictures of `volume_path` and `single_scatter`.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::light::{film, mean, scene};

const N: usize = 24;
const SIDE: usize = 24;
const EYE: [f64; 3] = [2.5, 1.0, -2.0];
const FOV_DEG: f64 = 40.0;
const SIGMA_T: f64 = 2.0;

fn density(x: f64, y: f64, z: f64) -> f64 {
    (-2.0 * (x * x + y * y + z * z)).exp() + 0.1
}

/// The number of rays along a pixel's side.
const FINE: usize = 4;

/// The radiance that comes to the eye along a ray of a picture of `FINE` times the side: the integral of T sigma_s G. G is the mean of the phase
/// function over the light of a voxel.
fn seen(gather: &dyn Fn([usize; 3]) -> f64, sigma_s: f64, column: usize, row: usize) -> f64 {
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let unit = |a: [f64; 3]| a.map(|v| v / (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt());
    let forward = unit(minus([0.0; 3], EYE));
    let right = unit(cross(forward, [0.0, 1.0, 0.0]));
    let up = cross(right, forward);
    let half = (0.5 * FOV_DEG).to_radians().tan();
    let at = |i: usize| ((i as f64 + 0.5) / (FINE * SIDE) as f64 * 2.0 - 1.0) * half;
    let d = unit(std::array::from_fn(|a| forward[a] + at(column) * right[a] - at(row) * up[a]));
    let (steps, length) = (2000, 6.0);
    let step = length / f64::from(steps);
    let (mut sum, mut depth) = (0.0, 0.0f64);
    for k in 0..steps {
        let t = (f64::from(k) + 0.5) * step;
        let p: [f64; 3] = std::array::from_fn(|a| EYE[a] + d[a] * t);
        if p.iter().any(|v| v.abs() >= 1.0) {
            continue;
        }
        let voxel = p.map(|v| ((v + 1.0) * 0.5 * N as f64) as usize);
        let centre = voxel.map(|i| (i as f64 + 0.5) / N as f64 * 2.0 - 1.0);
        let here = density(centre[0], centre[1], centre[2]);
        sum += (-(depth + 0.5 * SIGMA_T * here * step)).exp() * sigma_s * here * gather(voxel) * step;
        depth += SIGMA_T * here * step;
    }
    sum
}

fn by_photons(volume: &Value, albedo: f64, g: f64) -> f64 {
    let parameters = json!({"photons": 8_000_000, "density": volume, "tally": "radiance_gather", "source": {"type": "planar"}, "seed": 3,
        "medium": {"mu_a_per_mm": SIGMA_T * (1.0 - albedo), "mu_s_per_mm": SIGMA_T * albedo, "index": 1, "phase": {"type": "henyey_greenstein", "g": g}},
        "eye_mm": EYE.map(|v| v + 1.0)});
    let request = json!({"technique": "emission_absorption", "volume": {"photon_transport": parameters}, "image": {"width": 8, "height": 8},
        "budget": {"samples": 1}});
    let job = House::shared().finish(&request);
    let field = job.field().unwrap();
    // The gather is per photon. An irradiance of 1 on the face of 2 × 2 mm is four of them.
    let gather = |[x, y, z]: [usize; 3]| 4.0 * field.values().unwrap().at(x, y, z);
    let side = FINE * SIDE;
    let rays = (0..side * side).map(|i| seen(&gather, SIGMA_T * albedo, i % side, i / side));
    rays.sum::<f64>() / (side * side) as f64
}

#[test]
fn photons_from_the_light_and_paths_from_the_eye_make_the_same_picture() {
    let volume = House::shared().floats([N, N, N], density);
    let camera = json!({"eye": EYE, "up": [0, 1, 0], "fov_y_deg": FOV_DEG});
    // With a faint albedo nearly all light is scattered once. The light that is scattered twice is less than 2 % of 0.02.
    for (technique, albedo, g) in [("volume_path", 0.9, 0.0), ("volume_path", 0.8, 0.6), ("single_scatter", 0.002, 0.3)]
    {
        let own = json!({"medium": {"sigma_t_per_unit": SIGMA_T, "albedo": albedo, "phase": {"type": "henyey_greenstein", "g": g}},
            "interpolation": "nearest", "lights": [{"type": "sun", "direction": [0, 0, -1], "irradiance": 1}]});
        let paths = mean(&film(House::shared(), &scene(technique, &volume, &camera, &own, SIDE as u32, 4096))).0;
        let photons = by_photons(&volume, albedo, g);
        println!("{technique}, albedo {albedo}, g {g}: {paths:.6} by paths, {photons:.6} by photons");
        assert!((paths / photons - 1.0).abs() < 0.005, "{technique}: {paths} by paths, {photons} by photons");
    }
}
