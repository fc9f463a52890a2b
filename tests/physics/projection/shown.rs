//! Window, level and colour maps; refused requests; the manual's example.

use cloudchamber::error::Error;
use cloudchamber::technique::projection;
use serde_json::{Value, json};

use crate::common::engine::House;

/// A ramp in x seen along z: columns of rising value.
fn columns(parameters: &Value) -> Vec<[f32; 3]> {
    let house = House::shared();
    let volume = house.floats([64, 4, 4], |x, _, _| 100.0 * x);
    let (film, _) = house.film(&json!({
        "technique": "projection", "volume": volume, "image": {"width": 64, "height": 2}, "budget": {"samples": 1},
        "camera": {"eye": [0, 0, 3], "up": [0, 1, 0], "fov_y_deg": 1.2, "projection": "orthographic"}, "projection": parameters
    }));
    film.main.mean.chunks_exact(4).take(64).map(|p| [p[0], p[1], p[2]]).collect()
}

#[test]
fn grey_rises_with_the_value() {
    for mode in ["maximum", "minimum", "mean"] {
        let ramp = columns(&json!({"mode": mode, "window": {"level": 0, "width": 120}}));
        let greys: Vec<f32> = ramp.iter().map(|c| c[0]).collect();
        assert!(greys.windows(2).all(|p| p[1] >= p[0] && p[1] <= 1.0), "{mode}: {greys:?}");
        assert!(greys[20] < greys[32] && greys[32] < greys[44], "{mode}: {greys:?}");
        let turned = columns(&json!({"mode": mode, "window": {"level": 0, "width": 120}, "invert": true}));
        assert!((turned[32][0] - greys[31]).abs() < 0.02, "{mode}");
    }
}

#[test]
fn below_is_the_first_colour_and_above_the_last() {
    let maps = ["grey", "viridis", "magma", "inferno", "plasma", "cividis", "turbo", "hot", "bone", "coolwarm"];
    for map in maps {
        let of = |low: f64, high: f64| columns(&json!({"window": {"low": low, "high": high}, "color_map": map}));
        let (all_low, all_high, both) = (of(900.0, 901.0), of(-901.0, -900.0), of(-1e-3, 1e-3));
        assert!(all_low.iter().all(|c| *c == all_low[0]) && all_high.iter().all(|c| *c == all_high[0]), "{map}");
        assert_ne!(all_low[0], all_high[0], "{map}");
        assert_eq!((both[3], both[60]), (all_low[0], all_high[0]), "{map}");
    }
}

#[test]
fn level_and_width_are_the_same_as_low_and_high() {
    let of = |window: Value| columns(&json!({"window": window, "color_map": "magma"}));
    assert_eq!(of(json!({"level": 10, "width": 40})), of(json!({"low": -10, "high": 30})));
}

#[test]
fn what_makes_no_sense_is_refused_by_its_name() {
    let house = House::shared();
    for (parameters, pointer) in [
        (json!({"window": {"level": 1, "width": 0}}), "/projection/window/width"),
        (json!({"window": {"level": 1, "width": -5}}), "/projection/window/width"),
        (json!({"window": {"low": 3, "high": 3}}), "/projection/window/high"),
        (json!({"window": {"low": 3}}), "/projection/window"),
        (json!({"color_map": "rainbow"}), "/projection/color_map"),
        (json!({"mode": "median"}), "/projection/mode"),
        (json!({"interpolation": "b_spline", "exact": true}), "/projection/exact"),
        (json!({"sigma_per_value": 0}), "/projection/sigma_per_value"),
        (json!({"step_voxels": 0}), "/projection/step_voxels"),
        (json!({"thickness": 1}), "/projection/thickness"),
    ] {
        let body = json!({"technique": "projection", "volume": {"builtin": "sphere", "resolution": 8}, "projection": parameters});
        match house.scene(&body) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].pointer, pointer, "{body}"),
            other => panic!("{body}: {:?}", other.err()),
        }
    }
}

#[test]
fn the_example_and_every_default_show_something() {
    let house = House::shared();
    let lit = |request: &Value| {
        let (_, error) = house.film(request);
        assert!(error.total.unwrap().is_finite());
        let bytes = house.picture(request);
        let bright = bytes.iter().filter(|b| **b > 100).count() as f64 / bytes.len() as f64;
        let dark = bytes.iter().filter(|b| **b < 90).count() as f64 / bytes.len() as f64;
        assert!(bright > 0.01 && dark > 0.05, "{request}: {bright} bright, {dark} dark");
    };
    lit(&projection::example());
    for volume in [json!({"builtin": "shepp_logan", "resolution": 64}), house.file(crate::common::mri_head())] {
        for mode in ["maximum", "mean", "sum", "xray"] {
            lit(&json!({"technique": "projection", "volume": volume, "image": {"width": 96, "height": 96},
                "budget": {"samples": 1}, "projection": {"mode": mode}}));
        }
    }
}

#[test]
fn a_greatest_value_is_shown_from_words_and_written_from_floats() {
    let house = House::shared();
    let volume = house.floats([31, 33, 35], |x, y, z| (7.0 * x).sin() + (3.0 * y * z).cos());
    let of = |own: Value| {
        let job = house.finish(&json!({
            "technique": "projection", "volume": volume, "image": {"width": 90, "height": 80}, "budget": {"samples": 1}, "projection": own
        }));
        (job.resource()["plan"]["reasons"].to_string().contains("words of 16 bits"), house.film_of(&job))
    };
    let [(words, shown), (no_words, values)] = [of(json!({})), of(json!({"output": "value"}))];
    assert!(words && !no_words);
    // Grey is the value's part of the range in sRGB. The film has linear light.
    let [low, high] = house.assets().volumes().get(volume["id"].as_str().unwrap()).unwrap().range();
    let pixels = shown.main.mean.chunks_exact(4).zip(values.main.mean.chunks_exact(4));
    for (grey, value) in pixels.filter(|(grey, _)| grey[3] == 1.0) {
        let part = (f64::from(value[0]) - low) / (high - low);
        let linear = if part > 0.04045 { ((part + 0.055) / 1.055).powf(2.4) } else { part / 12.92 };
        assert!((f64::from(grey[0]) - linear).abs() < 5e-4, "{grey:?} for {part}");
    }
}
