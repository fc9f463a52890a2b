//! A volume that is turned together with the camera, the light and the plane looks as before.

use glam::{DMat3, DVec3, dvec3};
use serde_json::{Value, json};

use super::support::{Camera, grid, pixels, request};

const SIDE: usize = 32;
const DIMS: [usize; 3] = [20, 24, 28];
const SPACING: f64 = 0.07;
const TOLERANCE: f32 = 1e-5;
/// The tolerance if rounding may move samples into the transfer function's next entry.
const TOLERANCE_OF_TABLES: f32 = 1e-4;

/// A quarter turn. It is exact, so that voxels go to voxels.
fn quarter(axis: usize) -> DMat3 {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
    match axis {
        0 => DMat3::from_cols(x, z, -y),
        1 => DMat3::from_cols(-z, y, x),
        _ => DMat3::from_cols(y, -x, z),
    }
}

/// A field that is different along every axis and at both ends of each: waves, a ball, and a bar with edges.
fn field(p: DVec3) -> f64 {
    let waves = 0.35 + 0.12 * (3.1 * p.x + 0.4).sin() + 0.1 * (4.3 * p.y - 1.0).cos() + 0.15 * p.z;
    let ball = 0.5 * (-(p - dvec3(0.25, -0.3, 0.4)).length_squared() / 0.05).exp();
    let bar = if p.x < -0.2 && p.y > 0.1 && p.y < 0.5 && p.z > -0.6 { 0.4 } else { 0.0 };
    waves + ball + bar
}

/// The volume after a turn: the field's voxels themselves, at their new places.
fn volume(turn: DMat3) -> Value {
    let dims = (turn * DVec3::from_array(DIMS.map(|n| n as f64))).abs().to_array().map(|n| n as usize);
    grid(dims, [SPACING; 3], |p| field(turn.transpose() * p))
}

/// All parts of the request that have a direction, before a turn.
struct Look {
    camera: Camera,
    light: DVec3,
    point: DVec3,
    normal: DVec3,
}

impl Look {
    fn turned(&self, turn: DMat3) -> Self {
        let Camera { eye, target, up, .. } = self.camera;
        Self {
            camera: Camera { eye: turn * eye, target: turn * target, up: turn * up, ..self.camera },
            light: turn * self.light,
            point: turn * self.point,
            normal: turn * self.normal,
        }
    }
}

fn looks() -> [Look; 2] {
    let seen = |eye, perspective| Look {
        camera: Camera { eye, target: dvec3(0.08, -0.05, 0.11), up: dvec3(0.2, 1.0, 0.3), span: 2.3, perspective },
        light: dvec3(0.5, 0.8, -0.3),
        point: dvec3(0.03, 0.05, -0.04),
        normal: dvec3(0.4, 0.3, 1.0),
    };
    [seen(dvec3(2.1, 1.4, 1.9), true), seen(dvec3(-1.3, 0.7, 2.6), false)]
}

/// The picture after a turn of the volume alone by `of_volume`, and of all other parts by `of_look`.
fn picture(technique: &str, of_volume: DMat3, of_look: DMat3, look: &Look, form: &Form) -> Vec<[f32; 4]> {
    let look = look.turned(of_look);
    pixels(&request(technique, &volume(of_volume), &look.camera.json(), SIDE, form(&look)))
}

fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

type Form = dyn Fn(&Look) -> Value;

/// Checks that the film is the same after a turn of all, and another after a turn of the volume alone or the wrong way.
fn check(technique: &str, form: &Form) {
    let tolerance = if technique == "emission_absorption" { TOLERANCE_OF_TABLES } else { TOLERANCE };
    for look in looks() {
        let first = picture(technique, DMat3::IDENTITY, DMat3::IDENTITY, &look, form);
        assert!(
            first.iter().filter(|p| p[3] > 0.1).count() > SIDE * SIDE / 4,
            "{technique}: there is something to see"
        );
        for axis in 0..3 {
            let turn = quarter(axis);
            let off = apart(&first, &picture(technique, turn, turn, &look, form));
            assert!(off < tolerance, "{technique}, axis {axis}, {:?}: {off:e}", look.camera);
            if !look.camera.perspective {
                continue;
            }
            for (of_volume, of_look) in [(turn, DMat3::IDENTITY), (turn.transpose(), turn)] {
                let off = apart(&first, &picture(technique, of_volume, of_look, &look, form));
                assert!(off > 0.05, "{technique}, axis {axis}: a wrong turn shows no more than {off}");
            }
        }
    }
}

/// A soft transfer function from red to blue. It is so gentle that a sample which rounding moves into the table's next entry stays within the
/// tolerance.
fn transfer_function() -> Value {
    json!({"points": [
        {"value": 0.2, "color": [0.9, 0.1, 0.1], "opacity_per_unit": 0.0},
        {"value": 0.5, "color": [0.3, 0.8, 0.2], "opacity_per_unit": 1.0},
        {"value": 0.9, "color": [0.1, 0.2, 1.0], "opacity_per_unit": 3.0}
    ]})
}

#[test]
fn emission_absorption_turns() {
    for shading in [false, true] {
        check("emission_absorption", &move |look: &Look| {
            json!({
                // A ray that ends at a threshold would end a step apart because of rounding.
                "transfer_function": transfer_function(), "shading": shading, "opacity_threshold": 1,
                "light": {"direction": look.light.to_array()}
            })
        });
    }
}

#[test]
fn isosurfaces_turn() {
    for interpolation in ["trilinear", "catmull_rom"] {
        check("isosurface", &move |look: &Look| {
            json!({
                "isovalue": 0.45, "color": [0.9, 0.6, 0.3], "interpolation": interpolation,
                "light": {"direction": look.light.to_array()}
            })
        });
    }
}

#[test]
fn projections_turn() {
    check("projection", &|_: &Look| json!({"mode": "maximum", "exact": true, "output": "value"}));
    check("projection", &|_: &Look| json!({"mode": "mean", "output": "value"}));
}

#[test]
fn slices_turn() {
    for interpolation in ["nearest", "trilinear", "b_spline"] {
        check("slice", &move |look: &Look| {
            json!({
                "plane": {"point": look.point.to_array(), "normal": look.normal.to_array()},
                "interpolation": interpolation, "output": "value"
            })
        });
    }
}
