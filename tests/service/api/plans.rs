//! `POST /v1/plan`, and renders whose technique is `auto`.

use std::time::{Duration, Instant};

use reqwest::Method;
use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

async fn plan(api: &Api, body: &Value) -> Value {
    let response = api.post_to("/v1/plan", body).await;
    assert_eq!(response.status(), 200, "{}", response.text().await.unwrap());
    response.json().await.unwrap()
}

fn fog(sigma: f64, albedo: f64, budget: &Value) -> Value {
    json!({"technique": "auto", "volume": {"builtin": "smoke", "resolution": 32}, "image": {"width": 120, "height": 90}, "budget": budget,
        "medium": {"sigma_t_per_unit": sigma, "albedo": albedo}, "lights": [{"type": "sun"}, {"type": "sky", "radiance": 0.1}]})
}

fn considered<'a>(plan: &'a Value, words: &str) -> &'a Value {
    let all = plan["considered"].as_array().unwrap();
    all.iter().find(|c| c["words"].as_str().unwrap().starts_with(words)).unwrap_or_else(|| panic!("{words} in {all:?}"))
}

#[tokio::test]
async fn a_plan_says_what_it_takes_and_why_and_can_be_posted() {
    let server = shared();
    let api = Api::new(&server);
    for body in [
        json!({"image": {"width": 96, "height": 72}}),
        fog(5.0, 0.9, &json!({"max_error": 0.05})),
        json!({"technique": "auto", "volume": {"builtin": "gaussian", "resolution": 32}, "isosurface": {"isovalue": 0.5},
            "image": {"width": 96, "height": 72}, "budget": {"max_error": 0.05}}),
    ] {
        let plan = plan(&api, &body).await;
        for number in ["device_ms", "error"] {
            let (value, interval) = (plan[number]["value"].as_f64().unwrap(), &plan[number]["interval"]);
            let ends = [0, 1].map(|i| interval[i].as_f64().unwrap());
            assert!(value > 0.0 && ends[0] <= value && value <= ends[1], "{number}: {}", plan[number]);
        }
        assert!(plan["reasons"].as_array().is_some_and(|r| !r.is_empty()), "{plan}");
        assert!(plan["considered"].as_array().unwrap().iter().any(|c| c["enough"] == true), "{plan}");
        let done = api.finish(&plan["request"]).await;
        assert_eq!(done["plan"]["technique"], plan["technique"]);
        assert!(done["samples"].as_u64() <= plan["samples"].as_u64(), "{} of {}", done["samples"], plan["samples"]);
    }
}

#[tokio::test]
async fn models_are_dropped_where_a_bound_permits_it_and_not_elsewhere() {
    let server = shared();
    let api = Api::new(&server);
    let thick = plan(&api, &fog(20.0, 0.95, &json!({"max_error": 0.05}))).await;
    let single = considered(&thick, "single_scatter");
    assert_eq!(single["enough"], false);
    assert!(single["why"].as_str().unwrap().contains("would lack"), "{single}");
    assert_eq!(thick["technique"], "volume_path");
    let thin = plan(&api, &fog(0.001, 0.9, &json!({"max_error": 0.05}))).await;
    assert_eq!(considered(&thin, "single_scatter")["enough"], true, "{thin}");
    let black = plan(&api, &fog(5.0, 0.0, &json!({"max_error": 0.1}))).await;
    assert!(black["reasons"].to_string().contains("nothing is scattered"), "{}", black["reasons"]);
    let mut even = fog(1.0, 0.5, &json!({"max_error": 0.1}));
    even["volume"] = json!({"builtin": "constant", "resolution": 16});
    let even = plan(&api, &even).await;
    assert!(even["reasons"].to_string().contains("closed form") && even["features"]["homogeneous"] == true, "{even}");
}

#[tokio::test]
async fn a_plan_says_what_the_scene_is_like() {
    let server = shared();
    let api = Api::new(&server);
    let mut forward = fog(2.0, 0.8, &json!({"max_error": 0.2}));
    forward["medium"]["phase"] = json!({"type": "henyey_greenstein", "g": 0.7});
    let features = plan(&api, &forward).await["features"].clone();
    assert_eq!((&features["anisotropy"], &features["albedo"]), (&json!(0.7), &json!(0.8)), "{features}");
    assert!(features["optical_depth"][0].as_f64() > Some(0.0) && features["opaque"].is_null(), "{features}");
    let wall = json!([{"value": 0, "color": [1, 1, 1], "opacity_per_unit": 0}, {"value": 0.5, "color": [1, 1, 1], "opacity_per_unit": 200}]);
    let body = json!({"volume": {"builtin": "gaussian", "resolution": 64}, "image": {"width": 32, "height": 24}, "budget": {"max_error": 0.2},
        "emission_absorption": {"transfer_function": {"points": wall}}});
    let opaque = plan(&api, &body).await;
    let features = &opaque["features"];
    // The slope is 400 per unit of value, over a range of almost 1 and a voxel of 2 / 64.
    let slope = features["steepest_slope"].as_f64().unwrap();
    assert!((slope / 12.5 - 1.0).abs() < 0.05, "{slope}");
    assert!(features["opaque"].as_f64().is_some_and(|part| part > 0.1 && part < 0.9), "{features}");
    assert!(opaque["reasons"].to_string().contains("nothing behind is sampled"), "{}", opaque["reasons"]);
    assert!(features["pixels_per_voxel"].as_f64() < Some(1.0), "{features}");
}

#[tokio::test]
async fn an_automatic_render_is_planned_rendered_and_explained() {
    let server = shared();
    let api = Api::new(&server);
    // No other test here asks for this size.
    let body = with(fog(5.0, 0.9, &json!({"max_error": 0.05})), "/image", json!({"width": 97, "height": 61}));
    let rendered = api.png(&body);
    tokio::pin!(rendered);
    let mut seen = BTreeSet::new();
    let picture = loop {
        tokio::select! {
            picture = &mut rendered => break picture,
            listed = api.get_json("/v1/renders") => {
                let ours = listed["renders"].as_array().unwrap().iter().filter(|r| r["image"] == json!([97, 61]));
                seen.extend(ours.map(|r| r["id"].to_string()));
            }
        }
    };
    assert!(colours(&picture) > 20);
    // Pilots have pictures of the same size, and are not listed as renders.
    assert!(seen.len() <= 1, "{seen:?}");
    let done = api.finish(&body).await;
    assert!(done["error"].as_f64().is_some_and(|e| e <= 0.05), "{}", done["error"]);
    let planned = &done["plan"]["planned"];
    assert!(planned["reasons"].as_array().is_some_and(|r| !r.is_empty()), "{planned}");
    assert_eq!(planned["technique"], done["plan"]["technique"]);
    let parts = &done["error_parts"];
    assert_eq!(parts["model"], planned["bias"], "{parts}");
    assert!(["plan", "picture"].contains(&parts["source"].as_str().unwrap()), "{parts}");
}

#[tokio::test]
async fn a_planned_frame_states_the_better_founded_error_and_its_source() {
    let server = shared();
    let api = Api::new(&server);
    // The picture's own bound of one sample is wide. The plan knows from pilots that this is enough.
    let points = json!([{"value": 0.1, "color": [1, 0.8, 0.5], "opacity_per_unit": 0}, {"value": 1, "color": [1, 1, 1], "opacity_per_unit": 6}]);
    let body = json!({"technique": "auto", "volume": {"builtin": "gaussian", "resolution": 32}, "image": {"width": 83, "height": 83},
        "budget": {"max_error": 0.03}, "emission_absorption": {"transfer_function": {"points": points}}});
    let done = api.finish(&body).await;
    let parts = &done["error_parts"];
    assert!(done["error"].as_f64().is_some_and(|error| error <= 0.03), "{parts}");
    assert!(parts["planned"].as_f64().is_some_and(|planned| planned <= 0.03), "{parts}");
    let by_plan = done["error"] == parts["planned"];
    assert_eq!(parts["source"], if by_plan { "plan" } else { "picture" }, "{parts}");
    // What is not planned has no such parts.
    let own = json!({"technique": "emission_absorption", "volume": {"builtin": "gaussian", "resolution": 32}, "image": {"width": 83, "height": 83},
        "budget": {"samples": 4}});
    let parts = api.finish(&own).await["error_parts"].clone();
    assert_eq!((&parts["planned"], &parts["model"], &parts["source"]), (&json!(null), &json!(null), &json!("picture")));
}

#[tokio::test]
async fn a_time_that_is_too_short_is_said_to_be() {
    let server = shared();
    let api = Api::new(&server);
    let both = plan(&api, &fog(8.0, 0.95, &json!({"max_error": 0.0005, "time_ms": 20}))).await;
    assert!(both["reasons"].to_string().contains("nothing is within 0.05 % in 20 ms"), "{}", both["reasons"]);
    assert_eq!(both["request"]["budget"]["time_ms"], 20);
    let time = plan(&api, &fog(8.0, 0.95, &json!({"time_ms": 50}))).await;
    assert!(time["reasons"].to_string().contains("the most accurate in 50 ms"), "{}", time["reasons"]);
}

#[tokio::test]
async fn a_field_is_planned_with_its_photons_and_can_be_posted() {
    let server = shared();
    let api = Api::new(&server);
    let field = json!({"grid": [16, 16, 16], "albedo": 0.9});
    let mut body = json!({"technique": "auto", "volume": {"photon_transport": field}, "image": {"width": 64, "height": 48},
        "emission_absorption": {}, "budget": {"max_error": 0.3}});
    let found = plan(&api, &body).await;
    let photons = found["photons"].as_u64().unwrap();
    assert_eq!(found["request"]["volume"]["photon_transport"]["photons"], photons);
    assert!(found["reasons"].to_string().contains(&format!("{photons} photons")), "{}", found["reasons"]);
    assert!(considered(&found, "emission_absorption, the shortest step")["photons"].as_u64() > Some(0), "{found}");
    let done = api.finish(&body).await;
    assert!(done["plan"]["planned"]["photons"].as_u64() > Some(0), "{}", done["plan"]);
    assert!(done["result"]["ledger"]["absorbed"]["value"].as_f64() > Some(0.0), "{}", done["result"]);
    body["budget"] = json!({"time_ms": 300});
    let in_time = plan(&api, &body).await;
    assert!(in_time["photons"].as_u64() > Some(1000), "{in_time}");
    assert!(in_time["device_ms"]["value"].as_f64() <= Some(300.0), "{}", in_time["device_ms"]);
}

#[tokio::test]
async fn what_cannot_be_planned_names_its_field() {
    let server = shared();
    let api = Api::new(&server);
    for (body, pointer) in [
        (
            json!({"technique": "auto", "volume": {"photon_transport": {"photons": 0}}}),
            "/volume/photon_transport/photons",
        ),
        (json!({"technique": "auto", "volume": {"builtin": "smoke", "level": 9}}), "/volume/level"),
        (
            json!({"technique": "emission_absorption", "volume": {"builtin": "smoke", "level": 1},
                "emission_absorption": {"transfer_function": {"preset": "labels"}}}),
            "/volume/level",
        ),
        (json!({"technique": "auto", "medium": {"albedo": 2}}), "/medium/albedo"),
        (json!({"technique": "auto", "image": {"width": 0}}), "/image/width"),
        (json!({"technique": "auto", "budget": {"max_error": -1}}), "/budget/max_error"),
        (json!({"technique": "auto", "emission_absorption": {"step_voxels": 99}}), "/emission_absorption/step_voxels"),
        (json!({"technique": "auto", "nonsense": 1}), "/nonsense"),
    ] {
        for path in ["/v1/plan", "/v1/renders"] {
            let told = problem(api.post_to(path, &body).await, 422, &body.to_string()).await;
            names(&told, pointer, &format!("{path}: {body}"));
        }
    }
    for body in [
        json!([1]),
        json!({"technique": "nonsense"}),
        json!({"technique": 5}),
        json!({"technique": "photon_transport"}),
    ] {
        problem(api.post_to("/v1/plan", &body).await, 422, &body.to_string()).await;
    }
    let twice = json!({"technique": "auto", "medium": {"albedo": 0.5}, "single_scatter": {"medium": {"albedo": 0.5}}});
    problem(api.post_to("/v1/plan", &twice).await, 422, "a medium in two places").await;
}

#[tokio::test]
async fn what_is_said_is_kept() {
    let server = shared();
    let api = Api::new(&server);
    let mut body = fog(5.0, 0.9, &json!({"max_error": 0.001, "samples": 5}));
    assert!(plan(&api, &body).await["samples"].as_u64().unwrap() <= 5, "no more samples than are asked for");
    body["technique"] = json!("single_scatter");
    assert_eq!(plan(&api, &body).await["technique"], "single_scatter", "a technique that is named is kept");
    let step =
        json!({"technique": "auto", "image": {"width": 64, "height": 48}, "emission_absorption": {"step_voxels": 0.7}});
    assert_eq!(plan(&api, &step).await["options"]["step_voxels"], 0.7);
}

#[tokio::test]
async fn a_client_that_goes_away_takes_its_pilots_along() {
    let server = Server::start();
    let api = Api::new(&server);
    let large = json!({"technique": "auto", "image": {"width": 3000, "height": 3000}, "medium": {}, "budget": {"max_error": 0.001}});
    let request = api.request(Method::POST, "/v1/plan").json(&large).timeout(Duration::from_secs(4));
    assert!(request.send().await.is_err(), "its last pilot alone takes longer");
    let started = Instant::now();
    while !api.get("/metrics").await.text().await.unwrap().contains("cloudchamber_renders_unfinished 0") {
        assert!(started.elapsed() < Duration::from_secs(5), "a pilot goes on for nobody");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert_eq!(api.get_json("/v1/renders").await["renders"], json!([]));
}

#[tokio::test]
async fn lights_that_hardly_reach_may_go_and_others_not() {
    let server = shared();
    let api = Api::new(&server);
    let lit = |intensity: f64| {
        let lights = json!([{"type": "sun"}, {"type": "point", "position": [30, 5, 0], "intensity": intensity}, {"type": "sky", "radiance": 0.1}]);
        with(fog(3.0, 0.8, &json!({"max_error": 0.05})), "/lights", lights)
    };
    let words = "volume_path, every scattering, without the faintest light";
    let faint = plan(&api, &lit(0.1)).await;
    let without = considered(&faint, words);
    assert_eq!(without["enough"], true, "{without}");
    assert!(without["bias"].as_f64() < Some(0.02), "{without}");
    let strong = plan(&api, &lit(3000.0)).await;
    assert_eq!(considered(&strong, words)["enough"], false, "the sun is missed beside a light three times as strong");
    let less = considered(&strong, "volume_path, every scattering, without the 2 faintest lights");
    assert!(less["why"].as_str().unwrap().contains("leaves out less, and that is too much"), "{less}");
    assert_eq!(api.finish(&faint["request"]).await["state"], "done");
}

#[tokio::test]
async fn shading_goes_where_nothing_has_a_gradient() {
    let server = shared();
    let api = Api::new(&server);
    let shaded = |volume: &str| {
        json!({"technique": "auto", "volume": {"builtin": volume, "resolution": 32}, "emission_absorption": {"shading": true},
            "image": {"width": 96, "height": 72}, "budget": {"max_error": 0.05}})
    };
    let unshaded = |plan: &Value| {
        plan["considered"].as_array().unwrap().iter().any(|c| c["words"].as_str().unwrap().contains("unshaded"))
    };
    let flat = plan(&api, &shaded("constant")).await;
    assert!(unshaded(&flat), "{flat}");
    assert!(!unshaded(&plan(&api, &shaded("sphere")).await), "a surface is not flat");
}
