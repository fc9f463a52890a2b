//! Invalid cameras.

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

const MATRIX: &str = "/camera/camera_to_world";

/// A rigid matrix, column-major, with one entry changed.
fn matrix(changes: &[(usize, f64)]) -> Value {
    let mut entries = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.0, 1.0];
    changes.iter().for_each(|&(at, value)| entries[at] = value);
    json!({"camera_to_world": entries.to_vec()})
}

fn cases() -> Vec<(&'static str, Value, &'static str)> {
    vec![
        ("singular", matrix(&[(0, 0.0)]), MATRIX),
        ("all zero", json!({"camera_to_world": vec![0; 16]}), MATRIX),
        ("scaled", matrix(&[(0, 2.0), (5, 2.0), (10, 2.0)]), MATRIX),
        ("slightly scaled", matrix(&[(0, 1.01)]), MATRIX),
        ("mirrored", matrix(&[(0, -1.0)]), MATRIX),
        ("sheared", matrix(&[(4, 0.1)]), MATRIX),
        ("projecting", matrix(&[(3, 0.5)]), MATRIX),
        ("row-major", matrix(&[(14, 0.0), (11, 5.0)]), MATRIX),
        ("last entry 0", matrix(&[(15, 0.0)]), MATRIX),
        ("far off", matrix(&[(12, 1e300)]), MATRIX),
        ("huge", matrix(&[(0, 1e308), (5, 1e308), (10, 1e308)]), MATRIX),
        ("15 numbers", json!({"camera_to_world": vec![1; 15]}), MATRIX),
        ("17 numbers", json!({"camera_to_world": vec![1; 17]}), MATRIX),
        ("words", json!({"camera_to_world": vec!["1"; 16]}), "/camera/camera_to_world/0"),
        (
            "null among numbers",
            json!({"camera_to_world": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, null]}),
            "/camera/camera_to_world/15",
        ),
        ("both forms", with(matrix(&[]), "/eye", json!([0, 0, 5])), "/camera/eye"),
        ("eye at target", json!({"eye": [1, 2, 3], "target": [1, 2, 3]}), "/camera/eye"),
        ("eye at the default target", json!({"eye": [0, 0, 0]}), "/camera/eye"),
        ("up along the view", json!({"eye": [0, 5, 0], "target": [0, 0, 0], "up": [0, 1, 0]}), "/camera/up"),
        ("up against the view", json!({"eye": [0, 5, 0], "target": [0, 0, 0], "up": [0, -3, 0]}), "/camera/up"),
        ("no up", json!({"up": [0, 0, 0]}), "/camera/up"),
        ("eye of two numbers", json!({"eye": [0, 5]}), "/camera/eye"),
        ("eye of four numbers", json!({"eye": [0, 5, 0, 1]}), "/camera/eye"),
        ("eye far off", json!({"eye": [0, 0, 1e300]}), "/camera/eye"),
        ("target far off", json!({"target": [0, -1e300, 0]}), "/camera/target"),
        ("up far off", json!({"up": [0, 1e300, 0]}), "/camera/up"),
        ("no angle", json!({"fov_y_deg": 0}), "/camera/fov_y_deg"),
        ("half a turn", json!({"fov_y_deg": 180}), "/camera/fov_y_deg"),
        ("a negative angle", json!({"fov_y_deg": -30}), "/camera/fov_y_deg"),
        ("fish-eye", json!({"projection": "fisheye"}), "/camera/projection"),
    ]
}

/// Sends every invalid camera to a server, in a render and as a new camera for one.
pub async fn refused_by_name(server: &Server) {
    let api = Api::new(server);
    let path = api.finish(&small()).await["links"]["camera"].as_str().unwrap().to_owned();
    let mut wrong = Vec::new();
    for (about, camera, pointer) in cases() {
        let posted = api.post(&with(small(), "/camera", camera.clone()), "application/json").await;
        let put = api.put(&path, &camera).await;
        for response in [posted, put] {
            let (status, text) = (response.status().as_u16(), response.text().await.unwrap());
            let told: Value = serde_json::from_str(&text).unwrap_or_default();
            let errors = told["errors"].as_array().cloned().unwrap_or_default();
            let named = errors
                .iter()
                .any(|e| e["pointer"] == pointer && e["permitted"].as_str().is_some_and(|p| !p.is_empty()));
            if status != 422 || !named {
                wrong.push(format!("{about}: {camera}\n  expected {pointer}: {status} {text}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[tokio::test]
async fn every_bad_camera_is_refused_by_name() {
    refused_by_name(&shared()).await;
}

/// JSON has no NaN and no infinity, and numbers past a double's range are no numbers either.
#[tokio::test]
async fn numbers_that_are_none_are_refused() {
    let server = shared();
    let api = Api::new(&server);
    for number in ["NaN", "Infinity", "-inf", "1e999", "-1e999", "0x10"] {
        let body = format!("{{\"technique\": \"emission_absorption\", \"camera\": {{\"eye\": [{number}, 0, 0]}}}}");
        let request = api.request(reqwest::Method::POST, "/v1/renders").header("Content-Type", "application/json");
        problem(request.body(body).send().await.unwrap(), 400, number).await;
    }
}

/// An odd but valid camera gives a picture that is finite everywhere.
#[tokio::test]
async fn odd_cameras_render_finite_pictures() {
    let server = shared();
    let api = Api::new(&server);
    for (about, camera) in [
        ("inside", json!({"eye": [0.01, 0.02, 0.03], "target": [1, 0, 0]})),
        ("looking away", json!({"eye": [0, 0, 5], "target": [0, 0, 10]})),
        ("along an axis", json!({"eye": [5, 0, 0], "target": [0, 0, 0]})),
        ("on a face", json!({"eye": [0, 0, 1], "target": [0, 0, 0]})),
        ("very far", json!({"eye": [0, 0, 1e9], "target": [0, 0, 0]})),
        ("far, narrow", json!({"eye": [0, 0, 1e5], "target": [0, 0, 0], "fov_y_deg": 0.1})),
        ("wide", json!({"eye": [0, 0, 2], "target": [0, 0, 0], "fov_y_deg": 179})),
        ("parallel", json!({"eye": [0, 0, 1e-3], "target": [0, 0, 0], "projection": "orthographic"})),
        ("single precision", matrix(&[(0, 0.999_999_7), (5, 1.000_000_3)])),
    ] {
        let response = api.post(&with(small(), "/camera", camera), "image/x-exr").await;
        assert_eq!(response.status(), 200, "{about}");
        let path = response.headers()["content-location"].to_str().unwrap().to_owned();
        let (_, channels) = exr_samples(&response.bytes().await.unwrap());
        assert!(channels.values().flatten().all(|v| v.is_finite()), "{about}");
        let counts = api.get_json(&path).await["counts"].clone();
        assert_eq!(counts["non_finite_samples"], 0, "{about}");
    }
}
