//! The ends of renders, the default budget, and results that do not depend on the machine's load.

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

#[tokio::test]
async fn samples_stop_a_render() {
    let server = shared();
    let resource =
        Api::new(&server).finish(&with(small(), "/budget", json!({"samples": 7, "time_ms": 3_600_000}))).await;
    assert_eq!((&resource["stopped_by"], &resource["samples"]), (&json!("samples"), &json!(7)));
}

#[tokio::test]
async fn time_stops_a_render() {
    let server = shared();
    let resource = Api::new(&server).finish(&with(endless(), "/budget/time_ms", json!(50))).await;
    assert_eq!(resource["stopped_by"], "time");
    // The resolution is full all the same, and the time was used.
    assert!(resource["samples"].as_u64() >= Some(1) && resource["samples"].as_u64() < Some(65536));
    assert_eq!(resource["trace"].as_array().unwrap().last().unwrap()["stride"], 1);
    assert!(resource["timings"]["elapsed_ms"].as_f64() >= Some(50.0));
}

#[tokio::test]
async fn accuracy_stops_a_render() {
    let server = shared();
    let api = Api::new(&server);
    let mut samples = 0;
    for most in [0.1, 0.02] {
        let resource = api.finish(&with(small(), "/budget", json!({"max_error": most}))).await;
        assert_eq!(resource["stopped_by"], "error", "{}", resource["error_parts"]);
        assert!(resource["error"].as_f64() <= Some(most), "{}", resource["error"]);
        assert!(resource["samples"].as_u64() >= Some(samples), "a smaller error takes no fewer samples");
        samples = resource["samples"].as_u64().unwrap();
    }
}

#[tokio::test]
async fn a_technique_alone_is_a_request() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&json!({"technique": "emission_absorption"})).await;
    let png = api.get(&format!("{path}/frame.png?wait=final")).await.bytes().await.unwrap();
    let (width, height, _) = pixels(&png);
    assert_eq!((width, height), (512, 512));
    assert!(colours(&png) > 100);
    let resource = api.get_json(&path).await;
    assert_eq!(
        (&resource["stopped_by"], &resource["plan"]["budget"]["samples"]),
        (&json!("samples"), &resource["samples"])
    );
}

/// Both techniques, with every source of randomness in use.
fn requests() -> Vec<Value> {
    let view = json!({
        "technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 48}, "seed": 7,
        "image": {"width": 200, "height": 150}, "budget": {"samples": 5},
    });
    let field = json!({
        "technique": "emission_absorption", "image": {"width": 100, "height": 100}, "budget": {"samples": 3},
        "volume": {"photon_transport": {"photons": 100_000, "grid": [32, 32, 32], "albedo": 0.9, "seed": 5}},
    });
    let by_error = with(view.clone(), "/budget", json!({"max_error": 0.03}));
    vec![view, field, by_error]
}

#[tokio::test]
async fn the_same_request_gives_the_same_bytes_under_load_and_with_one_thread_or_two() {
    let one = Server::start_env(&[], &[("POCL_MAX_PTHREAD_COUNT", "1")]);
    let two = Server::start_env(&[], &[("POCL_MAX_PTHREAD_COUNT", "2")]);
    let (one, two) = (Api::new(&one), Api::new(&two));
    let mut pictures = Vec::new();
    for body in requests() {
        let png = one.png(&body).await;
        assert_eq!(one.png(&body).await, png, "twice: {body}");
        assert_eq!(two.png(&body).await, png, "one thread and two: {body}");
        pictures.push(png);
    }
    // Now other renders take turns between its slices.
    let others = [two.start(&endless()).await, two.start(&endless()).await];
    for (body, png) in requests().iter().zip(&pictures) {
        assert_eq!(&two.png(body).await, png, "under load: {body}");
    }
    for path in others {
        two.delete(&path).await;
    }
    // Randomness is in use, so another seed gives another picture.
    let reseeded = with(requests()[0].clone(), "/seed", json!(8));
    assert_ne!(pixels(&one.png(&reseeded).await).2, pixels(&pictures[0]).2);
    let reseeded = with(requests()[1].clone(), "/volume/photon_transport/seed", json!(6));
    assert_ne!(pixels(&one.png(&reseeded).await).2, pixels(&pictures[1]).2);
}
