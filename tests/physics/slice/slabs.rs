//! Slabs: means, greatest and least values in closed form; holes; degenerate grids; lanes.

use glam::{DVec3, dvec3};
use serde_json::json;

use super::planes::{Camera, numbers};
use crate::common::engine::House;

#[test]
fn a_slab_of_a_linear_field_in_closed_form() {
    let house = House::shared();
    let gradient = dvec3(0.6, -0.35, 0.8);
    let volume = house.floats([20, 30, 16], |x, y, z| 5.0 + gradient.dot(dvec3(x, y, z)));
    for (eye, normal) in [(dvec3(0.0, 0.0, 5.0), DVec3::Z), (dvec3(3.0, 2.0, -4.0), dvec3(1.0, -0.5, -2.0).normalize())]
    {
        let camera = Camera::at(eye);
        for thickness in [0.05, 0.4] {
            let rise = gradient.dot(normal).abs() * thickness / 2.0;
            for (mode, more) in [("mean", 0.0), ("maximum", rise), ("minimum", -rise)] {
                let parameters = json!({"plane": {"normal": normal.to_array()}, "thickness": thickness, "mode": mode});
                let mut compared = 0;
                for (pixel, (value, shown)) in
                    numbers(house, &volume, &camera.json(), &parameters).into_iter().enumerate()
                {
                    let p = camera.meets(pixel, DVec3::ZERO, normal);
                    // Only points are tested whose whole slab is away from the box's faces, where the field is clamped.
                    if (p.abs() + normal.abs() * thickness / 2.0).max_element() < 0.93 {
                        let truth = 5.0 + gradient.dot(p) + more;
                        assert!(
                            shown && (value - truth).abs() < 1e-4,
                            "{mode} of {thickness} from {eye}: {value} for {truth}"
                        );
                        compared += 1;
                    }
                }
                assert!(compared > 50);
            }
        }
    }
}

#[test]
fn what_is_outside_of_the_volume_does_not_count() {
    let house = House::shared();
    let volume = house.floats([8, 8, 8], |_, _, z| 2.0 + z);
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0));
    // The slab goes from z = 0.5 to the face at 1. The field is 2 + z up to the last centre at 0.875.
    let parameters = |mode: &str| json!({"plane": {"axis": "z", "position": 0.9}, "thickness": 0.8, "mode": mode});
    let mean = 2.0 + ((0.875f64.powi(2) - 0.5f64.powi(2)) / 2.0 + 0.125 * 0.875) / 0.5;
    for (mode, truth) in [("mean", mean), ("maximum", 2.875), ("minimum", 2.5)] {
        let got = numbers(house, &volume, &camera.json(), &parameters(mode));
        let centre = got[got.len() / 2];
        assert!(centre.1 && (centre.0 - truth).abs() < 1e-5, "{mode}: {centre:?} for {truth}");
    }
}

#[test]
fn a_ball_in_a_slab_is_as_wide_as_the_slab_cuts_it() {
    // The greatest value of 1 − |p| over a slab is 1 − the distance to its nearer face, or to the axis.
    let house = House::shared();
    let volume = house.floats([64; 3], |x, y, z| 1.0 - dvec3(x, y, z).length());
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0));
    let parameters = json!({"plane": {"axis": "z", "position": 0.5}, "thickness": 0.6, "mode": "maximum"});
    for (pixel, (value, shown)) in numbers(house, &volume, &camera.json(), &parameters).into_iter().enumerate() {
        let p = camera.meets(pixel, dvec3(0.0, 0.0, 0.5), DVec3::Z);
        if p.x.abs().max(p.y.abs()) < 0.95 {
            let truth = 1.0 - dvec3(p.x, p.y, 0.2).length();
            assert!(shown && (value - truth).abs() < 2e-3, "{p}: {value} for {truth}");
        }
    }
}

#[test]
fn holes_are_transparent_and_never_a_number() {
    let house = House::shared();
    let volume = house.floats([16, 16, 16], |x, y, z| if x * x + y * y + z * z < 0.3 { f64::NAN } else { 1.0 });
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0));
    for (thickness, mode) in [(0.0, "mean"), (0.3, "mean"), (0.3, "maximum"), (0.3, "minimum")] {
        let got = numbers(
            house,
            &volume,
            &camera.json(),
            &json!({"plane": {"axis": "z"}, "thickness": thickness, "mode": mode}),
        );
        assert_eq!(got[got.len() / 2], (0.0, false), "{thickness} {mode}");
        let shown = got.iter().filter(|p| p.1).count();
        assert!(shown > 50 && got.iter().all(|p| !p.1 || (p.0 - 1.0).abs() < 1e-5), "{thickness} {mode}");
    }
    // A slab that is thicker than the hole sees past it.
    let got = numbers(house, &volume, &camera.json(), &json!({"plane": {"axis": "z"}, "thickness": 1.8}));
    assert!(got[got.len() / 2].1);
}

#[test]
fn degenerate_grids_have_a_plane_too() {
    let house = House::shared();
    let camera = Camera::at(dvec3(1.0, 2.0, 4.0));
    for dims in [[1, 1, 1], [1, 5, 3], [4, 1, 3], [2, 2, 2], [1, 1, 9]] {
        let volume = house.floats(dims, |x, y, z| 3.0 + x + y + z);
        for interpolation in ["nearest", "trilinear", "b_spline", "catmull_rom"] {
            for thickness in [0.0, 0.4] {
                let got = numbers(
                    house,
                    &volume,
                    &camera.json(),
                    &json!({"interpolation": interpolation, "thickness": thickness}),
                );
                let centre = got[got.len() / 2];
                // The field is odd about the centre, and so is the interpolant between voxels.
                let tolerance = if interpolation == "nearest" { 1.0 } else { 1e-4 };
                assert!(
                    centre.1 && (centre.0 - 3.0).abs() <= tolerance,
                    "{dims:?} {interpolation} {thickness}: {centre:?}"
                );
            }
        }
    }
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let wide = House::shared();
    for lanes in [1, 4, 8] {
        let narrow = House::of_lanes(lanes);
        for parameters in [json!({}), json!({"thickness": 9, "mode": "maximum"}), json!({"thickness": 9})] {
            let film = |house: &House| {
                let volume = house.file(crate::common::mri_head());
                house
                    .film(&json!({"technique": "slice", "volume": volume, "image": {"width": 90, "height": 61},
                    "budget": {"samples": 2}, "slice": parameters}))
                    .0
            };
            let (a, b) = (film(narrow), film(wide));
            let worst = a.main.mean.iter().zip(&b.main.mean).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-4, "{lanes} lanes, {parameters}: {worst:e}");
        }
    }
}
