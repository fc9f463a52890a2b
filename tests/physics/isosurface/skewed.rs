//! A linear field on grids that are neither straight nor square. Its surface is a plane in the world, lit in closed form.

use glam::{DMat3, DVec3, dvec3};
use serde_json::{Value, json};

use super::depth::{SIDE, depths};
use crate::common::engine::House;
use crate::common::writers::nrrd;
use crate::emission_absorption::oracle::Eye;

const DIMS: [usize; 3] = [15, 22, 13];
const GRADIENT: DVec3 = dvec3(0.6, -0.35, 0.8);
const LEVEL: f64 = 5.1;

/// The grids: straight with long voxels, skewed, and mirrored with an index axis that runs the other way.
fn grids() -> [DMat3; 3] {
    let skewed = DMat3::from_cols(dvec3(0.16, 0.04, -0.02), dvec3(-0.03, 0.11, 0.03), dvec3(0.04, -0.02, 0.17));
    [DMat3::from_diagonal(dvec3(0.15, 0.07, 0.21)), skewed, skewed * DMat3::from_diagonal(dvec3(1.0, -1.0, 1.0))]
}

fn size() -> DVec3 {
    DVec3::from_array(DIMS.map(|n| n as f64))
}

/// The field 5 + gradient · p as an NRRD file.
fn linear(axes: DMat3) -> Vec<u8> {
    let vector = |v: DVec3| format!("({},{},{})", v.x, v.y, v.z);
    let directions = [axes.x_axis, axes.y_axis, axes.z_axis].map(vector).join(" ");
    let [nx, ny, nz] = DIMS;
    let fields = format!(
        "type: float\ndimension: 3\nspace: right-anterior-superior\nsizes: {nx} {ny} {nz}\nspace directions: {directions}\nencoding: raw\nendian: little"
    );
    let value = |i: usize| {
        let index = dvec3((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64) + 0.5;
        (5.0 + GRADIENT.dot(axes * (index - 0.5 * size()))) as f32
    };
    nrrd(&fields, &(0..nx * ny * nz).flat_map(|i| value(i).to_le_bytes()).collect::<Vec<u8>>())
}

/// The pixels whose rays meet the plane at least `voxels` voxels inside the grid: pixel, ray, and distance.
fn meets(axes: DMat3, eye: &Eye, voxels: f64) -> Vec<(usize, DVec3, f64)> {
    let meet = |pixel: usize| {
        let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
        let t = (LEVEL - 5.0 - GRADIENT.dot(eye.eye)) / GRADIENT.dot(d);
        let inside = (0.5 * size() - (axes.inverse() * (eye.eye + d * t)).abs()).min_element();
        (t > 0.0 && inside > voxels).then_some((pixel, d, t))
    };
    let met: Vec<_> = (0..SIDE * SIDE).filter_map(meet).collect();
    assert!(met.len() > 40, "{} rays from {}", met.len(), eye.eye);
    met
}

fn eyes() -> [Eye; 3] {
    [[2.0, 1.5, 4.0], [-3.0, -2.5, 2.0], [1.0, 0.5, -4.0]].map(|at| Eye::at(at, 24.0))
}

#[test]
fn the_plane_is_where_it_is_in_the_world() {
    let house = House::shared();
    for axes in grids() {
        let volume = house.file(linear(axes));
        for eye in eyes() {
            for interpolation in ["trilinear", "b_spline", "catmull_rom"] {
                let own = json!({"isovalue": LEVEL, "interpolation": interpolation});
                let found = depths(house, &volume, &eye.json(), &own);
                for (pixel, _, t) in meets(axes, &eye, 2.0) {
                    let got = found[pixel].unwrap();
                    assert!((got - t).abs() < 2e-5, "{axes} {} {interpolation} {pixel}: {got} for {t}", eye.eye);
                }
            }
        }
    }
}

/// The directions and colours of two lights, one of which shines on the back.
const LIGHTS: [(DVec3, DVec3); 2] =
    [(dvec3(1.0, 0.2, 2.0), dvec3(0.9, 0.5, 0.2)), (dvec3(0.3, -1.0, -0.6), dvec3(0.1, 0.4, 0.8))];

fn light() -> Value {
    let lights = LIGHTS.map(|(d, c)| json!({"direction": d.to_array(), "color": c.to_array()}));
    json!({"lights": lights, "ambient": 0.1, "diffuse": 0.6, "specular": 0.3, "shininess": 9})
}

/// The light of Blinn-Phong, from both sides.
fn blinn_phong(d: DVec3, colour: DVec3) -> DVec3 {
    let n = GRADIENT.normalize();
    LIGHTS.iter().fold(0.1 * colour, |sum, (direction, light)| {
        let l = direction.normalize();
        let glint = n.dot((l - d).normalize()).abs().powi(9);
        sum + 0.6 * n.dot(l).abs() * colour * *light + 0.3 * glint * *light
    })
}

#[test]
fn its_normal_is_that_of_the_world_and_its_light_blinn_and_phongs() {
    let house = House::shared();
    let colour = dvec3(0.8, 0.6, 0.9);
    let forms =
        [("central", "trilinear"), ("analytic", "trilinear"), ("central", "b_spline"), ("analytic", "catmull_rom")];
    for axes in grids() {
        let volume = house.file(linear(axes));
        for (eye, (normals, interpolation)) in eyes().iter().flat_map(|eye| forms.map(|form| (eye, form))) {
            let (film, _) = house.film(&json!({
                "technique": "isosurface", "volume": volume, "camera": eye.json(), "budget": {"samples": 1},
                "image": {"width": SIDE, "height": SIDE},
                "isosurface": {"isovalue": LEVEL, "color": colour.to_array(), "light": light(), "normals": normals,
                    "interpolation": interpolation}
            }));
            for (pixel, d, _) in meets(axes, eye, 3.0) {
                let truth = blinn_phong(d, colour);
                let got = DVec3::from_array(std::array::from_fn(|i| f64::from(film.main.mean[4 * pixel + i])));
                let off = (got - truth).abs().max_element();
                assert!(off < 1e-4, "{axes} {} {normals} {interpolation} {pixel}: {got} for {truth}", eye.eye);
            }
        }
    }
}
