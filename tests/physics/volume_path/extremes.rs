//! The limits of the methods, and the pictures of right ones.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::light::{agree, film, mean, scene, spot};

fn finite(film: &cloudchamber::film::Film) {
    assert!(film.main.mean.iter().chain(&film.main.m2).all(|v| v.is_finite()));
}

fn sky() -> Value {
    json!([{"type": "sky", "radiance": 1}])
}

#[test]
fn an_outlier_voxel_changes_no_mean() {
    let volume = House::shared().floats([24, 24, 24], |x, y, z| {
        let r2 = x * x + y * y + z * z;
        if r2 < 0.004 { 500.0 } else { (-3.0 * r2).exp() }
    });
    let run = |tracking: &str, grid: &str, seed: u64| {
        let own = json!({"medium": {"sigma_t_per_unit": 4, "albedo": 0.8}, "lights": sky(), "tracking": tracking,
            "interpolation": "nearest", "majorant": {"grid": grid}});
        let mut request = scene("volume_path", &volume, &spot([0.3, 0.2, 1.0], 1.0), &own, 32, 256);
        request["seed"] = json!(seed);
        mean(&film(House::shared(), &request))
    };
    let exact = run("exact", "local", 1);
    agree(run("delta", "local", 2), exact, "local majorants");
    agree(run("delta", "global", 3), exact, "one majorant");
    agree(run("weighted", "local", 4), exact, "weighted");
}

#[test]
fn thick_media_are_finite_and_not_black() {
    for (albedo, sigma) in [(1.0, 100.0), (0.999, 100.0), (0.5, 1e6), (0.0, 1e9), (1.0, 1e-9)] {
        for volume in [json!({"builtin": "constant", "resolution": 16}), json!({"builtin": "sphere", "resolution": 24})]
        {
            let own = json!({"medium": {"sigma_t_per_unit": sigma, "albedo": albedo}, "lights": sky()});
            let film =
                film(House::shared(), &scene("volume_path", &volume, &json!({"eye": [1.0, 2.0, 3.0]}), &own, 8, 16));
            finite(&film);
            let (m, _) = mean(&film);
            assert!(m > 0.0 && m < 1.0 + 1e-4, "{volume} {own}: {m}");
            if albedo == 1.0 {
                assert!((m - 1.0).abs() < 1e-4, "{volume} {own}: {m}");
            }
        }
    }
}

#[test]
fn the_camera_may_stand_in_the_medium_and_lights_too() {
    let own = json!({"medium": {"sigma_t_per_unit": 1.5, "albedo": 0.9}, "lights": [
        {"type": "point", "position": [0.1, 0.2, 0.3]}, {"type": "sphere", "position": [-0.4, 0, 0.2], "radius": 0.1, "radiance": 3}]});
    for technique in ["volume_path", "single_scatter"] {
        for eye in [[0.0, 0.0, -0.5], [0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [1e6, 0.0, 0.0]] {
            let camera = json!({"eye": eye, "target": [0.2, 0.1, 0.9], "fov_y_deg": 70});
            let film = film(
                House::shared(),
                &scene(technique, &json!({"builtin": "smoke", "resolution": 32}), &camera, &own, 24, 32),
            );
            finite(&film);
        }
    }
    // The ray goes along an axis, on a face.
    let camera = json!({"eye": [0, 1, -3], "target": [0, 1, 0], "up": [0, 0, 1]});
    let camera =
        json!({"eye": camera["eye"], "target": camera["target"], "up": [0, 1, 0], "projection": "orthographic"});
    let own = json!({"medium": {"sigma_t_per_unit": 1.5, "albedo": 1}, "lights": sky()});
    let film = film(
        House::shared(),
        &scene("volume_path", &json!({"builtin": "smoke", "resolution": 32}), &camera, &own, 32, 16),
    );
    assert!(film.main.mean.chunks_exact(4).all(|p| (p[0] - 1.0).abs() < 1e-5));
}

#[test]
fn a_light_behind_an_opaque_shell_is_not_seen() {
    let shell = House::shared().floats([32, 32, 32], |x, y, z| {
        let r = (x * x + y * y + z * z).sqrt();
        if (0.5..0.8).contains(&r) { 1000.0 } else { 0.0 }
    });
    for technique in ["volume_path", "single_scatter"] {
        let own = json!({"medium": {"sigma_t_per_unit": 1, "albedo": 0.5}, "lights": [
            {"type": "sphere", "position": [0, 0, 0], "radius": 0.2, "radiance": 100}, {"type": "point", "position": [0, 0, 0]}]});
        let film = film(House::shared(), &scene(technique, &shell, &json!({"eye": [2.0, 1.0, 3.0]}), &own, 32, 16));
        finite(&film);
        assert!(film.main.mean.chunks_exact(4).all(|p| p[0] < 1e-6), "{technique}: light through 300 mean free paths");
    }
}

#[test]
fn nothing_and_what_is_not_a_number_are_empty() {
    let nothing = House::shared().floats([8, 8, 8], |_, _, _| 0.0);
    let broken = House::shared().floats([8, 8, 8], |x, _, _| if x < 0.0 { f64::NAN } else { 0.0 });
    let negative = House::shared().floats([8, 8, 8], |x, _, _| if x < 0.0 { -5.0 } else { 0.0 });
    for technique in ["volume_path", "single_scatter"] {
        for (volume, code) in
            [(&nothing, None), (&broken, Some("non_finite_voxels")), (&negative, Some("negative_density"))]
        {
            let own = json!({"medium": {"sigma_t_per_unit": 5}, "lights": sky()});
            let request = scene(technique, volume, &json!({"eye": [2.0, 1.0, 3.0]}), &own, 16, 16);
            let resource = House::shared().finish(&request).resource();
            let warned =
                resource["warnings"].as_array().is_some_and(|w| w.iter().any(|w| w["code"] == *code.unwrap_or("")));
            assert_eq!(warned, code.is_some(), "{technique}: {}", resource["warnings"]);
            let film = film(House::shared(), &request);
            assert!(film.main.mean.chunks_exact(4).all(|p| (p[0] - 1.0).abs() < 1e-6), "{technique} {volume}");
        }
    }
}

#[test]
fn a_broken_majorant_is_biased_and_said_to_be() {
    let volume = json!({"builtin": "gaussian", "resolution": 32});
    let run = |scale: f64| {
        let own =
            json!({"medium": {"sigma_t_per_unit": 4, "albedo": 0}, "lights": sky(), "majorant": {"scale": scale}});
        let request = scene("volume_path", &volume, &spot([0.0, 0.0, 1.0], 0.01), &own, 32, 64);
        let job = House::shared().finish(&request);
        let codes = job.resource()["warnings"].to_string();
        (
            mean(&House::shared().film_of(&job)),
            codes.contains("broken_majorant"),
            job.resource()["counts"]["broken_majorants"].as_u64().unwrap(),
        )
    };
    let ((right, error), flagged, counted) = run(1.0);
    assert!(!flagged && counted == 0, "{counted}");
    let ((wrong, _), flagged, counted) = run(0.25);
    assert!(flagged && counted > 0, "{counted}");
    assert!(wrong - right > 20.0 * error, "{wrong} {right}");
}

#[test]
fn beside_voxels_that_are_not_a_number_the_rest_is_as_it_is() {
    // The half x > 0 has density 1, and the other half is empty or NaN. With the nearest voxels, both give the same.
    let half = |other: f64| House::shared().floats([16, 16, 16], move |x, _, _| if x < 0.0 { other } else { 1.0 });
    let sun = json!([{"type": "sun", "direction": [0.3, 1, 0.2]}, {"type": "sky", "radiance": 0.1, "up": [0, 1, 0]}]);
    for technique in ["volume_path", "single_scatter"] {
        for tracking in ["delta", "weighted", "exact", "march"] {
            let run = |other: f64, seed: u64| {
                let own = json!({"medium": {"sigma_t_per_unit": 3}, "lights": sun, "tracking": tracking, "interpolation": "nearest"});
                let camera = json!({"eye": [3.0, 0.5, 1.0], "up": [0, 1, 0], "fov_y_deg": 30});
                // With 48² pixels the mean of z² has a deviation of 0.03, so 1.15 is not reached by chance.
                let mut request = scene(technique, &half(other), &camera, &own, 48, 64);
                request["seed"] = json!(seed);
                let job = House::shared().finish(&request);
                assert_eq!(job.resource()["counts"]["broken_majorants"], 0, "{technique} {tracking}");
                let film = House::shared().film_of(&job);
                finite(&film);
                film
            };
            crate::common::light::same_picture(&run(f64::NAN, 1), &run(0.0, 2), &format!("{technique}, {tracking}"));
        }
    }
}

#[test]
fn a_lamp_that_sticks_out_of_the_volume_is_seen() {
    let lights = json!([{"type": "sphere", "position": [0, 0, 1], "radius": 0.3, "radiance": 4}]);
    let own = json!({"medium": {"sigma_t_per_unit": 1e-6}, "lights": lights});
    for technique in ["volume_path", "single_scatter"] {
        let request = scene(
            technique,
            &json!({"builtin": "constant", "resolution": 8}),
            &spot([0.0, 0.0, 1.0], 0.1),
            &own,
            8,
            16,
        );
        let (m, _) = mean(&film(House::shared(), &request));
        assert!((m - 4.0).abs() < 1e-3, "{technique}: {m}");
    }
}
