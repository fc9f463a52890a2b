//! Voxels that are NaN, and volumes with a default isovalue.

use glam::{DVec3, dvec3};
use serde_json::{Value, json};

use super::depth::{SIDE, depths};
use crate::common::engine::House;
use crate::common::mri_head;
use crate::common::writers::Nifti;
use crate::emission_absorption::oracle::{Eye, inside};

/// The picture without skipping. A cell with all its voxels on one side of the isovalue would hide errors inside it.
fn picture(house: &House, volume: &Value, eye: &Eye, own: &Value, step_voxels: f64) -> Vec<f32> {
    let mut request = json!({
        "technique": "isosurface", "volume": volume, "camera": eye.json(), "image": {"width": SIDE, "height": SIDE},
        "budget": {"samples": 1}, "isosurface": own
    });
    request["isosurface"]["step_voxels"] = step_voxels.into();
    request["isosurface"]["empty_space_skipping"] = false.into();
    house.film(&request).0.main.mean.clone()
}

/// The hole would have surfaces around it if NaN were taken for a small or a great value.
#[test]
fn there_is_no_surface_around_what_is_no_number() {
    let house = House::shared();
    let hole = |x: f64, y: f64, z: f64| if x * x + y * y + z * z < 0.25 { f64::NAN } else { 0.8 + 0.1 * x };
    let volume = house.floats([20, 21, 22], hole);
    for eye in [Eye::at([2.1, 1.7, 2.3], 40.0), Eye::at([0.1, 0.0, 0.2], 60.0)] {
        for isovalue in [0.5, 0.0, -3.0, 0.95] {
            for step_voxels in [0.5, 1.0, 3.0] {
                for own in [
                    json!({"isovalue": isovalue}),
                    json!({"isovalue": isovalue, "interpolation": "b_spline"}),
                    json!({"isovalue": isovalue, "interpolation": "catmull_rom"}),
                    json!({"surfaces": [{"isovalue": isovalue, "opacity": 0.5}, {"isovalue": 1.5}]}),
                ] {
                    let film = picture(house, &volume, &eye, &own, step_voxels);
                    assert!(film.iter().all(|v| *v == 0.0), "{own}, step {step_voxels}");
                }
            }
        }
    }
}

const CELLS: [usize; 3] = [20, 24, 22];
const LEVEL: f64 = 0.13;
const GRADIENT: DVec3 = dvec3(0.2, -0.1, 1.0);

/// The distance of a point from the hole in the ramp, in voxels; less than 0 inside it.
fn from_hole(p: DVec3) -> f64 {
    let voxels = DVec3::from_array(CELLS.map(|n| n as f64)) / 2.0;
    ((p - dvec3(0.1, -0.2, 0.1)).abs() * voxels - 4.5).max_element()
}

#[test]
fn a_surface_goes_on_beside_a_hole_and_stops_in_it() {
    let house = House::shared();
    let ramp = |x: f64, y: f64, z: f64| {
        let p = dvec3(x, y, z);
        if from_hole(p) < 0.0 { f64::NAN } else { GRADIENT.dot(p) }
    };
    let volume = house.floats(CELLS, ramp);
    let (mut beside, mut within) = (0, 0);
    for eye in [[0.9, 0.6, 2.9], [-1.1, 0.2, -2.4]].map(|at| Eye::at(at, 40.0)) {
        for (interpolation, skip) in
            [("trilinear", false), ("trilinear", true), ("b_spline", false), ("catmull_rom", false)]
        {
            let own = json!({"isovalue": LEVEL, "interpolation": interpolation, "empty_space_skipping": skip});
            for (pixel, found) in depths(house, &volume, &eye.json(), &own).into_iter().enumerate() {
                let d = eye.direction(pixel % SIDE, pixel / SIDE, SIDE);
                let t = (LEVEL - GRADIENT.dot(eye.eye)) / GRADIENT.dot(d);
                let at = eye.eye + d * t;
                // Near the faces the ramp levels off, and near the hole a step may start inside it.
                if inside(eye.eye, d, DVec3::ONE).is_none() || at.abs().max_element() > 0.8 {
                    continue;
                }
                if from_hole(at) > 3.5 {
                    beside += 1;
                    assert!((found.unwrap() - t).abs() < 2e-5, "{interpolation} {pixel}: {found:?} for {t}");
                } else if from_hole(at) < -0.5 {
                    within += 1;
                    assert_eq!(found, None, "{interpolation} {pixel}: in the hole");
                }
            }
        }
    }
    assert!(beside > 300 && within > 100, "{beside} and {within} rays");
}

/// The isovalue that a render reports as its choice.
fn chosen(volume: &Value) -> f64 {
    let body = json!({"technique": "isosurface", "volume": volume, "image": {"width": 4, "height": 4}, "budget": {"samples": 1}});
    let resource = House::shared().finish(&body).resource();
    assert_eq!(resource["warnings"], json!([]), "{volume}");
    let said = resource["plan"]["reasons"][0].as_str().unwrap().to_owned();
    said.strip_prefix("isovalues: ").unwrap().parse().unwrap()
}

/// A NIfTI file of 16-bit numbers from 40 above one to 40 below the other, a fifth of them in the upper class.
fn two_classes(low: i16, high: i16) -> Vec<u8> {
    let mut file = Nifti::new(false, [12, 12, 12], cloudchamber::volume::RawType::I16);
    file.put_f32(112, 1.0);
    let noise = |i: usize| (i * 37 % 41) as i16;
    let voxel = |i: usize| if i.is_multiple_of(5) { high - noise(i) } else { low + noise(i) };
    file.with(&(0..12 * 12 * 12).flat_map(|i| voxel(i).to_le_bytes()).collect::<Vec<u8>>())
}

#[test]
fn without_a_word_the_surface_is_bone_in_a_ct_scan_and_between_two_classes_elsewhere() {
    let house = House::shared();
    assert_eq!(chosen(&house.file(two_classes(-1000, 1200))), 300.0);
    for (low, high) in [(0, 400), (-300, 900), (1000, 1300)] {
        let isovalue = chosen(&house.file(two_classes(low, high)));
        let [low, high] = [low + 40, high - 40].map(f64::from);
        assert!((low..=high).contains(&isovalue), "{isovalue} is not between {low} and {high}");
    }
    let head = chosen(&house.file(mri_head()));
    assert!((1.0..=255.0).contains(&head), "{head}");
    for name in ["smoke", "sphere", "gaussian", "marschner_lobb", "shepp_logan"] {
        let isovalue = chosen(&json!({"builtin": name, "resolution": 32}));
        assert!(isovalue > 0.0 && isovalue < 1.0, "{name}: {isovalue}");
    }
}
