//! Forms that must agree: orders, lanes, with and without skipping, and the same request twice.

use std::sync::Arc;

use cloudchamber::film::Film;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::{ct_head, mri_head};

fn request(volume: &Value, samples: u32, parameters: Value) -> Value {
    json!({
        "technique": "emission_absorption", "volume": volume, "image": {"width": 160, "height": 120},
        "budget": {"samples": samples}, "seed": 5, "emission_absorption": parameters
    })
}

fn worst(a: &Arc<Film>, b: &Arc<Film>) -> f32 {
    assert_eq!(a.main.mean.len(), b.main.mean.len());
    a.main.mean.iter().zip(&b.main.mean).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn back_to_front_is_front_to_back() {
    let house = House::shared();
    let volume = house.file(mri_head());
    for shading in [false, true] {
        let film = |order: &str| {
            house.film(&request(&volume, 2, json!({"order": order, "opacity_threshold": 1, "shading": shading}))).0
        };
        let difference = worst(&film("front_to_back"), &film("back_to_front"));
        assert!(difference < 1e-5, "shading {shading}: {difference:e}");
    }
}

#[test]
fn skipping_changes_nothing() {
    let house = House::shared();
    let mut volumes = vec![house.file(mri_head()), json!({"builtin": "smoke", "resolution": 64})];
    volumes.extend(ct_head().map(|bytes| house.file(bytes)));
    for volume in volumes {
        for preset in ["ramp", "mri_head", "ct_bone"] {
            let film = |skip: bool| {
                let parameters = json!({"empty_space_skipping": skip, "transfer_function": {"preset": preset}});
                house.film(&request(&volume, 1, parameters)).0
            };
            let difference = worst(&film(true), &film(false));
            assert!(difference < 1e-5, "{volume} with {preset}: {difference:e}");
        }
    }
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let reference = House::shared();
    let wave = |x: f64, y: f64, z: f64| 1.0 + (5.0 * x).sin() * (4.0 * y).cos() + z;
    for lanes in [1, 4, 8] {
        let house = House::of_lanes(lanes);
        let bytes = [house.file(mri_head()), reference.file(mri_head())];
        let floats = [house, reference].map(|h| h.floats([40, 37, 43], wave));
        for parameters in [json!({}), json!({"shading": true}), json!({"order": "back_to_front"})] {
            for [here, there] in [&bytes, &floats] {
                let narrow = house.film(&request(here, 2, parameters.clone())).0;
                let wide = reference.film(&request(there, 2, parameters.clone())).0;
                let difference = worst(&narrow, &wide);
                assert!(difference < 1.0 / 255.0, "{lanes} lanes, {parameters}: {difference:e}");
                let apart =
                    narrow.main.mean.iter().zip(&wide.main.mean).filter(|(a, b)| (*a - *b).abs() > 1e-5).count();
                assert!(
                    apart * 1000 < narrow.main.mean.len(),
                    "{lanes} lanes, {parameters}: {apart} values differ by more than 1e-5"
                );
            }
        }
    }
}

/// Bytes that look random, as an NRRD file on [−1, 1]³.
fn bytes(dims: [usize; 3]) -> Vec<u8> {
    let [x, y, z] = dims;
    let spacing = dims.map(|n| (2.0 / n as f64).to_string()).join(" ");
    let header =
        format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {x} {y} {z}\nspacings: {spacing}\nencoding: raw\n\n");
    let mut file = header.into_bytes();
    file.extend((0..x * y * z).map(|i| (i as u32).wrapping_mul(2_654_435_761).rotate_right(13) as u8));
    file
}

#[test]
fn grids_about_as_small_as_what_lanes_read_together_are_the_same_for_one_lane() {
    // Lanes that are close together read blocks of 4³ voxels, and lit ones blocks of 6³. From that size on, and below it, nothing is read beyond
    // the grid.
    let (reference, plain) = (House::shared(), House::of_lanes(1));
    for dims in
        [[3, 3, 3], [4, 4, 4], [5, 4, 6], [5, 5, 5], [6, 6, 6], [7, 6, 9], [4, 16, 16], [16, 5, 16], [16, 16, 6]]
    {
        let volumes = [plain, reference].map(|house| house.file(bytes(dims)));
        for parameters in [json!({}), json!({"shading": true})] {
            let mut own = json!({"transfer_function": {"preset": "ramp"}, "step_voxels": 0.25});
            own.as_object_mut().unwrap().extend(parameters.as_object().unwrap().clone());
            let one = plain.film(&request(&volumes[0], 1, own.clone())).0;
            let many = reference.film(&request(&volumes[1], 1, own)).0;
            let difference = worst(&one, &many);
            assert!(difference < 1.0 / 255.0, "{dims:?}, {parameters}: {difference:e}");
            assert!(one.main.mean.iter().any(|v| *v > 0.1), "{dims:?}: nothing to see");
        }
    }
}

#[test]
fn the_same_request_gives_the_same_bytes() {
    let house = House::shared();
    let volume = house.file(mri_head());
    let png = || {
        house
            .finish(&request(&volume, 5, json!({"shading": true})))
            .watch()
            .borrow()
            .frame
            .as_ref()
            .unwrap()
            .png
            .clone()
    };
    assert_eq!(png(), png());
}

#[test]
fn a_seed_changes_the_noise_and_not_the_picture() {
    let house = House::shared();
    let volume = house.file(mri_head());
    let film = |seed: u64| {
        let mut request = request(&volume, 16, json!({}));
        request["seed"] = json!(seed);
        house.film(&request)
    };
    let ((a, error), (b, _)) = (film(1), film(2));
    assert!(worst(&a, &b) > 1e-4, "another seed must give other noise");
    // Two independent means differ by the square root of two standard errors.
    let difference = a.difference(&b).unwrap() / 2.0f64.sqrt();
    let noise = error.noise.unwrap();
    assert!(difference < 1.5 * noise, "the pictures differ by {difference}, the noise is said to be {noise}");
}
