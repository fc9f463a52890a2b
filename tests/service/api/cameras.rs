//! `PUT /v1/renders/{id}/camera`, and the field behind a view.

use serde_json::{Value, json};

use crate::support::*;

const FROM_ABOVE: [f64; 3] = [0.3, 4.0, 0.5];

/// The small request with a camera at `eye`.
fn seen_from(eye: [f64; 3]) -> Value {
    with(small(), "/camera", json!({"eye": eye}))
}

#[tokio::test]
async fn a_new_camera_restarts_a_running_render() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    api.until(&path, "at its second sample", |r| r["samples"].as_u64() >= Some(2)).await;
    let before = api.get(&format!("{path}/frame.png")).await.bytes().await.unwrap();
    let answer = api.put(&format!("{path}/camera"), &json!({"eye": FROM_ABOVE, "fov_y_deg": 30})).await;
    assert_eq!(answer.status(), 200);
    let answer: Value = answer.json().await.unwrap();
    assert_eq!((&answer["camera"]["eye"], &answer["camera"]["fov_y_deg"]), (&json!(FROM_ABOVE), &json!(30.0)));
    let resource = api.until(&path, "seen anew", |r| r["timings"]["first_frame_ms"].is_number()).await;
    assert_eq!(resource["camera"]["eye"], json!(FROM_ABOVE));
    let after = api.get(&format!("{path}/frame.png")).await.bytes().await.unwrap();
    assert_ne!(pixels(&before).2, pixels(&after).2);
    assert_eq!(api.get_json(&path).await["state"], "running");
    api.delete(&path).await;
    problem(api.put(&format!("{path}/camera"), &json!({})).await, 409, "a camera for a cancelled render").await;
}

#[tokio::test]
async fn a_new_camera_wakes_a_done_render_and_gives_what_a_new_one_would() {
    let server = shared();
    let api = Api::new(&server);
    let done = api.finish(&small()).await;
    let path = done["links"]["self"].as_str().unwrap();
    assert_eq!(api.put(&format!("{path}/camera"), &json!({"eye": FROM_ABOVE})).await.status(), 200);
    let png = api.get(&format!("{path}/frame.png?wait=final")).await.bytes().await.unwrap();
    assert_eq!(png, api.png(&seen_from(FROM_ABOVE)).await);
    let resource = api.get_json(path).await;
    assert_eq!((&resource["state"], &resource["samples"]), (&json!("done"), &json!(4)));
}

#[tokio::test]
async fn the_newest_of_many_cameras_wins() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&small()).await;
    for step in 0..30 {
        let eye = [4.0 * f64::from(step).sin(), 1.0, 4.0 * f64::from(step).cos()];
        assert_eq!(api.put(&format!("{path}/camera"), &json!({"eye": eye})).await.status(), 200);
    }
    assert_eq!(api.put(&format!("{path}/camera"), &json!({"eye": FROM_ABOVE})).await.status(), 200);
    let png = api.get(&format!("{path}/frame.png?wait=final")).await.bytes().await.unwrap();
    assert_eq!(png, api.png(&seen_from(FROM_ABOVE)).await);
    api.until_state(&path, "done").await;
}

/// The stream of a posted render is at its end, which must not count as its client going away.
#[tokio::test]
async fn a_render_posted_as_a_stream_takes_a_camera_after_its_end() {
    let server = shared();
    let api = Api::new(&server);
    let response = api.post(&small(), "multipart/x-mixed-replace").await;
    let path = response.headers()["content-location"].to_str().unwrap().to_owned();
    assert!(all_parts(response).await.1);
    assert_eq!(api.put(&format!("{path}/camera"), &json!({"eye": FROM_ABOVE})).await.status(), 200);
    api.until(&path, "done with the new camera", |r| r["state"] == "done" && r["stopped_by"] == "samples").await;
}

#[tokio::test]
async fn deleting_a_done_render_does_not_leave_its_next_camera_waiting_for_ever() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.finish(&small()).await["links"]["self"].as_str().unwrap().to_owned();
    assert_eq!(api.delete(&path).await.status(), 200);
    // A refusal and a picture are both right; to wait is not.
    if api.put(&format!("{path}/camera"), &json!({"eye": FROM_ABOVE})).await.status() == 200 {
        api.until_state(&path, "done").await;
    }
}

#[tokio::test]
async fn a_bad_camera_is_refused_by_name_and_the_render_goes_on() {
    let server = shared();
    let api = Api::new(&server);
    let done = api.finish(&small()).await;
    let path = done["links"]["self"].as_str().unwrap();
    let camera = format!("{path}/camera");
    for (body, pointer) in [
        (json!({"fov_y_deg": 200}), "/camera/fov_y_deg"),
        (json!({"eye": [0, 0, 0], "target": [0, 0, 0]}), "/camera/eye"),
        (json!({"camera_to_world": vec![0; 16]}), "/camera/camera_to_world"),
        (json!({"eyes": [1, 2, 3]}), "/camera/eyes"),
        (json!([1]), "/camera"),
    ] {
        names(&problem(api.put(&camera, &body).await, 422, &body.to_string()).await, pointer, &body.to_string());
    }
    problem(api.put("/v1/renders/none/camera", &json!({})).await, 404, "a camera for nobody").await;
    assert_eq!(api.get_json(path).await["camera"], done["camera"]);
}

#[tokio::test]
async fn a_matrix_and_a_point_say_the_same_camera() {
    let server = shared();
    let api = Api::new(&server);
    // In three.js, an object at (0, 0, 5) that is not rotated looks along -z.
    let matrix = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]);
    let by_matrix = api.png(&with(small(), "/camera/camera_to_world", matrix)).await;
    let by_point =
        api.png(&with(small(), "/camera", json!({"eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}))).await;
    assert_eq!(by_matrix, by_point);
    let orthographic = json!({"eye": [0, 0, 5], "up": [0, 1, 0], "projection": "orthographic"});
    assert_ne!(api.png(&with(small(), "/camera", orthographic)).await, by_point);
}

#[tokio::test]
async fn a_simulation_is_looked_at_while_it_fills_and_its_grid_is_a_nrrd() {
    let server = shared();
    let api = Api::new(&server);
    let body = json!({
        "technique": "emission_absorption", "image": {"width": 64, "height": 64}, "budget": {"samples": 2},
        "volume": {"photon_transport": {"photons": 50_000, "grid": [20, 16, 12], "albedo": 0.8}},
    });
    let resource = api.finish(&body).await;
    assert_eq!(resource["result"]["photons"], 50_000);
    let ledger = resource["result"]["ledger"].as_object().unwrap();
    // The light that leaves unscattered is a part of all light that leaves.
    let parts = ledger.iter().filter(|(name, _)| !name.starts_with("unscattered"));
    let sum: f64 = parts.map(|(_, e)| e["value"].as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-6, "every photon is somewhere: {ledger:?}");
    assert!(resource["error_parts"]["field"].as_f64() > Some(0.0), "{}", resource["error_parts"]);
    let path = resource["links"]["field"].as_str().unwrap();
    let field = api.get(path).await;
    assert_eq!(field.status(), 200);
    assert!(field.headers()["content-disposition"].to_str().unwrap().contains(".nrrd"));
    let limits = cloudchamber::volume::VolumeLimits { max_volume_bytes: 1 << 20, max_side: 64 };
    let bytes = field.bytes().await.unwrap();
    let grid = cloudchamber::volume::read(&bytes, "field", None, &limits).unwrap();
    assert_eq!(grid.dims(), [20, 16, 12]);
    assert!(grid.range()[0] >= 0.0 && grid.range()[1] > 0.0 && grid.range()[1].is_finite());
    // An output can be an input: the grid is a volume like any other.
    let uploaded: Value = api.upload("", bytes.to_vec()).await.json().await.unwrap();
    assert_eq!(uploaded["dims"], json!([20, 16, 12]));
    let plain = api.finish(&small()).await;
    problem(api.get(plain["links"]["field"].as_str().unwrap()).await, 404, "the field of a render without one").await;
}

/// The picture takes long. The first frames of a moving camera have reduced quality and say so, and those at rest do not.
#[tokio::test]
async fn a_frame_in_motion_says_what_was_lowered_and_one_at_rest_has_it_all() {
    let server = shared();
    let api = Api::new(&server);
    let heavy = json!({"technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 128},
        "emission_absorption": {"shading": true, "step_voxels": 0.06}, "image": {"width": 1024, "height": 1024}, "budget": {"samples": 500}});
    let path = api.start(&heavy).await;
    api.until(&path, "at rest", |r| {
        r["samples"].as_u64() >= Some(1)
            && r["trace"].as_array().is_some_and(|t| t.last().is_some_and(|p| p["stride"] == 1))
    })
    .await;
    let mut lowered = Vec::new();
    for step in 0..4 {
        let eye = [3.0 * f64::from(step).sin(), 1.0, 3.0 * f64::from(step).cos()];
        assert_eq!(api.put(&format!("{path}/camera"), &json!({"eye": eye})).await.status(), 200);
        api.until(&path, "seen", |r| r["timings"]["first_frame_ms"].is_number()).await;
        let frame = api.get(&format!("{path}/frame.png")).await;
        lowered.extend(frame.headers().get("x-cloudchamber-lowered").map(|v| v.to_str().unwrap().to_owned()));
        let error: f64 = frame.headers()["x-cloudchamber-error"].to_str().unwrap().parse().unwrap();
        assert!(error > 0.0, "what was lowered is part of the error");
    }
    assert!(lowered.iter().any(|l| l.contains("resolution") || l.contains("step")), "{lowered:?}");
    api.until(&path, "at rest again", |r| {
        r["trace"].as_array().is_some_and(|t| t.last().is_some_and(|p| p["stride"] == 1))
    })
    .await;
    let frame = api.get(&format!("{path}/frame.png")).await;
    assert!(frame.headers().get("x-cloudchamber-lowered").is_none());
    api.delete(&path).await;
}

#[tokio::test]
async fn a_field_keeps_its_error_for_another_camera_and_random_paths_do_not_know_it() {
    let server = shared();
    let api = Api::new(&server);
    let field = json!({"photon_transport": {"photons": 30_000, "grid": [12, 12, 12], "albedo": 0.8}});
    let image = json!({"width": 32, "height": 24});
    let body = json!({"technique": "emission_absorption", "image": image, "budget": {"samples": 2}, "volume": field});
    let first = api.finish(&body).await;
    let of = |resource: &Value, part: &str| resource["error_parts"][part].as_f64();
    assert!(of(&first, "field") > Some(0.0) && of(&first, "total") > of(&first, "field"), "{}", first["error_parts"]);
    let path = first["links"]["self"].as_str().unwrap();
    let camera = json!({"eye": [2.0, 1.5, 2.5], "target": [0.5, 0.5, 0.5]});
    assert_eq!(api.put(&format!("{path}/camera"), &camera).await.status(), 200);
    let moved = api.until_state(path, "done").await;
    assert_eq!(of(&moved, "field"), of(&first, "field"), "the change that the first camera has shown stands in");
    assert!(of(&moved, "total") > of(&moved, "field"), "{}", moved["error_parts"]);

    let paths = json!({"technique": "single_scatter", "image": image, "budget": {"samples": 20, "max_error": 0.5},
        "volume": field, "medium": {"sigma_t_per_unit": 1, "albedo": 0.5}, "lights": [{"type": "sky", "radiance": 1}]});
    let seen = api.finish(&paths).await;
    assert_eq!(
        (of(&seen, "field"), of(&seen, "total")),
        (None, None),
        "two pictures of random paths differ by their own noise"
    );
    let why = seen["error_parts"]["unknown"].as_str().unwrap_or_default();
    assert!(why.contains("random paths"), "the reason is named: {}", seen["error_parts"]);
    assert_eq!(seen["stopped_by"], "samples", "what is not known stops nothing");
}
