//! Floats that are taken as words: the picture must be that of the floats, which the reference form reads unchanged.

use cloudchamber::job::Job;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::with;

fn request(volume: &Value, own: &Value) -> Value {
    json!({"technique": "emission_absorption", "volume": volume, "image": {"width": 160, "height": 120}, "budget": {"samples": 2},
           "seed": 5, "emission_absorption": own})
}

/// The plan's reason about words.
fn said(job: &Job) -> Option<String> {
    let resource = job.resource();
    let reasons = resource["plan"]["reasons"].as_array().unwrap();
    reasons.iter().filter_map(Value::as_str).find(|r| r.contains("words of 16 bits")).map(str::to_owned)
}

fn ramp(low: f64, high: f64) -> Value {
    json!({"opacity_threshold": 1, "transfer_function": {"points": [
        {"value": low, "color": [0.1, 0.2, 0.9], "opacity_per_unit": 0}, {"value": high, "color": [1, 0.8, 0.3], "opacity_per_unit": 12}]}})
}

#[test]
fn the_picture_is_that_of_the_floats() {
    let house = House::shared();
    let wave = house.floats([40, 37, 43], |x, y, z| 1.0 + (5.0 * x).sin() * (4.0 * y).cos() + z);
    // The opaque part has ripples of a thousandth of the range, and a core holds the range.
    let ripples = house.floats([48; 3], |x, y, z| {
        let r = (x * x + y * y + z * z).sqrt();
        let body = (6.0 * (0.9 - r)).clamp(0.0, 0.5);
        body + if r < 0.8 { 1e-3 * ((9.0 * x).sin() + (11.0 * y).sin() + (10.0 * z).sin()) } else { 0.0 }
            + if r < 0.1 { 0.5 } else { 0.0 }
    });
    for (volume, own) in [(&wave, ramp(-0.5, 2.5)), (&ripples, ramp(0.2, 1.0))] {
        for lit in [false, true] {
            let own = with(&own, &json!({"shading": lit}));
            let words = house.finish(&request(volume, &own));
            let exact = house.finish(&request(volume, &with(&own, &json!({"order": "back_to_front"}))));
            assert!(said(&words).is_some() && said(&exact).is_none());
            let [a, b] = [&words, &exact].map(|job| house.film_of(job));
            let apart = a.main.mean.iter().zip(&b.main.mean).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 1.0 / 255.0, "lit {lit}: {apart:e}");
            let means =
                [&a, &b].map(|f| f.main.mean.iter().map(|v| f64::from(*v)).sum::<f64>() / f.main.mean.len() as f64);
            assert!((means[0] / means[1] - 1.0).abs() < 1e-4, "lit {lit}: {means:?}");
        }
    }
}

#[test]
fn a_narrow_function_takes_the_floats_and_a_wide_one_says_how_far_off_it_is() {
    let house = House::shared();
    let volume = house.floats([24; 3], |x, y, z| x + y + z);
    // The voxels reach from -2.875 to 2.875.
    let said_of = |low: f64, high: f64| said(&house.finish(&request(&volume, &ramp(low, high))));
    assert_eq!(said_of(0.0, 0.71), None);
    let words = said_of(0.0, 0.73).unwrap();
    assert!(words.contains(&format!("{:.1e}", 5.75 / 131_070.0)), "{words}");
    let plain = with(&ramp(-2.0, 2.0), &json!({"interpolation": "b_spline"}));
    assert_eq!(said(&house.finish(&request(&volume, &plain))), None, "only what words make faster");
}
