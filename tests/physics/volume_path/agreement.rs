//! The same picture by other means.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::light::{agree, channel, film, mean, pixel_z, same_picture, scene, spot, total};
use crate::common::with;

fn lights() -> Value {
    json!([{"type": "sun", "direction": [0.4, 0.8, -0.5], "irradiance": 3}, {"type": "sky", "zenith": 0.6, "horizon": 0.2, "up": [0, 1, 0]}])
}

fn medium() -> Value {
    json!({"sigma_t_per_unit": 10, "albedo": 0.9, "phase": {"type": "henyey_greenstein", "g": 0.4}})
}

fn picture(technique: &str, volume: &Value, own: &Value, seed: u64) -> std::sync::Arc<cloudchamber::film::Film> {
    let camera = json!({"eye": [1.6, 1.2, -2.2], "up": [0, 1, 0], "fov_y_deg": 45});
    let mut request = scene(technique, volume, &camera, own, 64, 256);
    request["seed"] = json!(seed);
    film(House::shared(), &request)
}

#[test]
fn every_tracker_makes_the_same_picture() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let base = json!({"medium": medium(), "lights": lights()});
    let reference = picture("volume_path", &smoke, &base, 1);
    for (seed, more) in [
        (2, json!({"tracking": "weighted"})),
        (3, json!({"tracking": "weighted", "majorant": {"scale": 0.7}})),
        (4, json!({"majorant": {"grid": "global"}})),
        (5, json!({"majorant": {"scale": 3}})),
        (6, json!({"roulette_threshold": 0})),
        (7, json!({"tracking": "march", "march_step_voxels": 0.02})),
    ] {
        let other = picture("volume_path", &smoke, &with(&base, &more), seed);
        same_picture(&reference, &other, &more.to_string());
    }
    let nearest = picture("volume_path", &smoke, &with(&base, &json!({"interpolation": "nearest"})), 8);
    let exact = picture("volume_path", &smoke, &with(&base, &json!({"tracking": "exact"})), 9);
    same_picture(&nearest, &exact, "exact");
}

#[test]
fn a_long_march_is_seen_to_differ() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let base = json!({"medium": {"sigma_t_per_unit": 40, "albedo": 0.9}, "lights": lights()});
    let reference = picture("volume_path", &smoke, &base, 1);
    let other = picture("volume_path", &smoke, &with(&base, &json!({"tracking": "march", "march_step_voxels": 4})), 2);
    let z = pixel_z(&reference, &other);
    let square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    assert!(square > 1.5, "a step of 4 voxels goes unseen: mean z² {square}");
}

#[test]
fn one_scattering_is_single_scatter() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    for more in [
        json!({}),
        json!({"lights": [{"type": "point", "position": [0.2, 0.5, -0.3], "intensity": 2}]}),
        json!({"lights": [{"type": "sphere", "position": [0.1, 0.3, -0.9], "radius": 0.3, "radiance": 4}, {"type": "sun", "angular_diameter_deg": 30},
            {"type": "quad", "corner": [-1, 1.2, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "radiance": 2}, {"type": "sky", "radiance": 0.1}]}),
        json!({"medium": {"sigma_t_per_unit": [4, 8, 16], "albedo": [0.9, 0.6, 0.3], "emission": [0.1, 0.2, 0.3]}}),
        json!({"tracking": "exact"}),
    ] {
        let own = with(&json!({"medium": medium(), "lights": lights()}), &more);
        let path = picture("volume_path", &smoke, &with(&own, &json!({"max_scatterings": 1})), 1);
        let single = picture("single_scatter", &smoke, &own, 2);
        // A point light in the smoke makes the path's pixels so noisy that their own error is not known well.
        if more["lights"][0]["type"] == "point" {
            agree(mean(&path), mean(&single), &more.to_string());
        } else {
            same_picture(&path, &single, &more.to_string());
        }
    }
}

#[test]
fn aiming_at_lights_changes_no_mean() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let lights = json!([{"type": "sphere", "position": [0.9, 0.9, -0.9], "radius": 0.5, "radiance": 5},
        {"type": "quad", "corner": [-1, 1.5, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "radiance": 1},
        {"type": "sun", "direction": [0, 1, 1], "angular_diameter_deg": 40}]);
    for g in [0.0, 0.8] {
        let medium = json!({"sigma_t_per_unit": 10, "albedo": 0.9, "phase": {"type": "henyey_greenstein", "g": g}});
        let own = |next_event: bool| json!({"medium": medium, "lights": lights, "next_event": next_event});
        let (on, off) = (picture("volume_path", &smoke, &own(true), 1), picture("volume_path", &smoke, &own(false), 2));
        // Lights are met by chance so seldom that a pixel's error is not known well, but the error of all pixels is.
        let (a, b) = (total(&on), total(&off));
        let z = (a.0 - b.0) / (a.1 + b.1).sqrt();
        assert!(z.abs() <= 3.5, "g {g}: {a:?} and {b:?}, z {z}");
    }
}

#[test]
fn a_box_is_a_grid_of_one_value() {
    // One voxel with another value in the last place makes the volume a grid.
    let grid = House::shared().floats([16, 16, 16], |x, y, z| if x + y + z < -2.8 { 1.0 + 1e-6 } else { 1.0 });
    let own = json!({"medium": {"sigma_t_per_unit": 2, "albedo": 0.9}, "lights": lights()});
    let closed = picture("volume_path", &json!({"builtin": "constant", "resolution": 16}), &own, 1);
    same_picture(&closed, &picture("volume_path", &grid, &own, 2), "delta");
    let exact = with(&own, &json!({"tracking": "exact"}));
    same_picture(&closed, &picture("volume_path", &grid, &exact, 3), "exact");
}

#[test]
fn a_larger_box_of_less_extinction_looks_the_same() {
    let values = |x: f64, y: f64, z: f64| (-2.0 * (x * x + y * y + z * z)).exp();
    let request = |scale: f64, seed: u64| {
        let mut bytes = Vec::new();
        for i in 0..20 * 20 * 20 {
            let [x, y, z] = [i % 20, i / 20 % 20, i / 400].map(|k| (f64::from(k) + 0.5) / 10.0 - 1.0);
            bytes.extend_from_slice(&(values(x, y, z) as f32).to_le_bytes());
        }
        let header = format!(
            "NRRD0004\ntype: float\ndimension: 3\nsizes: 20 20 20\nspacings: {0} {0} {0}\nencoding: raw\nendian: little\n\n",
            0.1 * scale
        );
        let volume = House::shared().file([header.into_bytes(), bytes].concat());
        let own = json!({"medium": {"sigma_t_per_unit": 8.0 / scale, "albedo": 0.9, "emission": 0.2 / scale},
            "lights": [{"type": "sphere", "position": [scale, scale, -scale], "radius": 0.5 * scale, "radiance": 5}]});
        let eye = [1.6 * scale, 1.2 * scale, -2.2 * scale];
        let mut request =
            scene("volume_path", &volume, &json!({"eye": eye, "up": [0, 1, 0], "fov_y_deg": 45}), &own, 64, 128);
        request["seed"] = json!(seed);
        film(House::shared(), &request)
    };
    same_picture(&request(1.0, 1), &request(250.0, 2), "250 times as large");
}

#[test]
fn colours_are_three_grey_renders() {
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let (sigma, albedo) = ([4.0, 10.0, 25.0], [0.99, 0.8, 0.4]);
    let camera = spot([0.5, 0.4, -1.0], 0.5);
    let own = |sigma: Value, albedo: Value, tracking: &str| json!({"medium": {"sigma_t_per_unit": sigma, "albedo": albedo}, "lights": lights(), "tracking": tracking});
    for tracking in ["delta", "weighted", "exact"] {
        let request = scene("volume_path", &smoke, &camera, &own(json!(sigma), json!(albedo), tracking), 32, 512);
        let colour = film(House::shared(), &request);
        for c in 0..3 {
            let mut request =
                scene("volume_path", &smoke, &camera, &own(json!(sigma[c]), json!(albedo[c]), tracking), 32, 512);
            request["seed"] = json!(c + 1);
            let grey = film(House::shared(), &request);
            let difference: Vec<f64> =
                (0..1024).map(|i| f64::from(colour.main.mean[4 * i + c]) - f64::from(grey.main.mean[4 * i])).collect();
            let mean = difference.iter().sum::<f64>() / 1024.0;
            let error = (difference.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / 1023.0 / 1024.0).sqrt();
            println!("{tracking}, colour {c}: {mean:.6} ± {error:.6} of {:.4}", channel(&colour, c).0);
            assert!(mean.abs() <= 3.5 * error, "{tracking}, colour {c}: {mean} ± {error}");
        }
    }
}

#[test]
fn lights_one_at_a_time_and_all_in_turn_have_the_same_mean() {
    // The path chooses one of four lights, and single scattering aims at each. The balance of the two against the phase function differs.
    let smoke = json!({"builtin": "smoke", "resolution": 48});
    let lights = json!([{"type": "sphere", "position": [0.1, 0.3, -0.9], "radius": 0.3, "radiance": 4}, {"type": "sun", "angular_diameter_deg": 30},
        {"type": "quad", "corner": [-1, 1.2, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "radiance": 2}, {"type": "sky", "radiance": 0.1}]);
    let own = json!({"medium": medium(), "lights": lights});
    let sum = |technique: &str, own: &Value, first: u64| {
        (first..first + 5)
            .map(|seed| total(&picture(technique, &smoke, own, seed)))
            .fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
    };
    let single = sum("single_scatter", &own, 100);
    for next_event in [true, false] {
        let path = sum("volume_path", &with(&own, &json!({"max_scatterings": 1, "next_event": next_event})), 0);
        let z = (path.0 - single.0) / (path.1 + single.1).sqrt();
        println!("next event {next_event}: {} and {}, z {z:.2}", path.0, single.0);
        assert!(z.abs() <= 3.5, "next event {next_event}: {path:?}, {single:?}");
    }
}
