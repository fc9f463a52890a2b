//! A bright voxel of a scan is seen at the place that the file's affine gives, by projections that are worked out here.

use cloudchamber::volume::RawType;
use glam::{DAffine3, DMat3, DVec3, dvec3};
use serde_json::{Value, json};

use super::support::{Camera, pixels, request};
use crate::common::engine::House;
use crate::common::writers::Nifti;

const SIDE: usize = 48;
const DIMS: [usize; 3] = [18, 22, 16];
const DIM: f64 = 20.0;
const BRIGHT: f64 = 200.0;
/// The markers are near three different ends, so that a mirrored or exchanged axis shows.
const MARKERS: [[usize; 3]; 2] = [[14, 5, 12], [3, 15, 9]];

/// A file whose sform is the affine, with one bright voxel.
fn scan(affine: DAffine3, marker: [usize; 3]) -> Vec<u8> {
    let mut file = Nifti::new(false, DIMS.map(|n| n as u16), RawType::F32);
    let [x, y, z] = [affine.x_axis, affine.y_axis, affine.z_axis];
    let t = affine.translation;
    file.put_sform([[x.x, y.x, z.x, t.x], [x.y, y.y, z.y, t.y], [x.z, y.z, z.z, t.z]].map(|row| row.map(|v| v as f32)));
    let mut values = vec![DIM as f32; DIMS.iter().product()];
    values[marker[0] + DIMS[0] * (marker[1] + DIMS[1] * marker[2])] = BRIGHT as f32;
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    file.with(&bytes)
}

/// The place of a voxel by the affine, relative to that of the grid's centre, since the volume is centred at the origin.
fn place(affine: DAffine3, index: [usize; 3]) -> DVec3 {
    let index = DVec3::from_array(index.map(|i| i as f64));
    let centre = DVec3::from_array(DIMS.map(|n| (n as f64 - 1.0) / 2.0));
    affine.transform_point3(index) - affine.transform_point3(centre)
}

/// The affines: right-anterior-superior as it is; stored as left-posterior-superior; and turned about two axes with long voxels.
fn affines() -> [(&'static str, DAffine3); 3] {
    let oblique = DMat3::from_rotation_z(0.5) * DMat3::from_rotation_x(-0.7);
    let at = dvec3(-83.0, 41.0, 17.0);
    let of = |linear| DAffine3::from_mat3_translation(linear, at);
    [
        ("RAS", of(DMat3::from_diagonal(dvec3(1.0, 1.0, 1.0)))),
        ("LPS", of(DMat3::from_diagonal(dvec3(-1.0, -1.0, 1.0)))),
        ("oblique", of(oblique * DMat3::from_diagonal(dvec3(0.9, 1.1, 1.6)))),
    ]
}

/// Cameras at the right, the front and above, each in both projections.
fn cameras() -> Vec<Camera> {
    let mut cameras = Vec::new();
    for (axis, up) in [(DVec3::X, DVec3::Z), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::Y)] {
        for perspective in [false, true] {
            cameras.push(Camera { eye: axis * 70.0, target: DVec3::ZERO, up, span: 34.0, perspective });
        }
    }
    cameras
}

/// Each technique with its parameters, the channel that shows the marker, and the value to subtract from it. Steps are short, since a step may miss
/// a surface around a thin part. The dim rest shows as nothing.
fn forms() -> [(&'static str, Value, usize, f64); 3] {
    let points = json!([
        {"value": DIM + 30.0, "color": [1, 1, 1], "opacity_per_unit": 0},
        {"value": BRIGHT, "color": [1, 1, 1], "opacity_per_unit": 1}
    ]);
    [
        ("projection", json!({"mode": "maximum", "exact": true, "output": "value"}), 0, DIM + 1.0),
        ("emission_absorption", json!({"transfer_function": {"points": points}, "step_voxels": 0.25}), 3, 0.0),
        ("isosurface", json!({"isovalue": DIM + 30.0, "step_voxels": 0.25}), 3, 0.0),
    ]
}

/// The centroid of the bright part, weighted by brightness: column and row.
fn centroid(film: &[[f32; 4]], channel: usize, above: f64) -> (f64, f64) {
    let (mut weight, mut column, mut row, mut lit) = (0.0, 0.0, 0.0, 0);
    for (pixel, p) in film.iter().enumerate() {
        let w = (f64::from(p[channel]) - above).max(0.0);
        weight += w;
        column += w * (pixel % SIDE) as f64;
        row += w * (pixel / SIDE) as f64;
        lit += usize::from(w > 0.0);
    }
    assert!((1..60).contains(&lit), "{lit} pixels are one voxel");
    (column / weight, row / weight)
}

#[test]
fn a_marker_is_where_the_affine_says() {
    let house = House::shared();
    for (name, affine) in affines() {
        for marker in MARKERS {
            let volume = house.file(scan(affine, marker));
            for camera in cameras() {
                let (column, row) = camera.project(place(affine, marker), SIDE);
                let middle = (SIDE as f64 - 1.0) / 2.0;
                assert!((column - middle).abs() > 2.5 || (row - middle).abs() > 2.5, "mirrored, it would be the same");
                for (technique, parameters, channel, above) in forms() {
                    let film = pixels(&request(technique, &volume, &camera.json(), SIDE, parameters));
                    let got = centroid(&film, channel, above);
                    let off = (got.0 - column).hypot(got.1 - row);
                    // The commonest mistake with an affine, half a voxel, would be 0.6 pixels and more.
                    assert!(off < 0.5, "{name} {marker:?} {technique} {camera:?}: {got:?} for {column}, {row}");
                }
            }
        }
    }
}

/// The side of a marker from the picture's middle: true if it is to the right, and true if it is up.
fn side_of_picture(volume: &Value, eye: DVec3, up: DVec3) -> (bool, bool) {
    let camera = Camera { eye, target: DVec3::ZERO, up, span: 34.0, perspective: true };
    let (technique, parameters, channel, above) = forms()[0].clone();
    let (column, row) =
        centroid(&pixels(&request(technique, volume, &camera.json(), SIDE, parameters)), channel, above);
    let middle = (SIDE as f64 - 1.0) / 2.0;
    (column > middle, row < middle)
}

/// The sides are in words rather than by a cross product, which could be as wrong here as there.
#[test]
fn right_anterior_and_superior_are_not_mirrored() {
    let house = House::shared();
    // The voxels are near the patient's right, front and top: at the far end of RAS, and at the near end of x and y if they run the other way.
    for (affine, marker) in [(affines()[0].1, [14, 18, 12]), (affines()[1].1, [3, 3, 12])] {
        let volume = house.file(scan(affine, marker));
        let from = |eye: DVec3, up| side_of_picture(&volume, eye * 70.0, up);
        // Face to face, the patient's right is on the left. From behind, it is on the right.
        assert_eq!(from(DVec3::Y, DVec3::Z), (false, true), "from the front");
        assert_eq!(from(DVec3::NEG_Y, DVec3::Z), (true, true), "from behind");
        // Seen from the right, the face looks to the right. Seen from the left, it looks to the left.
        assert_eq!(from(DVec3::X, DVec3::Z), (true, true), "from the right");
        assert_eq!(from(DVec3::NEG_X, DVec3::Z), (false, true), "from the left");
        // Seen from above with the face up, the right is on the right. Seen from the feet, it is on the left.
        assert_eq!(from(DVec3::Z, DVec3::Y), (true, true), "from above");
        assert_eq!(from(DVec3::NEG_Z, DVec3::Y), (false, true), "from below");
    }
}
