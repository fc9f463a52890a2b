//! Scenes of scattered light over HTTP: their shared sections, their mistakes, and the map of the difference of two of them.

use serde_json::{Value, json};

use crate::common::with;
use crate::support::*;

fn scene(technique: &str, seed: u64) -> Value {
    json!({"technique": technique, "volume": {"builtin": "smoke", "resolution": 24}, "image": {"width": 40, "height": 30},
        "budget": {"samples": 64}, "seed": seed, "medium": {"sigma_t_per_unit": 6, "albedo": 0.7},
        "lights": [{"type": "sun", "direction": [1, 1, 0]}, {"type": "sky", "radiance": 0.2}]})
}

async fn rendered(api: &Api, body: &Value) -> String {
    let response = api.post(body, "application/json").await;
    assert_eq!(response.status(), 202, "{}", response.text().await.unwrap());
    let place = response.headers()["location"].to_str().unwrap().to_owned();
    api.until_state(&place, "done").await;
    place
}

#[tokio::test]
async fn two_techniques_are_compared_in_a_picture_with_a_p_value() {
    let server = shared();
    let api = Api::new(&server);
    let single = rendered(&api, &scene("single_scatter", 1)).await;
    let mut once = scene("volume_path", 2);
    once["volume_path"] = json!({"max_scatterings": 1});
    let once = rendered(&api, &once).await;
    let many = rendered(&api, &scene("volume_path", 3)).await;
    let id = |place: &str| place.rsplit('/').next().unwrap().to_owned();
    let path = |with: &str| format!("{single}/difference?with={}", id(with));
    let same = api.get(&path(&once)).await;
    assert_eq!((same.status().as_u16(), &same.headers()["content-type"]), (200, &"image/png".parse().unwrap()));
    let p: f64 = same.headers()["x-cloudchamber-p-value"].to_str().unwrap().parse().unwrap();
    assert!(p > 1e-3 && same.headers()["x-cloudchamber-agree"] == "true", "p {p}");
    let png = same.bytes().await.unwrap();
    assert_eq!(pixels(&png).0, 40);
    assert_eq!(description(&png)["agree"], true);
    // The light that single scattering leaves out is found.
    let response =
        api.request(reqwest::Method::GET, &path(&many)).header("Accept", "application/json").send().await.unwrap();
    let differs: Value = response.json().await.unwrap();
    assert!(
        differs["p_value"].as_f64().unwrap() < 1e-6 && differs["mean_difference"].as_f64().unwrap() < 0.0,
        "{differs}"
    );
    // Pictures of one seed share their noise, and the reply says so.
    let again = rendered(&api, &scene("volume_path", 1)).await;
    let shared = api.get(&path(&again)).await;
    assert_eq!(shared.headers()["x-cloudchamber-correlated"], "true");
    assert_eq!(differs["correlated"], false);

    let problem = api.get(&format!("{single}/difference")).await;
    assert_eq!(problem.status(), 422);
    let problem = api.get(&format!("{single}/difference?with=none")).await;
    assert_eq!(problem.status(), 404);
    let mut small = scene("volume_path", 1);
    small["image"] = json!({"width": 10, "height": 10});
    let small = rendered(&api, &small).await;
    let problem = api.get(&path(&small)).await;
    assert_eq!(problem.status(), 409);
    assert!(problem.text().await.unwrap().contains("40 × 30 and 10 × 10"));
}

#[tokio::test]
async fn mistakes_are_named_where_they_were_made() {
    let server = shared();
    let api = Api::new(&server);
    for (technique, more, pointer) in [
        ("volume_path", json!({"medium": {"albedo": 1.5}}), "/medium/albedo"),
        ("volume_path", json!({"medium": {"albedo": [0.5, 2, 0.5]}}), "/medium/albedo/1"),
        ("volume_path", json!({"medium": {"sigma_t_per_unit": -1}}), "/medium/sigma_t_per_unit"),
        ("volume_path", json!({"medium": {"sigma_t": 1}}), "/medium/sigma_t"),
        ("volume_path", json!({"medium": {"phase": {"type": "klein_nishina"}}}), "/medium/phase/type"),
        ("volume_path", json!({"medium": {"density_window": [1, 1]}}), "/medium/density_window"),
        ("volume_path", json!({"medium": {"sigma_t_per_unit": 0, "emission": 1}}), "/medium/emission"),
        ("volume_path", json!({"medium": {"index": 1.5}}), "/medium/index"),
        ("single_scatter", json!({"medium": {"index": 1.5}, "lights": []}), "/medium/index"),
        ("single_scatter", json!({"lights": [{"type": "moon"}]}), "/lights/0/type"),
        ("single_scatter", json!({"lights": [{"type": "point"}]}), "/lights/0/position"),
        ("single_scatter", json!({"lights": [{}]}), "/lights/0/type"),
        (
            "volume_path",
            json!({"medium": {"phase": {"type": "two_term_henyey_greenstein", "g1": 1}}}),
            "/medium/phase/g1",
        ),
        (
            "single_scatter",
            json!({"lights": [{"type": "point", "position": [0, 0, 0], "radius": 1}]}),
            "/lights/0/radius",
        ),
        ("single_scatter", json!({"lights": [{"type": "sun", "direction": [0, 0, 0]}]}), "/lights/0/direction"),
        ("single_scatter", json!({"lights": [{"type": "sky"}, {"type": "sky"}]}), "/lights/1"),
        ("single_scatter", json!({"lights": [{"type": "sky", "radiance": 1, "zenith": 1}]}), "/lights/0/radiance"),
        (
            "single_scatter",
            json!({"lights": [{"type": "quad", "corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [2, 0, 0]}]}),
            "/lights/0/edge_v",
        ),
        ("volume_path", json!({"volume_path": {"medium": {}}}), "/medium"),
        ("volume_path", json!({"volume_path": {"next_event": false}}), "/volume_path/next_event"),
        (
            "volume_path",
            json!({"volume_path": {"tracking": "exact", "interpolation": "trilinear"}}),
            "/volume_path/tracking",
        ),
        ("volume_path", json!({"volume_path": {"equiangular": true}}), "/volume_path/equiangular"),
        ("single_scatter", json!({"single_scatter": {"max_scatterings": 2}}), "/single_scatter/max_scatterings"),
        ("volume_path", json!({"clip": {"planes": [{"normal": [1, 0, 0]}]}}), "/clip"),
        ("emission_absorption", json!({}), "/medium"),
    ] {
        let body = with(&scene(technique, 0), &more);
        let response = api.post(&body, "application/json").await;
        assert_eq!(response.status(), 422, "{technique} {more}");
        let problem: Value = response.json().await.unwrap();
        let pointers: Vec<&str> =
            problem["errors"].as_array().unwrap().iter().map(|e| e["pointer"].as_str().unwrap()).collect();
        assert!(pointers.contains(&pointer), "{technique} {more}: {problem}");
    }
}
