//! The crossings of rays, against a dense scan and bisection of the interpolant in double precision.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::emission_absorption::oracle::{Eye, inside};
use crate::projection::grid::Grid;

pub const SIDE: usize = 24;
const DIMS: [usize; 3] = [40, 37, 43];
pub const VOXEL: f64 = 2.0 / 43.0;
pub const ISOVALUE: f64 = 0.47;

/// The distance from the eye that each pixel shows; `None` if there is nothing.
pub fn depths(house: &House, volume: &Value, camera: &Value, parameters: &Value) -> Vec<Option<f64>> {
    let mut request = json!({
        "technique": "isosurface", "volume": volume, "camera": camera, "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": 1}, "isosurface": parameters
    });
    request["isosurface"]["output"] = "depth".into();
    film_depths(house, &request)
}

/// The distances that the film of a whole request shows.
pub fn film_depths(house: &House, request: &Value) -> Vec<Option<f64>> {
    let (film, _) = house.film(request);
    assert!(film.main.mean.iter().all(|v| v.is_finite()));
    film.main.mean.chunks_exact(4).map(|p| (p[3] > 0.5).then(|| f64::from(p[0]))).collect()
}

/// Waves with a period of `period` voxels. They are smooth and have many surfaces.
pub fn waves(period: f64) -> Grid {
    let k = std::f64::consts::TAU / (period * VOXEL);
    let value =
        |p: DVec3| 0.5 + 0.2 * (k * p.x).sin() * (0.9 * k * p.y + 0.4).cos() + 0.25 * (0.8 * k * p.z + p.x).sin();
    let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let [nx, ny, nz] = DIMS;
    let at = |i: usize| dvec3(centre(i % nx, nx), centre(i / nx % ny, ny), centre(i / nx / ny, nz));
    Grid { dims: DIMS, voxels: (0..nx * ny * nz).map(|i| value(at(i)) as f32).collect() }
}

pub struct Crossing {
    pub t: f64,
    /// The change of the value over a voxel there.
    pub slope: f64,
}

/// Every crossing along a ray that a scan in 64ths of a voxel sees.
pub fn crossings(f: impl Fn(f64) -> f64, near: f64, far: f64) -> Vec<Crossing> {
    let steps = ((far - near) / VOXEL * 64.0).ceil();
    let place = |i: f64| near + (far - near) * i / steps;
    let mut found = Vec::new();
    let mut before = f(near);
    for i in 1..=steps as usize {
        let (mut a, mut b) = (place(i as f64 - 1.0), place(i as f64));
        let after = f(b);
        if (before < 0.0) != (after < 0.0) {
            for _ in 0..40 {
                let middle = 0.5 * (a + b);
                if (f(middle) < 0.0) == (before < 0.0) { a = middle } else { b = middle }
            }
            found.push(Crossing { t: a, slope: (f(a + 1e-4) - f(a - 1e-4)).abs() / 2e-4 * VOXEL });
        }
        before = after;
    }
    found
}

/// True if the found crossing is the first, or a later one if all before come in pairs less than a step apart, since two samples do not show such a
/// pair. Nothing may be found only if no crossing is left.
pub fn check(found: Option<f64>, truth: &[Crossing], step: f64, case: &str) -> bool {
    // Single precision tells values 1e-7 apart, which is far along a ray that grazes the surface.
    let slack = |c: &Crossing| 1e-4 * VOXEL + 1e-6 + 2e-7 * VOXEL / c.slope;
    let is = |c: &Crossing| found.is_some_and(|t| (t - c.t).abs() <= slack(c));
    let mut rest = truth;
    while let [first, others @ ..] = rest {
        if is(first) {
            return true;
        }
        let thick = others.first().map_or(f64::INFINITY, |next| next.t - first.t);
        assert!(
            thick < step * 1.0001 + slack(first),
            "{case}: {found:?} where the crossing at {} of slope {} is {thick} thick",
            first.t,
            first.slope
        );
        if is(&others[0]) {
            return true;
        }
        rest = &others[1..];
    }
    assert!(found.is_none(), "{case}: {found:?} where there is nothing");
    false
}

fn compare(house: &House, grid: &Grid, eye: &Eye, interpolation: &str, step_voxels: f64) -> usize {
    let volume = grid.store(house);
    let parameters = json!({"isovalue": ISOVALUE, "interpolation": interpolation, "step_voxels": step_voxels});
    let found = depths(house, &volume, &eye.json(), &parameters);
    let smallest = 2.0 / 43.0;
    let mut met = 0;
    for (pixel, found) in found.into_iter().enumerate() {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let Some((near, far)) = inside(eye.eye, d, DVec3::ONE) else {
            assert!(found.is_none());
            continue;
        };
        let truth = crossings(|t| grid.value(eye.eye + d * t, interpolation) - ISOVALUE, near, far);
        let case = format!("{interpolation}, step {step_voxels}, pixel {pixel}");
        met += usize::from(check(found, &truth, step_voxels * smallest, &case));
    }
    met
}

#[test]
fn a_crossing_is_met_to_a_ten_thousandth_of_a_voxel() {
    let house = House::shared();
    for eye in [[2.1, 1.7, 2.3], [0.2, 0.1, 3.0], [-3.0, 0.4, 0.2], [0.3, 0.1, 0.2]] {
        let met = compare(house, &waves(14.0), &Eye::at(eye, 40.0), "trilinear", 1.0);
        assert!(met > 150, "{eye:?}: {met} of {} pixels meet a surface", SIDE * SIDE);
    }
    for interpolation in ["b_spline", "catmull_rom"] {
        let met = compare(house, &waves(14.0), &Eye::at([2.1, 1.7, 2.3], 40.0), interpolation, 1.0);
        assert!(met > 150, "{interpolation}: {met}");
    }
}

#[test]
fn nothing_thicker_than_a_step_is_missed() {
    let house = House::shared();
    // In waves of six voxels, many parts above the isovalue are about as thick as the longer steps.
    for step_voxels in [0.25, 0.5, 1.0, 2.0, 4.0] {
        let met = compare(house, &waves(6.0), &Eye::at([2.1, 1.7, 2.3], 40.0), "trilinear", step_voxels);
        assert!(met > 150, "step {step_voxels}: {met}");
    }
}

#[test]
fn bytes_are_met_as_closely_as_floats() {
    let house = House::shared();
    let mut grid = waves(14.0);
    grid.voxels.iter_mut().for_each(|v| *v = (*v * 255.0).round());
    let [nx, ny, nz] = DIMS;
    let header = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: {nx} {ny} {nz}\nspacings: {} {} {}\nencoding: raw\n\n",
        2.0 / nx as f64,
        2.0 / ny as f64,
        2.0 / nz as f64
    );
    let mut bytes = header.into_bytes();
    bytes.extend(grid.voxels.iter().map(|v| *v as u8));
    let volume = house.file(bytes);
    let eye = Eye::at([2.1, 1.7, 2.3], 40.0);
    let found = depths(house, &volume, &eye.json(), &json!({"isovalue": 119.3}));
    let mut met = 0;
    for (pixel, found) in found.into_iter().enumerate() {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let Some((near, far)) = inside(eye.eye, d, DVec3::ONE) else { continue };
        let f = |t: f64| (grid.value(eye.eye + d * t, "trilinear") - 119.3) / 255.0;
        met += usize::from(check(found, &crossings(f, near, far), VOXEL, &format!("bytes, pixel {pixel}")));
    }
    assert!(met > 150, "{met}");
}

#[test]
fn an_orthographic_camera_measures_from_its_eye_too() {
    let house = House::shared();
    let volume = house.floats([16, 16, 32], |x, _, z| z + 0.3 * x);
    let camera = json!({"eye": [0, 0, 4], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 20});
    let span = 8.0 * 10f64.to_radians().tan();
    for (pixel, found) in depths(house, &volume, &camera, &json!({"isovalue": 0.1})).into_iter().enumerate() {
        let x = ((pixel % SIDE) as f64 + 0.5) / SIDE as f64 * span - 0.5 * span;
        // A linear field crosses at z = 0.1 - 0.3 x, away from the faces.
        let truth = 4.0 - (0.1 - 0.3 * x);
        assert!((found.unwrap() - truth).abs() < 1e-5, "{pixel}: {found:?} for {truth}");
    }
}
