//! A linear field is known everywhere, so a plane must show its value at the world points that the camera sees.

use glam::{DMat3, DVec3, dvec3};
use serde_json::{Value, json};

use crate::common::engine::House;

pub const SIDE: usize = 33;
/// The width and height of the picture, world units.
pub const SPAN: f64 = 4.0;

/// An orthographic camera at `eye` that looks at the origin.
pub struct Camera {
    pub eye: DVec3,
    pub right: DVec3,
    pub up: DVec3,
}

impl Camera {
    pub fn at(eye: DVec3) -> Self {
        let forward = -eye.normalize();
        let right = forward.cross(if forward.y.abs() > 0.9 { DVec3::X } else { DVec3::Y }).normalize();
        Self { eye, right, up: right.cross(forward) }
    }

    pub fn json(&self) -> Value {
        let fov_y_deg = 2.0 * (0.5 * SPAN / self.eye.length()).atan().to_degrees();
        json!({"eye": self.eye.to_array(), "up": self.up.to_array(), "fov_y_deg": fov_y_deg, "projection": "orthographic"})
    }

    /// The point at which a pixel's ray meets a plane.
    pub fn meets(&self, pixel: usize, point: DVec3, normal: DVec3) -> DVec3 {
        let place = |i: usize| ((i as f64 + 0.5) / SIDE as f64 - 0.5) * SPAN;
        let from = self.eye + self.right * place(pixel % SIDE) - self.up * place(pixel / SIDE);
        let forward = -self.eye.normalize();
        from + forward * ((point - from).dot(normal) / forward.dot(normal))
    }
}

/// The numbers of a request's film, and true if the pixel is not transparent.
pub fn numbers(house: &House, volume: &Value, camera: &Value, parameters: &Value) -> Vec<(f64, bool)> {
    let mut request = json!({
        "technique": "slice", "volume": volume, "camera": camera, "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": 1}, "slice": parameters
    });
    request["slice"]["output"] = "value".into();
    let (film, error) = house.film(&request);
    assert_eq!(error.discretisation, Some(0.0), "nothing depends on a step");
    assert!(film.main.mean.iter().all(|v| v.is_finite()), "{request}");
    film.main.mean.chunks_exact(4).map(|p| (f64::from(p[0]), p[3] > 0.5)).collect()
}

const DIMS: [usize; 3] = [9, 14, 7];
const GRADIENT: DVec3 = dvec3(0.6, -0.35, 0.8);

/// A grid whose axes are neither at right angles nor of one length, with the field 5 + gradient · p, as an NRRD file.
fn oblique(axes: DMat3) -> Vec<u8> {
    let centre = axes * (dvec3(DIMS[0] as f64, DIMS[1] as f64, DIMS[2] as f64) * 0.5);
    let vector = |v: DVec3| format!("({},{},{})", v.x, v.y, v.z);
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: right-anterior-superior\nsizes: {} {} {}\nspace directions: {} {} {}\nencoding: raw\nendian: little\n\n",
        DIMS[0],
        DIMS[1],
        DIMS[2],
        vector(axes.x_axis),
        vector(axes.y_axis),
        vector(axes.z_axis)
    );
    let mut bytes = header.into_bytes();
    for z in 0..DIMS[2] {
        for y in 0..DIMS[1] {
            for x in 0..DIMS[0] {
                let p = axes * dvec3(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) - centre;
                bytes.extend_from_slice(&((5.0 + GRADIENT.dot(p)) as f32).to_le_bytes());
            }
        }
    }
    bytes
}

/// The depth of a world point inside the grid, in voxels from its nearest face.
fn depth(axes: DMat3, p: DVec3) -> f64 {
    let half = dvec3(DIMS[0] as f64, DIMS[1] as f64, DIMS[2] as f64) * 0.5;
    let u = axes.inverse() * p;
    (half - u.abs()).min_element()
}

#[test]
fn a_linear_field_has_its_values_at_world_points_on_any_grid() {
    let house = House::shared();
    let straight = DMat3::from_diagonal(dvec3(0.25, 0.15, 0.3));
    let skewed = DMat3::from_cols(dvec3(0.22, 0.05, -0.03), dvec3(-0.04, 0.16, 0.05), dvec3(0.06, -0.02, 0.27));
    for axes in [straight, skewed] {
        let volume = house.file(oblique(axes));
        for (eye, point, normal) in [
            (dvec3(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Z),
            (dvec3(0.0, 0.0, 5.0), dvec3(0.1, 0.0, 0.3), dvec3(0.3, -0.2, 1.0)),
            (dvec3(3.0, 2.0, -4.0), dvec3(0.1, 0.05, -0.1), dvec3(3.0, 2.0, -4.0)),
            (dvec3(-4.0, 0.5, 1.0), dvec3(0.0, 0.2, 0.0), dvec3(-1.0, 0.4, 0.3)),
        ] {
            let camera = Camera::at(eye);
            for interpolation in ["trilinear", "catmull_rom", "b_spline"] {
                let parameters = json!({"plane": {"point": point.to_array(), "normal": normal.to_array()}, "interpolation": interpolation});
                let got = numbers(house, &volume, &camera.json(), &parameters);
                let mut compared = 0;
                for (pixel, (value, shown)) in got.into_iter().enumerate() {
                    let p = camera.meets(pixel, point, normal.normalize());
                    let inside = depth(axes, p);
                    if inside.abs() > 1e-3 {
                        assert_eq!(shown, inside > 0.0, "{eye}, {normal}, pixel {pixel}: {inside} voxels inside");
                    }
                    // Near the faces, a spline lacks the voxels beyond them.
                    if inside > if interpolation == "trilinear" { 0.5 } else { 1.5 } {
                        let truth = 5.0 + GRADIENT.dot(p);
                        assert!(
                            (value - truth).abs() < 1e-4,
                            "{interpolation} {eye}, {normal}, {pixel}: {value} for {truth}"
                        );
                        compared += 1;
                    }
                }
                assert!(compared > 20, "{compared} pixels to compare");
            }
        }
    }
}

#[test]
fn nearest_is_the_voxel_that_the_point_is_in() {
    let house = House::shared();
    let value = |x: f64, y: f64, z: f64| x + 10.0 * y + 100.0 * z;
    let volume = house.floats([8, 8, 8], value);
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0));
    let got = numbers(
        house,
        &volume,
        &camera.json(),
        &json!({"plane": {"axis": "z", "position": 0.3}, "interpolation": "nearest"}),
    );
    let snap = |v: f64| ((v + 1.0) * 4.0).floor().clamp(0.0, 7.0) / 4.0 - 0.875;
    for (pixel, (got, shown)) in got.into_iter().enumerate() {
        let p = camera.meets(pixel, dvec3(0.0, 0.0, 0.3), DVec3::Z);
        assert_eq!(shown, p.x.abs() < 1.0 && p.y.abs() < 1.0);
        // On a face between two voxels, the value may be either of theirs.
        let apart = |v: f64| ((v + 1.0) * 4.0 - ((v + 1.0) * 4.0).round()).abs() > 1e-3;
        if shown && apart(p.x) && apart(p.y) {
            assert!((got - value(snap(p.x), snap(p.y), snap(p.z))).abs() < 1e-4, "{p}: {got}");
        }
    }
}

#[test]
fn every_way_to_say_a_plane_says_the_same() {
    let house = House::shared();
    let volume = house.floats([9, 14, 7], |x, y, z| x + 2.0 * y + 3.0 * z);
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0)).json();
    let of = |plane: Value| numbers(house, &volume, &camera, &json!({ "plane": plane }));
    let first = of(json!({"axis": "z", "fraction": 0.65}));
    assert_eq!(first, of(json!({"axis": "z", "position": 0.3})));
    assert_eq!(first, of(json!({"point": [5, -7, 0.3], "normal": [0, 0, 20]})));
    // The default plane goes through the centre and faces the camera.
    assert_eq!(of(json!({})), of(json!({"axis": "z"})));
    let side = Camera::at(dvec3(5.0, 0.0, 0.0)).json();
    assert_eq!(
        numbers(house, &volume, &side, &json!({})),
        numbers(house, &volume, &side, &json!({"plane": {"axis": "x", "fraction": 0.5}}))
    );
}

#[test]
fn a_plane_beside_the_volume_or_along_the_rays_is_empty() {
    let house = House::shared();
    let volume = house.floats([4, 4, 4], |_, _, _| 1.0);
    let camera = Camera::at(dvec3(0.0, 0.0, 5.0)).json();
    for plane in
        [json!({"axis": "z", "position": 1.01}), json!({"axis": "x"}), json!({"point": [0, 0, 6], "normal": [0, 0, 1]})]
    {
        for thickness in [0.0, 0.5] {
            let got = numbers(house, &volume, &camera, &json!({"plane": plane, "thickness": thickness}));
            assert!(got.iter().all(|p| *p == (0.0, false)), "{plane}");
        }
    }
}
