//! Crossings along parallel rays, and along rays that planes cut off, against the scan of the interpolant.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::depth::{ISOVALUE, SIDE, VOXEL, check, crossings, depths, film_depths, waves};
use crate::common::engine::House;
use crate::emission_absorption::oracle::{Eye, inside};

const DISTANCE: f64 = 4.0;
/// Half the width of the picture, world units.
const HALF: f64 = 1.1;

/// A camera whose rays are all parallel to `forward`.
pub fn parallel(forward: DVec3) -> Value {
    let fov_y_deg = 2.0 * (HALF / DISTANCE).atan().to_degrees();
    json!({"eye": (-forward * DISTANCE).to_array(), "up": [0, 1, 0], "fov_y_deg": fov_y_deg, "projection": "orthographic"})
}

/// The start of a pixel's ray in the plane of that camera's eye.
pub fn origin(pixel: usize, forward: DVec3) -> DVec3 {
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let place = |i: usize| ((i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0) * HALF;
    right * place(pixel % SIDE) - up * place(pixel / SIDE) - forward * DISTANCE
}

#[test]
fn parallel_rays_meet_waves_to_a_ten_thousandth_of_a_voxel() {
    let house = House::shared();
    let grid = waves(14.0);
    let volume = grid.store(house);
    for forward in [dvec3(-0.5, -0.3, -0.8), dvec3(0.9, -0.2, 0.3)].map(DVec3::normalize) {
        for interpolation in ["trilinear", "b_spline", "catmull_rom"] {
            let own = json!({"isovalue": ISOVALUE, "interpolation": interpolation});
            let mut met = 0;
            for (pixel, found) in depths(house, &volume, &parallel(forward), &own).into_iter().enumerate() {
                let from = origin(pixel, forward);
                let Some((near, far)) = inside(from, forward, DVec3::ONE) else {
                    assert!(found.is_none());
                    continue;
                };
                let truth = crossings(|t| grid.value(from + forward * t, interpolation) - ISOVALUE, near, far);
                met += usize::from(check(found, &truth, VOXEL, &format!("{interpolation}, pixel {pixel}")));
            }
            assert!(met > 150, "{interpolation}: {met}");
        }
    }
}

/// The part of a ray that every plane leaves: n · p >= c.
fn cut((mut near, mut far): (f64, f64), eye: DVec3, d: DVec3, planes: &[(DVec3, f64)]) -> Option<(f64, f64)> {
    for (n, c) in planes {
        let t = (c - n.dot(eye)) / n.dot(d);
        if n.dot(d) > 0.0 { near = near.max(t) } else { far = far.min(t) }
    }
    (far > near).then_some((near, far))
}

#[test]
fn rays_meet_the_first_crossing_that_planes_leave() {
    let house = House::shared();
    let grid = waves(14.0);
    let volume = grid.store(house);
    let planes = [(dvec3(0.3, -0.8, -0.4), -0.2), (dvec3(-0.9, 0.1, -0.2), -0.35)].map(|(n, c)| (n.normalize(), c));
    let clip = planes.map(|(n, c)| json!({"normal": n.to_array(), "point": (n * c).to_array()}));
    let (mut met, mut later) = (0, 0);
    for eye in [[2.1, 1.7, 2.3], [-3.0, 0.4, 0.2], [0.0, -0.2, 0.1]].map(|at| Eye::at(at, 40.0)) {
        let request = json!({
            "technique": "isosurface", "volume": volume, "camera": eye.json(), "image": {"width": SIDE, "height": SIDE},
            "budget": {"samples": 1}, "clip": {"planes": clip}, "isosurface": {"isovalue": ISOVALUE, "output": "depth"}
        });
        for (pixel, found) in film_depths(house, &request).into_iter().enumerate() {
            let case = format!("{}, pixel {pixel}", eye.eye);
            let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
            let whole = inside(eye.eye, d, DVec3::ONE);
            let Some((near, far)) = whole.and_then(|whole| cut(whole, eye.eye, d, &planes)) else {
                assert!(found.is_none(), "{case} is cut off");
                continue;
            };
            let f = |t: f64| grid.value(eye.eye + d * t, "trilinear") - ISOVALUE;
            // A crossing within rounding of a plane may be on either side of it.
            if [near, far].iter().any(|end| !crossings(f, end - 1e-5, end + 1e-5).is_empty()) {
                continue;
            }
            met += usize::from(check(found, &crossings(f, near, far), VOXEL, &case));
            later += usize::from(whole.is_some_and(|(first, _)| !crossings(f, first, near).is_empty()));
        }
    }
    assert!(met > 400 && later > 100, "{met} rays meet something, of {later} a plane has taken what was before it");
}
