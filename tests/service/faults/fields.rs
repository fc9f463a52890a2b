//! Requests that are JSON and mean nothing. Each refusal names the field and its permitted values.

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

const PHOTONS: &str = "/volume/photon_transport";
const POINTS: &str = "/emission_absorption/transfer_function/points";

fn point(value: f64, opacity: f64) -> Value {
    json!({"value": value, "color": [0.5, 0.5, 0.5], "opacity_per_unit": opacity})
}

/// `(place, value, expected pointer)`. An empty pointer is the place itself.
fn cases() -> Vec<(&'static str, Value, &'static str)> {
    vec![
        // An unknown field at each level.
        ("/samples", json!(4), ""),
        ("/image/depth", json!(4), ""),
        ("/budget/sample", json!(4), ""),
        ("/camera/fov", json!(4), ""),
        ("/volume/sed", json!(4), ""),
        ("/emission_absorption/colour", json!(4), ""),
        ("/emission_absorption/light/colour", json!(4), ""),
        (
            "/emission_absorption/transfer_function/points",
            json!([{"value": 0, "color": [0, 0, 0], "opacity_per_unit": 0, "alpha": 1}]),
            "/emission_absorption/transfer_function/points/0/alpha",
        ),
        ("/a~1b", json!(4), "/a~01b"),
        // The wrong type at each level.
        ("/technique", json!(7), ""),
        ("/technique", json!(null), ""),
        ("/image", json!([512, 512]), ""),
        ("/image/width", json!("512"), ""),
        ("/image/width", json!(1.5), ""),
        ("/budget/samples", json!(true), ""),
        ("/seed", json!("random"), ""),
        ("/seed", json!(-1), ""),
        ("/seed", json!(1.5), ""),
        ("/volume", json!("smoke"), ""),
        ("/camera", json!(5), ""),
        ("/emission_absorption", json!([]), ""),
        ("/emission_absorption/shading", json!("yes"), ""),
        // Values out of range.
        ("/technique", json!("none"), ""),
        ("/technique", json!("photon_transport"), ""),
        ("/image/width", json!(0), ""),
        ("/image/height", json!(0), ""),
        ("/image/width", json!(-5), ""),
        ("/image/width", json!(5000), ""),
        ("/image/height", json!(1e15), ""),
        ("/budget/samples", json!(-1), ""),
        ("/budget/samples", json!(0), ""),
        ("/budget/samples", json!(65537), ""),
        ("/budget/time_ms", json!(0), ""),
        ("/budget/time_ms", json!(1e12), ""),
        ("/budget/max_error", json!(0), ""),
        ("/budget/max_error", json!(-0.1), ""),
        ("/emission_absorption/opacity_scale", json!(-1), ""),
        ("/emission_absorption/step_voxels", json!(0), ""),
        ("/emission_absorption/step_voxels", json!(1e-9), ""),
        ("/emission_absorption/opacity_threshold", json!(1.5), ""),
        ("/emission_absorption/order", json!("sideways"), ""),
        ("/emission_absorption/light/direction", json!([0, 0, 0]), ""),
        ("/emission_absorption/light/shininess", json!(0), ""),
        ("/emission_absorption/transfer_function/preset", json!("rainbow"), ""),
        (POINTS, json!([]), ""),
        (POINTS, json!([point(1.0, 0.0), point(0.5, 1.0)]), "/emission_absorption/transfer_function/points/1/value"),
        (
            POINTS,
            json!([point(1.0, 0.0), point(1.0, 1.0), point(1.0, 2.0)]),
            "/emission_absorption/transfer_function/points/2/value",
        ),
        (
            POINTS,
            json!([point(0.0, 0.0), point(1.0, -1.0)]),
            "/emission_absorption/transfer_function/points/1/opacity_per_unit",
        ),
        (
            POINTS,
            json!([{"value": 0, "color": [0, 2, 0], "opacity_per_unit": 0}]),
            "/emission_absorption/transfer_function/points/0/color/1",
        ),
        (
            POINTS,
            json!([{"value": 0, "color": [0, 0], "opacity_per_unit": 0}]),
            "/emission_absorption/transfer_function/points/0/color",
        ),
        (
            POINTS,
            json!([{"value": 0, "color": [0, 0, 0]}]),
            "/emission_absorption/transfer_function/points/0/opacity_per_unit",
        ),
        (
            "/emission_absorption/transfer_function",
            json!({"preset": "ramp", "points": [point(0.0, 1.0)]}),
            "/emission_absorption/transfer_function/points",
        ),
        // Volumes that do not exist.
        ("/volume", json!({}), ""),
        ("/volume", json!({"builtin": "smoke", "id": "x"}), ""),
        ("/volume", json!({"builtin": "smoke", "photon_transport": {}}), ""),
        ("/volume", json!({"id": "0123456789abcdef"}), "/volume/id"),
        ("/volume", json!({"id": "../../etc/passwd"}), "/volume/id"),
        ("/volume", json!({"id": ""}), "/volume/id"),
        ("/volume", json!({"builtin": "teapot"}), "/volume/builtin"),
        ("/volume", json!({"builtin": "smoke", "level": 9}), "/volume/level"),
        ("/volume", json!({"photon_transport": {}, "level": 1}), "/volume/level"),
        ("/volume", json!({"builtin": "smoke", "resolution": 7}), "/volume/resolution"),
        ("/volume", json!({"builtin": "smoke", "resolution": 513}), "/volume/resolution"),
        ("/volume", json!({"builtin": "smoke", "resolution": 1e9}), "/volume/resolution"),
        ("/volume", json!({"photon_transport": {}, "resolution": 64}), "/volume/resolution"),
        ("/volume", json!({"emission_absorption": {}}), "/volume/emission_absorption"),
        // The simulation.
        ("/volume", json!({"photon_transport": {"photons": 0}}), "/volume/photon_transport/photons"),
        ("/volume", json!({"photon_transport": {"photons": 1_000_000_001}}), "/volume/photon_transport/photons"),
        ("/volume", json!({"photon_transport": {"albedo": 1.01}}), "/volume/photon_transport/albedo"),
        ("/volume", json!({"photon_transport": {"grid": [0, 64, 64]}}), "/volume/photon_transport/grid/0"),
        ("/volume", json!({"photon_transport": {"grid": [64, 64, 513]}}), "/volume/photon_transport/grid/2"),
        ("/volume", json!({"photon_transport": {"grid": [64, 64]}}), "/volume/photon_transport/grid"),
        ("/volume", json!({"photon_transport": {"size_mm": [1, 0, 1]}}), "/volume/photon_transport/size_mm/1"),
        (
            "/volume",
            json!({"photon_transport": {"source": {"position_mm": [0.5, 1.5, 0.5]}}}),
            "/volume/photon_transport/source/position_mm/1",
        ),
        (
            "/volume",
            json!({"photon_transport": {"source": {"position_mm": [-1e-9, 0.5, 0.5]}}}),
            "/volume/photon_transport/source/position_mm/0",
        ),
        (
            "/volume",
            json!({"photon_transport": {"source": {"type": "cone", "direction": [0, 0, 0]}}}),
            "/volume/photon_transport/source/direction",
        ),
        ("/volume", json!({"photon_transport": {"source": {"type": "laser"}}}), "/volume/photon_transport/source/type"),
        (
            "/volume",
            json!({"photon_transport": {"roulette": {"survival": 0}}}),
            "/volume/photon_transport/roulette/survival",
        ),
        (
            "/volume",
            json!({"photon_transport": {"roulette": {"survive": 0.5}}}),
            "/volume/photon_transport/roulette/survive",
        ),
        (
            "/volume",
            json!({"photon_transport": {"layers": [{"mu_a_per_mm": 1}]}}),
            "/volume/photon_transport/layers/0/thickness_mm",
        ),
        (
            "/volume",
            json!({"photon_transport": {"layers": [{"thickness_mm": "thick"}]}}),
            "/volume/photon_transport/layers/0/thickness_mm",
        ),
        ("/volume", json!({"photon_transport": {"media": [{}]}}), "/volume/photon_transport/media"),
        (
            "/volume",
            json!({"photon_transport": {"labels": {"builtin": "smoke"}, "media": [{}, {}]}}),
            "/volume/photon_transport/labels",
        ),
        ("/volume", json!({"photon_transport": {"medium": {}, "albedo": 0.5}}), "/volume/photon_transport/albedo"),
        (
            "/volume",
            json!({"photon_transport": {"medium": {"phase": {"type": "henyey_greenstein", "g": 1.5}}}}),
            "/volume/photon_transport/medium/phase/g",
        ),
        ("/volume", json!({"photon_transport": {"medium": {"mu_a": 1}}}), "/volume/photon_transport/medium/mu_a"),
        ("/volume", json!({"photon_transport": {"colour": 1}}), "/volume/photon_transport/colour"),
    ]
}

/// Posts every case to a server, which must name its field.
pub async fn refused_by_name(server: &Server) {
    let api = Api::new(server);
    let mut wrong = Vec::new();
    for (place, value, pointer) in cases() {
        let pointer = if pointer.is_empty() { place } else { pointer };
        let body = if place == "/a~1b" { with(small(), "/a~1b", value) } else { with(small(), place, value) };
        let about = format!("{place} in {body}");
        let response = api.post(&body, "application/json").await;
        let (status, text) = (response.status().as_u16(), response.text().await.unwrap());
        let told: Value = serde_json::from_str(&text).unwrap_or_default();
        let errors = told["errors"].as_array().cloned().unwrap_or_default();
        let named =
            errors.iter().any(|e| e["pointer"] == pointer && e["permitted"].as_str().is_some_and(|p| !p.is_empty()));
        if status != 422 || !named {
            wrong.push(format!("{about}\n  expected {pointer}: {status} {text}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[tokio::test]
async fn every_bad_field_is_refused_by_name_with_what_is_permitted() {
    refused_by_name(&shared()).await;
}

#[tokio::test]
async fn a_missing_technique_is_named() {
    let server = shared();
    let told = problem(Api::new(&server).post(&json!({}), "image/png").await, 422, "{}").await;
    names(&told, "/technique", "{}");
}

#[tokio::test]
async fn all_that_is_wrong_is_told_at_once() {
    let server = shared();
    let body = json!({"technique": "none", "image": {"width": 0, "height": 9999}, "sed": 1});
    let told = problem(Api::new(&server).post(&body, "image/png").await, 422, "four faults").await;
    for pointer in ["/technique", "/image/width", "/image/height", "/sed"] {
        names(&told, pointer, "four faults");
    }
}

#[tokio::test]
async fn ranges_are_told_as_ranges() {
    let server = shared();
    let api = Api::new(&server);
    for (place, value, permitted) in [
        ("/image/width", json!(5000), "1 to 4096"),
        ("/budget/samples", json!(0), "1 to 65536"),
        ("/volume/resolution", json!(7), "8 to 512"),
        ("/emission_absorption/opacity_threshold", json!(0.1), "0.5 to 1"),
        ("/emission_absorption/light/ambient", json!(2), "0 to 1"),
    ] {
        let told = problem(api.post(&with(small(), place, value), "image/png").await, 422, place).await;
        let said = told["errors"].as_array().unwrap().iter().find(|e| e["pointer"] == place).unwrap();
        assert!(said["permitted"].as_str().unwrap().contains(permitted), "{place}: {said}");
    }
}

/// JSON has one kind of number. If a schema says integer, 4.0 is one (JSON Schema, 6.3).
#[tokio::test]
async fn whole_numbers_written_as_floats_are_taken_or_refused_by_name() {
    let server = shared();
    let api = Api::new(&server);
    for place in ["/budget/samples", "/image/width", "/seed", "/volume/resolution"] {
        let response = api.post(&with(small(), place, json!(16.0)), "application/json").await;
        if response.status() != 202 {
            names(&problem(response, 422, place).await, place, place);
        }
    }
    let huge = json!(1e20);
    names(
        &problem(api.post(&with(small(), "/seed", huge), "image/png").await, 422, "a huge seed").await,
        "/seed",
        "a huge seed",
    );
    let body =
        json!({"technique": "emission_absorption", "volume": {"photon_transport": {"photons": 1000.0, "seed": 1e20}}});
    let place = format!("{PHOTONS}/seed");
    names(&problem(api.post(&body, "image/png").await, 422, "a huge seed").await, &place, "a huge seed");
}

#[tokio::test]
async fn limits_of_the_configuration_are_the_ones_that_are_kept_and_told() {
    let server = Server::start_with(&[
        "--max-image-side",
        "100",
        "--max-samples",
        "8",
        "--max-photons",
        "1000",
        "--max-time-ms",
        "500",
    ]);
    let api = Api::new(&server);
    for (place, value, permitted) in [
        ("/image/width", json!(101), "1 to 100"),
        ("/budget/samples", json!(9), "1 to 8"),
        ("/budget/time_ms", json!(501), "1 to 500"),
        ("/volume", json!({"photon_transport": {"photons": 1001}}), "1 to 1000"),
    ] {
        let told = problem(api.post(&with(small(), place, value), "image/png").await, 422, place).await;
        assert!(told["errors"][0]["permitted"].as_str().unwrap().contains(permitted), "{place}: {told}");
    }
    // The defaults must lie within the limits.
    let silent = api.post(&json!({"technique": "emission_absorption"}), "image/png").await;
    assert_eq!(silent.status(), 200, "{}", silent.text().await.unwrap());
    let simulated =
        api.post(&json!({"technique": "emission_absorption", "volume": {"photon_transport": {}}}), "image/png").await;
    let status = simulated.status().as_u16();
    assert!(status == 200 || status == 422, "{status}");
    if status == 200 {
        let path = simulated.headers()["content-location"].to_str().unwrap().to_owned();
        let photons = api.get_json(&path).await["result"]["photons"].as_u64();
        assert!(photons <= Some(1000), "the default passes the limit: {photons:?} photons");
    }
}
