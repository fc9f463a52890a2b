//! Permitted and refused requests; the same request twice; the manual's example.

use cloudchamber::error::Error;
use cloudchamber::technique::slice;
use glam::dvec3;
use serde_json::json;

use super::planes::{Camera, SIDE};
use crate::common::engine::House;

#[test]
fn what_makes_no_sense_is_refused_by_its_name() {
    let house = House::shared();
    for (parameters, pointer) in [
        (json!({"plane": {"normal": [0, 0, 0]}}), "/slice/plane/normal"),
        (json!({"plane": {"normal": [0, 0]}}), "/slice/plane/normal"),
        (json!({"plane": {"axis": "w"}}), "/slice/plane/axis"),
        (json!({"plane": {"axis": "x", "normal": [0, 0, 1]}}), "/slice/plane/normal"),
        (json!({"plane": {"axis": "x", "point": [0, 0, 1]}}), "/slice/plane/point"),
        (json!({"plane": {"axis": "x", "position": 1, "fraction": 0.5}}), "/slice/plane/fraction"),
        (json!({"plane": {"position": 1}}), "/slice/plane/position"),
        (json!({"plane": {"axis": "x", "fraction": 1.5}}), "/slice/plane/fraction"),
        (json!({"thickness": -1}), "/slice/thickness"),
        (json!({"window": {"level": 0, "width": 0}}), "/slice/window/width"),
        (json!({"color_map": "jet"}), "/slice/color_map"),
        (json!({"mode": "sum"}), "/slice/mode"),
    ] {
        let body = json!({"technique": "slice", "volume": {"builtin": "sphere", "resolution": 8}, "slice": parameters});
        match house.scene(&body) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].pointer, pointer, "{body}"),
            other => panic!("{body}: {:?}", other.err()),
        }
    }
}

#[test]
fn the_window_goes_from_the_first_colour_to_the_last() {
    let house = House::shared();
    let volume = house.floats([64, 4, 4], |x, _, _| x);
    let (film, _) = house.film(&json!({
        "technique": "slice", "volume": volume, "camera": Camera::at(dvec3(0.0, 0.0, 5.0)).json(),
        "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
        "slice": {"window": {"level": 0.1, "width": 0.8}}
    }));
    let row: Vec<f32> = (0..SIDE).map(|i| film.main.mean[4 * (SIDE / 2 * SIDE + i)]).filter(|v| *v > 0.0).collect();
    assert!(row.windows(2).all(|p| p[1] >= p[0]), "{row:?}");
    assert_eq!(row[row.len() - 1], 1.0);
    // Grey is even on the screen. The centre, an eighth of the window below its level, is 0.375 in sRGB.
    let centre = film.main.mean[4 * (SIDE / 2 * SIDE + SIDE / 2)];
    assert!((centre - ((0.375f32 + 0.055) / 1.055).powf(2.4)).abs() < 1e-3, "{centre}");
}

#[test]
fn the_same_request_gives_the_same_bytes_and_the_example_a_picture() {
    let house = House::shared();
    let png = || {
        let job = house.finish(&slice::example());
        let updates = job.watch();
        let frame = updates.borrow().frame.clone();
        frame.unwrap().png.clone()
    };
    assert_eq!(png(), png());
    let bytes = house.picture(&slice::example());
    let first = bytes[bytes.len() / 2];
    assert!(bytes.iter().any(|b| *b > 100) && bytes.iter().any(|b| *b != first));
}
