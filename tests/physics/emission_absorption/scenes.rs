//! Clipping, backgrounds, labels, presets, odd volumes and combinations that are refused.

use cloudchamber::error::Error;
use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 8;

/// A scene looked at from far along +z, orthographic, filled by the box.
fn scene(volume: &Value, parameters: Value) -> Value {
    json!({"technique": "emission_absorption", "volume": volume, "image": {"width": SIDE, "height": SIDE}, "budget": {"samples": 1},
           "camera": {"eye": [0, 0, 4], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 20}, "emission_absorption": parameters})
}

fn constant() -> Value {
    json!({"builtin": "constant", "resolution": 32})
}

fn white(sigma: f64) -> Value {
    json!({"transfer_function": {"points": [{"value": 1, "color": [1, 1, 1], "opacity_per_unit": sigma}]}, "opacity_threshold": 1})
}

fn raw(dims: &str, kind: &str, bytes: Vec<u8>) -> Value {
    let text = |s: &str| Some(s.to_owned());
    let query = RawQuery { dims: text(dims), r#type: text(kind), spacing: None, endian: None };
    json!({"id": House::shared().assets().volumes().insert(bytes, "test", query.parse().unwrap()).unwrap().1})
}

fn alphas(request: &Value) -> Vec<f32> {
    House::shared().film(request).0.main.mean.chunks_exact(4).map(|p| p[3]).collect()
}

#[test]
fn a_plane_and_a_box_cut_to_the_digit() {
    for step_voxels in [0.7, 3.0] {
        let mut own = white(0.8);
        own["step_voxels"] = step_voxels.into();
        let mut request = scene(&constant(), own);
        for (clip, length) in [
            (json!({"planes": [{"normal": [0, 0, 5], "point": [0, 0, 0.25]}]}), 0.75),
            (json!({"planes": [{"normal": [0, 0, -1]}, {"normal": [0, 0, 1], "point": [0, 0, -0.3]}]}), 0.3),
            (json!({"box": {"min": [-9, -9, -0.5], "max": [9, 9, 0.7]}}), 1.2),
        ] {
            request["clip"] = clip.clone();
            let truth = 1.0 - (-0.8f64 * length).exp();
            for alpha in alphas(&request) {
                assert!((f64::from(alpha) - truth).abs() < 1e-4, "{clip}, step {step_voxels}: {alpha} for {truth}");
            }
        }
    }
}

#[test]
fn planes_that_remove_all_leave_nothing_and_say_so() {
    let house = House::shared();
    let mut request = scene(&constant(), white(3.0));
    request["clip"] = json!({"planes": [{"normal": [1, 2, 3], "point": [5, 5, 5]}]});
    let job = house.finish(&request);
    assert!(house.film_of(&job).main.mean.iter().all(|v| *v == 0.0));
    let resource = job.resource();
    assert!(resource["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "clipped_away"), "{resource}");
}

#[test]
fn a_background_shows_through_and_transparency_is_alpha() {
    let house = House::shared();
    let mut request = scene(&constant(), white(0.5));
    let through = (-1.0f64).exp();
    let decoded = |request: &Value| image::load_from_memory(&house.png(request)).unwrap();
    let encode = |v: f64| ((1.055 * v.powf(1.0 / 2.4) - 0.055) * 255.0).round() as i32;
    request["image"]["background"] = json!([0.1, 0.5, 1]);
    let picture = decoded(&request).to_rgb8();
    for (c, behind) in [0.1, 0.5, 1.0].iter().enumerate() {
        let expected = encode(1.0 - through + through * behind);
        assert!(
            (i32::from(picture.get_pixel(4, 4)[c]) - expected).abs() <= 1,
            "channel {c}: {:?}",
            picture.get_pixel(4, 4)
        );
    }
    request["image"] = json!({"width": SIDE, "height": SIDE, "transparent": true});
    let picture = decoded(&request);
    assert_eq!(picture.color(), image::ColorType::Rgba8);
    let pixel = picture.to_rgba8().get_pixel(3, 3).0;
    assert!(pixel[0] >= 254 && (f64::from(pixel[3]) - 255.0 * (1.0 - through)).abs() <= 1.0, "{pixel:?}");
    // The EXR has four floats for each pixel.
    assert!(house.film(&request).0.exr().unwrap().len() > 4 * 4 * SIDE * SIDE);
}

#[test]
fn labels_are_not_mixed() {
    // Three slabs along z: 0, 7, 300.
    let mut bytes = Vec::new();
    for z in 0..30 {
        let label: i16 = [0, 7, 300][z / 10];
        bytes.extend((0..64).flat_map(|_| label.to_le_bytes()));
    }
    let volume = raw("8,8,30", "i16", bytes);
    let labels = json!([{"label": 7, "color": [1, 0, 0], "opacity_per_unit": 0.05}, {"label": 300, "color": [0, 1, 0], "opacity_per_unit": 0.02}]);
    let mut request = scene(&volume, json!({"transfer_function": {"labels": labels}, "opacity_threshold": 1}));
    request["camera"]["eye"] = json!([0, 0, 40]);
    request["camera"]["fov_y_deg"] = 5.into();
    let (film, _) = House::shared().film(&request);
    // From +z, the first ten slices are of 300 and the next ten of 7.
    let (green, red) = (1.0 - (-0.2f64).exp(), (-0.2f64).exp() * (1.0 - (-0.5f64).exp()));
    for p in film.main.mean.chunks_exact(4) {
        assert!(
            (f64::from(p[0]) - red).abs() < 1e-3 && (f64::from(p[1]) - green).abs() < 1e-3 && p[2] < 1e-6,
            "{p:?}: {red} {green}"
        );
    }
    // Without given colours, each label has a colour of its own.
    let mut request = request.clone();
    request["emission_absorption"] = json!({"transfer_function": {"preset": "labels"}});
    assert!(House::shared().film(&request).0.main.mean.iter().any(|v| *v > 0.1));
}

#[test]
fn the_cuda_samples_opacity_is_its_own() {
    // A byte of 255 / 9 · 1.5 is in the middle of the second texel: red with alpha 1, which is `density` per step of 0.01.
    let value = (255.0 / 9.0 * 1.5f64).round() as u8;
    let volume = raw("16,16,16", "u8", vec![value; 16 * 16 * 16]);
    let mut request =
        scene(&volume, json!({"cuda_sample": {"density": 0.01, "opacity_threshold": 1, "brightness": 2}}));
    request["camera"]["eye"] = json!([0, 0, 40]);
    request["camera"]["fov_y_deg"] = 5.into();
    let (film, _) = House::shared().film(&request);
    let truth = 1.0 - (1.0f64 - 0.01).powf(2.0 / 0.01);
    for p in film.main.mean.chunks_exact(4) {
        assert!((f64::from(p[3]) - truth).abs() < 0.003, "{p:?} for opacity {truth}");
        // The pixel is red, and twice as bright as it is opaque.
        assert!((f64::from(p[0]) - 2.0 * truth).abs() < 0.02 && p[1] < 0.05 && p[2] < 1e-3, "{p:?}");
    }
}

#[test]
fn the_smallest_volumes_are_boxes_too() {
    for interpolation in ["nearest", "trilinear", "b_spline", "catmull_rom"] {
        for (dims, count) in [("1,1,1", 1), ("2,2,2", 8), ("1,5,3", 15), ("7,1,1", 7)] {
            for kind in ["u8", "i16", "u16", "f32"] {
                let voxels: Vec<u8> = match kind {
                    "u8" => vec![9; count],
                    "f32" => (0..count).flat_map(|_| 9f32.to_le_bytes()).collect(),
                    _ => (0..count).flat_map(|_| 9i16.to_le_bytes()).collect(),
                };
                let volume = raw(dims, kind, voxels);
                let deep: f64 = dims.rsplit(',').next().unwrap().parse().unwrap();
                let mut own = white(0.3);
                own["interpolation"] = interpolation.into();
                let mut request = scene(&volume, own);
                request["camera"] =
                    json!({"eye": [0, 0, 20], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 1});
                let truth = 1.0 - (-0.3 * deep).exp();
                for alpha in alphas(&request) {
                    assert!(
                        (f64::from(alpha) - truth).abs() < 1e-4,
                        "{interpolation} {kind} {dims}: {alpha} for {truth}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_hole_of_nan_reaches_no_film() {
    let house = House::shared();
    let volume = house.floats([24, 24, 24], |x, y, z| if x * x + y * y + z * z < 0.1 { f64::NAN } else { 1.0 });
    for own in [
        json!({"interpolation": "nearest"}),
        json!({"interpolation": "b_spline", "shading": true}),
        json!({"interpolation": "catmull_rom"}),
        json!({"pre_integrated": true, "shading": true}),
        json!({"curvature": {}, "shading": true}),
        json!({"silhouette": {}, "gradient_opacity": {}, "tone": {}}),
        json!({"shading": true}),
    ] {
        let mut request = scene(&volume, own.clone());
        request["emission_absorption"]["transfer_function"] = white(2.0)["transfer_function"].clone();
        let job = house.finish(&request);
        assert!(house.film_of(&job).main.mean.iter().all(|v| v.is_finite()), "{own}");
        assert_eq!(job.resource()["counts"]["non_finite_samples"], 0, "{own}");
    }
}

#[test]
fn what_cannot_be_had_together_names_its_field() {
    let house = House::shared();
    for (own, clip, pointer) in [
        (json!({"pre_integrated": true, "tone": {}}), Value::Null, "/emission_absorption/pre_integrated"),
        (json!({"pre_integrated": true, "order": "back_to_front"}), Value::Null, "/emission_absorption/pre_integrated"),
        (json!({"order": "back_to_front", "interpolation": "nearest"}), Value::Null, "/emission_absorption/order"),
        (
            json!({"transfer_function": {"preset": "labels"}, "interpolation": "trilinear"}),
            Value::Null,
            "/emission_absorption/interpolation",
        ),
        (json!({"transfer_function": {}, "cuda_sample": {}}), Value::Null, "/emission_absorption/cuda_sample"),
        (
            json!({"regions": [{"value": [3, 3], "gradient": [0, 1], "color": [1, 1, 1], "opacity_per_unit": 1}]}),
            Value::Null,
            "/emission_absorption/regions/0/value/1",
        ),
        (
            json!({"transfer_function": {"labels": [{"label": 1, "opacity_per_unit": 1}, {"label": 1, "opacity_per_unit": 2}]}}),
            Value::Null,
            "/emission_absorption/transfer_function/labels/1/label",
        ),
        (
            json!({"light": {"lights": [{"direction": [0, 0, 0]}]}}),
            Value::Null,
            "/emission_absorption/light/lights/0/direction",
        ),
        (json!({}), json!({"planes": [{"normal": [0, 0, 0]}]}), "/clip/planes/0/normal"),
        (json!({}), json!({"box": {"min": [0, 0, 0], "max": [1, 0, 1]}}), "/clip/box/max/1"),
    ] {
        let mut request = scene(&constant(), own.clone());
        if !clip.is_null() {
            request["clip"] = clip;
        }
        match house.scene(&request) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].pointer, pointer, "{own}"),
            other => panic!("{own}: {:?}", other.err()),
        }
    }
}
