//! Volumes of words, over all of their range and at every number of lanes, look like the same values in floats.

use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::House;

const SIDE: usize = 40;

/// Waves over all 16 bits, and a block of the least beside the greatest values, so that neighbours differ as much as possible.
fn value(i: usize) -> u16 {
    let [x, y, z] = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
    if (12..20).contains(&x) && (12..30).contains(&y) {
        return if (x + y + z) % 8 < 4 { u16::MAX } else { 0 };
    }
    let wave = (0.35 * x as f64).sin() * (0.27 * y as f64).cos() * (0.31 * z as f64).sin();
    (32767.5 + 32767.5 * wave) as u16
}

fn volume(house: &House, name: &str, bytes: Vec<u8>) -> Value {
    let dims = Some(format!("{SIDE},{SIDE},{SIDE}"));
    let query = RawQuery { dims, r#type: Some(name.into()), spacing: None, endian: None };
    json!({"id": house.assets().volumes().insert(bytes, name, query.parse().unwrap()).unwrap().1})
}

/// Views of values from `least` on.
fn views(least: f64) -> Vec<(&'static str, Value)> {
    let at = |part: f64| least + 65535.0 * part;
    let points = json!([{"value": at(0.2), "color": [0.2, 0.4, 1], "opacity_per_unit": 0},
        {"value": at(0.6), "color": [1, 0.6, 0.3], "opacity_per_unit": 0.06}, {"value": at(1.0), "color": [1, 1, 1], "opacity_per_unit": 0.3}]);
    vec![
        ("emission_absorption", json!({"transfer_function": {"points": points}, "jitter": false})),
        ("emission_absorption", json!({"transfer_function": {"points": points}, "jitter": false, "shading": true})),
        ("projection", json!({"mode": "maximum", "exact": false})),
        ("isosurface", json!({"isovalue": at(0.55)})),
    ]
}

#[test]
fn words_of_all_their_range_look_as_floats() {
    for house in [House::shared(), House::of_lanes(4), House::of_lanes(1)] {
        let lanes = house.info().lanes;
        let all: Vec<u16> = (0..SIDE.pow(3)).map(value).collect();
        for (name, least) in [("u16", 0), ("i16", -32768)] {
            let floats = all.iter().flat_map(|v| (f32::from(*v) + least as f32).to_le_bytes()).collect();
            let words = all.iter().map(|v| (i32::from(*v) + least) as u16).flat_map(u16::to_le_bytes).collect();
            let (floats, words) = (volume(house, "f32", floats), volume(house, name, words));
            for (technique, own) in views(f64::from(least)) {
                // Pixels are a third of a voxel, so that lanes are near each other.
                let look = |volume: &Value| {
                    let (film, _) = house.film(&json!({"technique": technique, "volume": volume, technique: own,
                        "image": {"width": 120, "height": 100}, "budget": {"samples": 1}}));
                    film.main.mean.clone()
                };
                let (expected, found) = (look(&floats), look(&words));
                let apart = |(a, b): (&f32, &f32)| f64::from((a - b).abs());
                let mean = expected.iter().zip(&found).map(apart).sum::<f64>() / expected.len() as f64;
                // Weights of 15 bits lose 2 of 65535 if neighbours are as far apart as they can be. At an isosurface's edge that decides if a ray
                // meets it at all.
                assert!(mean < 1e-4, "{technique} {own} of {name}, {lanes} lanes: {mean:e} apart on average");
                assert!(expected.iter().any(|v| *v > 0.1), "{technique} {own}: nothing is there");
            }
        }
    }
}
