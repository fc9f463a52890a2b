//! No view knows an absolute scale: values and lengths of any magnitude make the same picture, if all that is given per value and per length is
//! scaled with them.

use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 24;

/// A smooth blob of a few bumps, from 0 to 1 times `value`, in a box of voxels of 10 to the power of `of_lengths`.
fn volume(value: f64, of_lengths: i32) -> Value {
    let dims = [SIDE, SIDE - 2, SIDE - 4];
    let of = |i: usize| {
        let places = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
        let [x, y, z] = [0, 1, 2].map(|axis| (places[axis] as f64 + 0.5) / dims[axis] as f64 * 2.0 - 1.0);
        let bumps = 1.0 + 0.3 * (4.0 * x).sin() * (5.0 * y).cos() + 0.2 * (6.0 * z + x).sin();
        (value * bumps * (1.0 - x * x - y * y - z * z).max(0.0) / 1.5) as f32
    };
    let query = RawQuery {
        dims: Some(dims.map(|n| n.to_string()).join(",")),
        r#type: Some("f32".into()),
        spacing: Some([(); 3].map(|()| format!("1e{of_lengths}")).join(",")),
        endian: None,
    };
    let bytes: Vec<u8> = (0..dims.iter().product()).flat_map(|i| of(i).to_le_bytes()).collect();
    let (_, id, _) = House::shared().assets().volumes().insert(bytes, "test", query.parse().unwrap()).unwrap();
    json!({"id": id})
}

/// Half of the box's greatest side.
fn half(of_lengths: i32) -> f64 {
    0.5 * SIDE as f64 * 10f64.powi(of_lengths)
}

/// The views, with parameters for values up to `value` and lengths of about `length`.
fn views(value: f64, length: f64) -> Vec<(&'static str, &'static str, Value)> {
    let points = json!([{"value": 0.2 * value, "color": [0.2, 0.4, 0.9], "opacity_per_unit": 0},
        {"value": 0.8 * value, "color": [1, 0.8, 0.5], "opacity_per_unit": 9.0 / length}]);
    let function = |more: Value| {
        let mut own = json!({"transfer_function": {"points": points}});
        own.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        own
    };
    let steep = value / length;
    let regions = json!({"regions": [{"value": [0.1 * value, 0.6 * value], "gradient": [0.2 * steep, 3.0 * steep], "color": [1, 0.5, 0.2],
        "opacity_per_unit": 8.0 / length}], "shading": true});
    vec![
        ("defaults", "emission_absorption", json!({"shading": true})),
        ("shaded", "emission_absorption", function(json!({"shading": true}))),
        ("integrated", "emission_absorption", function(json!({"pre_integrated": true}))),
        ("regions", "emission_absorption", regions),
        ("silhouette", "emission_absorption", function(json!({"silhouette": {}, "shading": true}))),
        (
            "gradient opacity",
            "emission_absorption",
            function(json!({"gradient_opacity": {}, "interpolation": "b_spline"})),
        ),
        ("curvature", "emission_absorption", function(json!({"curvature": {}}))),
        ("surface", "isosurface", json!({"isovalue": 0.4 * value, "ambient_occlusion": {}})),
        ("default surface", "isosurface", json!({})),
        ("brightest", "projection", json!({"mode": "maximum"})),
        ("sum", "projection", json!({"mode": "sum"})),
        ("film", "projection", json!({"mode": "xray"})),
        ("slice", "slice", json!({"thickness": 0.2 * length, "mode": "mean"})),
    ]
}

/// The same for views that scatter light.
fn scattering() -> [&'static str; 2] {
    ["single_scatter", "volume_path"]
}

fn scene(technique: &str, own: &Value, volume: &Value, length: f64) -> Value {
    let eye = [2.1, 1.4, 2.7].map(|v: f64| v * length);
    let mut scene = json!({"technique": technique, "volume": volume, "image": {"width": 48, "height": 48}, "budget": {"samples": 4}, "seed": 3,
        "camera": {"eye": eye, "up": [0, 1, 0], "fov_y_deg": 40}});
    scene[technique] = own.clone();
    scene
}

fn scattering_scene(technique: &str, value: f64, of_lengths: i32) -> Value {
    let length = half(of_lengths);
    let mut scene = scene(technique, &json!({}), &volume(value, of_lengths), length);
    scene["medium"] = json!({"density_window": [0, value], "sigma_t_per_unit": 5.0 / length, "albedo": 0.8});
    scene["lights"] = json!([{"type": "sun", "direction": [-0.5, -1, -0.3], "irradiance": 2}, {"type": "sky", "radiance": 0.3},
        {"type": "sphere", "position": [length, 1.2 * length, 0], "radius": 0.3 * length, "radiance": 4}]);
    scene["budget"] = json!({"samples": 16});
    scene
}

/// The powers of ten of values and of lengths.
const POWERS: [[i32; 2]; 10] =
    [[-30, 0], [-12, 0], [12, 0], [30, 0], [0, -9], [0, -4], [0, 9], [-30, 9], [30, -9], [-20, -6]];

/// The part of the channels that differ by more than a level, and the mean level.
fn apart(a: &[u8], b: &[u8]) -> (f64, f64) {
    let differ = a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    (differ as f64 / a.len() as f64, a.iter().map(|v| f64::from(*v)).sum::<f64>() / a.len() as f64)
}

#[test]
fn values_and_lengths_of_any_magnitude_make_the_same_picture() {
    let house = House::shared();
    let unit = volume(1.0, 0);
    let pictures: Vec<Vec<u8>> = views(1.0, half(0))
        .iter()
        .map(|(_, technique, own)| house.picture(&scene(technique, own, &unit, half(0))))
        .collect();
    let mut wrong = Vec::new();
    for [of_values, of_lengths] in POWERS {
        let (value, length) = (10f64.powi(of_values), half(of_lengths));
        let scaled = volume(value, of_lengths);
        for ((name, technique, own), due) in views(value, length).iter().zip(&pictures) {
            let (differ, mean) = apart(due, &house.picture(&scene(technique, own, &scaled, length)));
            assert!(mean > 10.0, "{name} is black");
            if differ > 0.0 {
                wrong.push(format!(
                    "{name}, values of 1e{of_values}, lengths of 1e{of_lengths}: {:.2} %",
                    100.0 * differ
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn light_is_scattered_alike_in_clouds_of_any_magnitude() {
    let house = House::shared();
    let mut wrong = Vec::new();
    for technique in scattering() {
        let due = house.picture(&scattering_scene(technique, 1.0, 0));
        for [of_values, of_lengths] in POWERS {
            let scene = scattering_scene(technique, 10f64.powi(of_values), of_lengths);
            let (differ, mean) = apart(&due, &house.picture(&scene));
            assert!(mean > 10.0, "{technique} is black");
            // A path turns elsewhere if rounding puts a random number on the other side of a probability.
            if differ > 0.01 {
                wrong.push(format!(
                    "{technique}, values of 1e{of_values}, lengths of 1e{of_lengths}: {:.2} %",
                    100.0 * differ
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
