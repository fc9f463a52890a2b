//! Forms that must agree: lanes, with and without skipping, and the same request twice.

use std::sync::Arc;

use cloudchamber::film::Film;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::{ct_head, mri_head};

fn request(volume: &Value, parameters: Value) -> Value {
    json!({
        "technique": "projection", "volume": volume, "image": {"width": 121, "height": 90}, "budget": {"samples": 2},
        "projection": parameters
    })
}

/// The greatest difference, relative to the greatest value.
fn worst(a: &Arc<Film>, b: &Arc<Film>) -> f32 {
    assert_eq!(a.main.mean.len(), b.main.mean.len());
    let most = a.main.mean.iter().fold(1e-9f32, |m, v| m.max(v.abs()));
    a.main.mean.iter().zip(&b.main.mean).map(|(a, b)| (a - b).abs() / most).fold(0.0, f32::max)
}

#[test]
fn skipping_changes_nothing() {
    let house = House::shared();
    let mut volumes = vec![house.file(mri_head()), json!({"builtin": "smoke", "resolution": 64})];
    volumes.push(house.floats([33, 17, 9], |x, y, z| if x * y > 0.3 { f64::NAN } else { (9.0 * x * y + z).sin() }));
    volumes.extend(ct_head().map(|bytes| house.file(bytes)));
    for volume in volumes {
        for mode in ["maximum", "minimum"] {
            for interpolation in ["trilinear", "b_spline", "catmull_rom"] {
                let film = |skip: bool, step: f64| {
                    let parameters = json!({"mode": mode, "interpolation": interpolation, "empty_space_skipping": skip,
                        "output": "value", "step_voxels": step});
                    house.film(&request(&volume, parameters)).0
                };
                for step in [1.0, 5.0] {
                    // Bytes are interpolated in integers, which may exceed a cell's range by 2^-7 of a grey level.
                    let difference = worst(&film(true, step), &film(false, step));
                    assert!(difference < 1.0 / 128.0 / 255.0, "{volume} {mode} {interpolation}: {difference:e}");
                }
            }
        }
    }
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let wide = House::shared();
    for lanes in [1, 4, 8] {
        let narrow = House::of_lanes(lanes);
        for parameters in
            [json!({}), json!({"mode": "minimum", "exact": true}), json!({"mode": "sum"}), json!({"mode": "xray"})]
        {
            let film = |house: &House| {
                let mut parameters = parameters.clone();
                parameters["output"] = "value".into();
                house.film(&request(&house.file(mri_head()), parameters)).0
            };
            let difference = worst(&film(narrow), &film(wide));
            assert!(difference < 1e-4, "{lanes} lanes, {parameters}: {difference:e}");
        }
    }
}

#[test]
fn the_same_request_gives_the_same_bytes() {
    let house = House::shared();
    let volume = house.file(mri_head());
    for mode in ["maximum", "xray"] {
        let png = || {
            let job = house.finish(&request(&volume, json!({"mode": mode})));
            let updates = job.watch();
            let frame = updates.borrow().frame.clone();
            frame.unwrap().png.clone()
        };
        assert_eq!(png(), png());
    }
}
