//! Transfer functions of any control points: thin peaks, steps, points far outside, and labels of any size.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::with;

/// The depth of the box, world units.
const DEPTH: f64 = 8.0;

fn words(voxels: impl Iterator<Item = u32>, kind: &str) -> Value {
    let bytes: Vec<u8> = if kind == "u32" {
        voxels.flat_map(u32::to_le_bytes).collect()
    } else {
        voxels.flat_map(|v| (v as u16).to_le_bytes()).collect()
    };
    let query = cloudchamber::volume::RawQuery {
        dims: Some("32,32,8".into()),
        r#type: Some(kind.into()),
        spacing: Some("1,1,1".into()),
        endian: None,
    };
    let (_, id, _) = House::shared().assets().volumes().insert(bytes, "test", query.parse().unwrap()).unwrap();
    json!({"id": id})
}

/// The mean opacity of the left and of the right half, away from their edges, looked at along the box's least side.
fn halves(volume: &Value, own: &Value) -> [f64; 2] {
    let (film, _) = House::shared().film(&json!({
        "technique": "emission_absorption", "volume": volume, "image": {"width": 32, "height": 32}, "budget": {"samples": 4},
        "camera": {"eye": [0, 0, 60], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 30},
        "emission_absorption": with(own, &json!({"opacity_threshold": 1}))
    }));
    [8..14, 18..24].map(|columns: std::ops::Range<usize>| {
        let places = (12..20).flat_map(|y| columns.clone().map(move |x| 4 * (32 * y + x) + 3));
        let values: Vec<f64> = places.map(|i| f64::from(film.main.mean[i])).collect();
        values.iter().sum::<f64>() / values.len() as f64
    })
}

fn points(of: &[(f64, f64)]) -> Value {
    json!(of.iter().map(|(v, o)| json!({"value": v, "color": [1, 1, 1], "opacity_per_unit": o})).collect::<Vec<_>>())
}

#[test]
fn a_function_is_what_its_points_say_however_thin_they_are() {
    // One voxel holds the whole range of 16 bits.
    let volume = words(
        (0..32 * 32 * 8).map(|i| {
            if i == 0 {
                65_535
            } else if i % 32 < 16 {
                30_004
            } else {
                30_100
            }
        }),
        "u16",
    );
    let peak = [(30_003.0, 0.0), (30_004.0, 0.5), (30_005.0, 0.0)];
    let comb: Vec<(f64, f64)> =
        (0..256).map(|i| (29_949.0 + f64::from(i), if i == 55 || i % 50 == 1 { 0.4 } else { 0.0 })).collect();
    let cases = [
        ("peak", [&[(0.0, 0.0)][..], &peak, &[(65_535.0, 0.0)]].concat(), [0.5, 0.0]),
        ("far", [&[(-1e9, 0.0)][..], &peak, &[(1e12, 0.0)]].concat(), [0.5, 0.0]),
        ("alone", peak.to_vec(), [0.5, 0.0]),
        ("step", vec![(0.0, 0.0), (30_050.0, 0.0), (30_050.0, 0.5), (65_535.0, 0.5)], [0.0, 0.5]),
        ("step at a value", vec![(0.0, 0.3), (30_100.0, 0.3), (30_100.0, 0.1), (65_535.0, 0.1)], [0.3, 0.1]),
        ("nothing but a step", vec![(30_050.0, 0.2), (30_050.0, 0.6)], [0.2, 0.6]),
        ("comb", comb, [0.4, 0.4]),
    ];
    let ways = [
        json!({}),
        json!({"shading": true}),
        json!({"order": "back_to_front"}),
        json!({"interpolation": "nearest"}),
        json!({"interpolation": "b_spline"}),
        json!({"interpolation": "catmull_rom"}),
        json!({"pre_integrated": true}),
        json!({"silhouette": {}}),
    ];
    for (name, of, sigma) in &cases {
        let due = sigma.map(|sigma: f64| -(-sigma * DEPTH).exp_m1());
        for way in &ways {
            let found = halves(&volume, &with(way, &json!({"transfer_function": {"points": points(of)}})));
            // Splines are rounded to either side of a step at a value.
            if *name == "step at a value" && way["interpolation"] == "catmull_rom" {
                continue;
            }
            // A silhouette multiplies the opacity; only what is empty is known.
            let known = |i: usize| way.get("silhouette").is_none() || due[i] == 0.0;
            for i in [0, 1] {
                assert!(!known(i) || (found[i] - due[i]).abs() < 0.006, "{name}, {way}: {found:?} for {due:?}");
            }
        }
    }
}

#[test]
fn labels_of_any_size_have_looks_of_their_own() {
    let ids = [0, 997, 4096, 312_782_592];
    for right in &ids[1..] {
        let volume = words((0..32 * 32 * 8).map(|i| if i % 32 < 16 { 70_000 } else { *right }), "u32");
        let listed =
            json!({"labels": [{"label": right, "opacity_per_unit": 0.3}, {"label": 5, "opacity_per_unit": 9}]});
        let found = halves(&volume, &json!({"transfer_function": listed}));
        assert!(found[0] == 0.0 && (found[1] + (-0.3 * DEPTH).exp_m1()).abs() < 1e-3, "{right}: {found:?}");
        let found = halves(&volume, &json!({"transfer_function": {"preset": "labels"}}));
        assert!(found.iter().all(|alpha| *alpha > 0.5), "{right}: {found:?}");
    }
}

#[test]
fn default_looks_suit_what_a_volume_holds() {
    let house = House::shared();
    let wave = |x: f64, y: f64, z: f64| (1.0 - 1.3 * (x * x + y * y + z * z)).max(0.0);
    let signed = house.floats([40; 3], |x, y, z| 12.0 * wave(x, y, z) - 7.0 * wave(x + 0.5, y, z));
    let hot =
        house.floats([40; 3], |x, y, z| if x < -0.96 && y < -0.96 && z < -0.96 { 1e6 } else { 1000.0 * wave(x, y, z) });
    let no_data = house.floats([40; 3], |x, y, z| if x * x + y * y > 0.9 { 1e20 } else { 1000.0 * wave(x, y, z) });
    let request = |technique: &str, volume: &Value| {
        json!({"technique": technique, "volume": volume, "image": {"width": 64, "height": 64, "transparent": true}, "budget": {"samples": 4},
            "camera": {"eye": [0, 0, 60], "up": [0, 1, 0], "projection": "orthographic", "fov_y_deg": 2.2}})
    };
    let looked_at = |technique: &str, volume: &Value| {
        let job = house.finish(&request(technique, volume));
        let reasons = job.resource()["plan"]["reasons"].to_string();
        let film = house.film_of(&job);
        let at = |x: usize, y: usize| -> [f32; 4] { std::array::from_fn(|c| film.main.mean[4 * (64 * y + x) + c]) };
        (at(32, 32), at(7, 7), reasons)
    };
    // What is empty is not an opaque box, and the two signs differ.
    let (middle, corner, reasons) = looked_at("emission_absorption", &signed);
    assert!(corner[3] < 0.1 && middle[3] > 0.5 && middle[0] > 2.0 * middle[2], "{middle:?}, {corner:?}, {reasons}");
    assert!(reasons.contains("below and above 0"), "{reasons}");
    for technique in ["slice", "projection", "emission_absorption", "isosurface"] {
        let (middle, _, reasons) = looked_at(technique, &hot);
        assert!(middle[1] > 0.05, "{technique}: {middle:?}");
        assert!(reasons.contains("beyond its window"), "{technique}: {reasons}");
    }
    let (middle, corner, reasons) = looked_at("emission_absorption", &no_data);
    assert!(corner[3] == 0.0 && middle[3] > 0.3, "{middle:?}, {corner:?}, {reasons}");
    assert!(reasons.contains("no data"), "{reasons}");
    let (middle, ..) = looked_at("slice", &no_data);
    assert!(middle[1] > 0.5, "{middle:?}");
}
