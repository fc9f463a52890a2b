//! Interfaces and faces: Fresnel's formulae, total internal reflection, mirrors, time gates, sources.

use serde_json::{Value, json};

use super::run::{fraction, judge, simulate, with};
use super::trackers::LEDGER;
use crate::common::engine::House;

/// The reflectance of unpolarised light, in double precision.
fn fresnel(n1: f64, n2: f64, cosine: f64) -> f64 {
    let sine = n1 / n2 * (1.0 - cosine * cosine).sqrt();
    if sine >= 1.0 {
        return 1.0;
    }
    let out = (1.0 - sine * sine).sqrt();
    let s = (n1 * cosine - n2 * out) / (n1 * cosine + n2 * out);
    let p = (n2 * cosine - n1 * out) / (n2 * cosine + n1 * out);
    0.5 * (s * s + p * p)
}

/// A pane of glass that does nothing but reflect and refract.
fn pane(index: f64, angle_deg: f64) -> Value {
    let angle = angle_deg.to_radians();
    json!({"photons": 20_000, "grid": [1, 1, 1], "layers": [{"thickness_mm": 1, "mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": index}],
        "source": {"type": "pencil", "direction": [angle.sin(), 0, angle.cos()]}, "boundary": {"fresnel": true}})
}

#[test]
fn a_pane_reflects_and_transmits_what_fresnel_says() {
    for (index, angle) in
        [(1.5, 0.0f64), (1.5, 40.0), (1.5, 56.31), (1.5, 80.0), (1.5, 89.5), (1.33, 89.0), (3.0, 30.0), (1.0001, 60.0)]
    {
        let r = fresnel(1.0, index, angle.to_radians().cos());
        judge(&format!("{index} at {angle}: back"), &pane(index, angle), 2.0 * r / (1.0 + r), 1e-5, |l| {
            fraction(l, "specular").0 + fraction(l, "exit_minus_z").0
        });
        let (specular, _) = fraction(&simulate(&pane(index, angle)), "specular");
        assert!((specular - r).abs() < 2e-5, "{index} at {angle}: specular {specular} for {r}");
    }
    // A boundary without a change of index reflects nothing, however flat the ray is.
    let flat = simulate(&pane(1.0, 89.999));
    assert!((fraction(&flat, "exit_plus_z").0 - 1.0).abs() < 1e-6, "{flat}");
}

#[test]
fn light_that_goes_through_comes_out_at_snells_angle() {
    let layers = json!([{"thickness_mm": 1, "mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": 1.2}, {"thickness_mm": 1, "mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": 1.7}]);
    let angle = 50f64.to_radians();
    let bins = json!({"radius_edges_mm": [0, 1.3, 1.4, 100], "angle_edges_deg": [0, 49.9, 50.1, 90]});
    let scene = json!({"photons": 1000, "grid": [1, 1, 1], "layers": layers, "exit_histogram": bins, "boundary": {"fresnel": true, "specular_entry": false},
        "source": {"direction": [0, angle.sin(), angle.cos()]}});
    let h = &simulate(&scene)["exit_histogram"]["plus_z"];
    // Each layer moves the ray aside by the tangent of its angle there.
    let aside: f64 = [1.2, 1.7].iter().map(|n| (angle.sin() / n).asin().tan()).sum();
    assert!((1.3..1.4).contains(&aside), "{aside}");
    let there = h[1][1]["value"].as_f64().unwrap();
    let straight: f64 = [(1.0, 1.2), (1.2, 1.7), (1.7, 1.0)][1..]
        .iter()
        .map(|&(a, b)| 1.0 - fresnel(a, b, (1.0 - (angle.sin() / a).powi(2)).sqrt()))
        .product();
    assert!((there - straight).abs() < 0.05, "{there} for {straight}: {h}");
}

#[test]
fn no_light_leaves_past_the_critical_angle() {
    let dense = json!({"thickness_mm": 1, "mu_a_per_mm": 0.01, "mu_s_per_mm": 0, "index": 1.5});
    let thin = json!({"thickness_mm": 1, "mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": 1});
    for degrees in [42.0, 60.0, 89.9f64] {
        let angle = degrees.to_radians();
        // The ray starts within the dense layer, whose critical angle is 41.8 degrees, and goes up and down until it is absorbed.
        let scene = json!({"photons": 5000, "grid": [1, 1, 1], "layers": [thin, dense, thin], "boundary": {"fresnel": true},
            "source": {"position_mm": [30, 30, 1.5], "direction": [angle.sin(), 0, angle.cos()]}});
        let result = simulate(&scene);
        assert!((fraction(&result, "absorbed").0 - 1.0).abs() < 1e-6, "{degrees}: {result}");
    }
}

#[test]
fn mirrors_and_cyclic_faces_stand_for_a_medium_without_end() {
    let medium =
        json!({"mu_a_per_mm": 0.3, "mu_s_per_mm": 3, "index": 1.4, "phase": {"type": "henyey_greenstein", "g": 0.6}});
    let endless = json!({"photons": 60_000, "grid": [2, 2, 2], "layers": [with(&medium, &json!({"thickness_mm": 1}))], "boundary": {"fresnel": true}});
    let (truth, error) = super::run::over_seeds(&endless, |r| fraction(r, "exit_minus_z").0);
    for kind in ["mirror", "cyclic"] {
        let sides =
            json!({"boundary": {"x": kind, "y": kind, "fresnel": true}, "medium": medium, "size_mm": [0.4, 0.7, 1]});
        let mut scene = with(&endless, &sides);
        scene.as_object_mut().unwrap().remove("layers");
        judge(kind, &scene, truth, error, |r| fraction(r, "exit_minus_z").0);
    }
}

#[test]
fn a_gate_ends_photons_to_the_millimetre() {
    // 1 ns in index 1.5 is 199.86 mm. Without collisions, a photon flies all of it.
    let layers = json!([{"thickness_mm": 1000, "mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": 1.5}]);
    let result = simulate(&json!({"photons": 1000, "grid": [1, 1, 1], "layers": layers, "time_gate_ns": 1}));
    assert!((fraction(&result, "gated").0 - 1.0).abs() < 1e-9, "{result}");
    let path = result["mean_path_mm"].as_f64().unwrap();
    assert!((path - 299.792458 / 1.5).abs() < 0.01, "{path}");
}

#[test]
fn each_source_lights_what_it_should() {
    // In a vacuum the light of a source arrives at the face that it is aimed at.
    let scene = |source: Value| {
        json!({"photons": 200_000, "size_mm": [2, 2, 2], "grid": [1, 1, 1], "source": source,
        "medium": {"mu_a_per_mm": 0, "mu_s_per_mm": 0, "index": 1}, "exit_histogram": {"radius_edges_mm": [0, 0.25, 0.5, 1, 3], "angle_edges_deg": [0, 10, 20, 40, 90]}})
    };
    let ring = |source: Value, i: usize| {
        let h = simulate(&scene(source))["exit_histogram"]["plus_z"][i].clone();
        h.as_array().unwrap().iter().map(|b| b["value"].as_f64().unwrap()).sum::<f64>()
    };
    assert!((ring(json!({"type": "pencil"}), 0) - 1.0).abs() < 1e-9);
    let disk = json!({"type": "disk", "radius_mm": 0.5});
    assert!((ring(disk.clone(), 0) - 0.25).abs() < 0.005 && (ring(disk, 1) - 0.75).abs() < 0.005);
    let planar = json!({"type": "planar", "position_mm": [0, 0, -1], "edge_u_mm": [1, 0, 0], "edge_v_mm": [0, 2, 0]});
    // A circle of radius 1/2 about the corner of the source covers a quarter of pi / 4 of its two square millimetres.
    assert!((ring(planar.clone(), 0) + ring(planar, 1) - std::f64::consts::PI / 16.0 / 2.0).abs() < 0.005);
    // A cone of 20 degrees is even over the sphere. A Lambertian source is even over sin².
    let angles = |source: Value, i: usize| {
        let h = simulate(&scene(source))["exit_histogram"]["plus_z"].clone();
        (0..4).map(|r| h[r][i]["value"].as_f64().unwrap()).sum::<f64>()
    };
    let cone = angles(json!({"type": "cone", "half_angle_deg": 20}), 0);
    let truth = (1.0 - 10f64.to_radians().cos()) / (1.0 - 20f64.to_radians().cos());
    assert!((cone - truth).abs() < 0.005, "{cone} for {truth}");
    let diffuse = angles(json!({"type": "diffuse"}), 1);
    let truth = 20f64.to_radians().sin().powi(2) - 10f64.to_radians().sin().powi(2);
    assert!((diffuse - truth).abs() < 0.004, "{diffuse} for {truth}");
    let isotropic = simulate(&scene(json!({"type": "isotropic", "position_mm": [1, 1, 1]})));
    for name in &LEDGER[..6] {
        assert!((fraction(&isotropic, name).0 - 1.0 / 6.0).abs() < 0.005, "{name}: {isotropic}");
    }
}

#[test]
fn a_beam_that_misses_is_refused_and_one_that_half_misses_is_counted() {
    let house = House::shared();
    let medium = json!({"mu_a_per_mm": 1, "mu_s_per_mm": 0, "index": 1});
    let scene = |source: Value| {
        super::run::request(
            &json!({"photons": 50_000, "size_mm": [2, 2, 2], "grid": [1, 1, 1], "medium": medium, "source": source}),
        )
    };
    for source in [
        json!({"position_mm": [3, 1, 0]}),
        json!({"position_mm": [1, 1, -5], "direction": [0, 0, -1]}),
        json!({"position_mm": [1, 1, -5], "direction": [1, 0, 0.1]}),
        json!({"position_mm": [1, 1, 2], "direction": [0, 0, 1]}),
        json!({"type": "disk", "radius_mm": 1, "position_mm": [5, 1, -1]}),
    ] {
        let refused = house.scene(&scene(source.clone())).err();
        let said = refused.map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains("misses the box"), "{source}: {said}");
    }
    let half = json!({"type": "planar", "position_mm": [-2, 0, -1], "edge_u_mm": [4, 0, 0], "edge_v_mm": [0, 2, 0]});
    let result = house.finish(&scene(half)).resource()["result"].clone();
    let (lost, error) = fraction(&result, "lost");
    assert!((lost - 0.5).abs() < 5.0 * error + 1e-3, "{result}");
    assert_eq!(result["missed"].as_f64().unwrap() / 50_000.0, (lost * 50_000.0).round() / 50_000.0);
}
