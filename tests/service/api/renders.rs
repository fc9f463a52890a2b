//! `/v1/renders`: the four answers, the resource, its frames in every format, events, chart, delete, idempotency.

use reqwest::Method;
use serde_json::{Value, json};

use crate::support::*;

/// Samples, error and the other headers that every frame has.
fn check_frame_headers(headers: &reqwest::header::HeaderMap, samples: &str) {
    assert_eq!(headers["x-cloudchamber-samples"], samples);
    assert_eq!(headers["x-cloudchamber-final"], "true");
    let number = |name: &str| headers[name].to_str().unwrap().parse::<f64>().unwrap();
    assert!(number("x-cloudchamber-error") > 0.0 && number("x-cloudchamber-error") < 1.0);
    assert!(number("x-cloudchamber-elapsed-ms") > 0.0);
    let etag = headers["etag"].to_str().unwrap();
    assert!(etag.starts_with('"') && etag.len() > 10, "a strong tag, not {etag}");
}

#[tokio::test]
async fn json_is_answered_at_once_with_the_place_of_the_render() {
    let server = shared();
    let api = Api::new(&server);
    for accept in ["application/json", "*/*"] {
        let response = api.post(&small(), accept).await;
        assert_eq!(response.status(), 202);
        assert_eq!(response.headers()["content-type"], "application/json");
        let location = response.headers()["location"].to_str().unwrap().to_owned();
        let resource: Value = response.json().await.unwrap();
        assert_eq!(location, format!("/v1/renders/{}", resource["id"].as_str().unwrap()));
        assert_eq!(resource["links"]["self"], location);
        assert_eq!(resource["request"], small());
        assert_eq!(api.until_state(&location, "done").await["samples"], 4);
    }
}

#[tokio::test]
async fn png_is_answered_with_the_final_frame_that_says_how_accurate_it_is() {
    let server = shared();
    let api = Api::new(&server);
    let response = api.post(&small(), "image/png").await;
    assert_eq!(response.status(), 200);
    assert_eq!(response.headers()["content-type"], "image/png");
    check_frame_headers(response.headers(), "4");
    let path = response.headers()["content-location"].to_str().unwrap().to_owned();
    let header_error: f64 = response.headers()["x-cloudchamber-error"].to_str().unwrap().parse().unwrap();
    let png = response.bytes().await.unwrap();
    let (width, height, _) = pixels(&png);
    assert_eq!((width, height), (64, 48));
    assert!(colours(&png) > 50);
    let said = description(&png);
    let resource = api.get_json(&path).await;
    assert_eq!(said["samples"], 4);
    assert_eq!(said["error"], resource["error"]);
    assert!((said["error"].as_f64().unwrap() - header_error).abs() < 1e-6);
    assert_eq!(resource["state"], "done");
}

#[tokio::test]
async fn exr_is_answered_with_linear_floats_of_the_right_size() {
    let server = shared();
    let api = Api::new(&server);
    let response = api.post(&small(), "image/x-exr").await;
    assert_eq!(response.status(), 200);
    assert_eq!(response.headers()["content-type"], "image/x-exr");
    check_frame_headers(response.headers(), "4");
    let path = response.headers()["content-location"].to_str().unwrap().to_owned();
    let bytes = response.bytes().await.unwrap();
    let (size, channels) = exr_samples(&bytes);
    assert_eq!(size, [64, 48]);
    for name in ["R", "G", "B"] {
        let values = &channels[name];
        assert_eq!(values.len(), 64 * 48);
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0) && values.iter().any(|v| *v > 0.0), "{name}");
    }
    let again = api.get(&format!("{path}/frame.exr")).await;
    let etag = again.headers()["etag"].clone();
    assert_eq!(again.bytes().await.unwrap(), bytes);
    let unchanged = api.request(Method::GET, &format!("{path}/frame.exr")).header("If-None-Match", etag);
    assert_eq!(unchanged.send().await.unwrap().status(), 304);
}

#[tokio::test]
async fn multipart_is_answered_with_frames_that_end_with_the_final_one() {
    let server = shared();
    let api = Api::new(&server);
    let response = api.post(&small(), "multipart/x-mixed-replace").await;
    let path = response.headers()["content-location"].to_str().unwrap().to_owned();
    let (parts, closed) = all_parts(response).await;
    assert!(closed);
    let last = parts.last().unwrap();
    assert!(last.is_final() && last.number("x-cloudchamber-samples") == 4.0);
    assert_eq!(last.body, api.get(&format!("{path}/frame.png")).await.bytes().await.unwrap());
}

#[tokio::test]
async fn the_resource_tells_plan_samples_error_timings_and_trace() {
    let server = shared();
    let api = Api::new(&server);
    let body = with(small(), "/budget/samples", json!(9));
    let resource = api.finish(&body).await;
    assert_eq!(resource["technique"], "emission_absorption");
    assert_eq!(resource["image"], json!({"width": 64, "height": 48}));
    assert_eq!((&resource["samples"], &resource["stopped_by"]), (&json!(9), &json!("samples")));
    assert_eq!(resource["plan"]["technique"], "emission_absorption");
    assert_eq!(resource["plan"]["budget"]["samples"], 9);
    let reasons = resource["plan"]["reasons"].as_array().unwrap();
    assert!(reasons.iter().any(|r| r.as_str().unwrap().contains("ramp")), "the default is named: {reasons:?}");
    // The total is a bound: no less than the root of the sum of the squares of its parts.
    let error = resource["error"].as_f64().unwrap();
    let parts = resource["error_parts"].as_object().unwrap();
    assert_eq!(parts["total"], resource["error"]);
    for name in ["noise", "discretisation"] {
        assert!(parts[name].as_f64().is_some_and(|e| e >= 0.0), "{name} in {parts:?}");
    }
    let squares = parts.iter().filter(|(n, _)| *n != "total").filter_map(|(_, e)| e.as_f64()).map(|e| e * e);
    let together = squares.sum::<f64>().sqrt();
    assert!(error >= together * (1.0 - 1e-9) && error < 3.0 * together, "{parts:?}");
    let timings = &resource["timings"];
    for name in ["queued_ms", "first_frame_ms", "device_ms", "elapsed_ms"] {
        assert!(timings[name].as_f64().is_some_and(|t| t >= 0.0), "{name} in {timings}");
    }
    assert!(timings["queued_ms"].as_f64() <= timings["first_frame_ms"].as_f64());
    assert!(timings["device_ms"].as_f64() > Some(0.0));
    let trace = resource["trace"].as_array().unwrap();
    let last = trace.last().unwrap();
    assert_eq!((&last["samples"], &last["error"], &last["stride"]), (&json!(9), &resource["error"], &json!(1)));
    for name in ["elapsed_ms", "samples"] {
        assert!(trace.windows(2).all(|w| w[0][name].as_f64() <= w[1][name].as_f64()), "{name} falls in {trace:?}");
    }
    assert_eq!(resource["failure"], Value::Null);
}

#[tokio::test]
async fn the_list_has_the_newest_render_first() {
    let server = shared();
    let api = Api::new(&server);
    let (first, second) = (api.start(&small()).await, api.start(&small()).await);
    api.until_state(&first, "done").await;
    api.until_state(&second, "done").await;
    let list = api.get_json("/v1/renders").await;
    let list = list["renders"].as_array().unwrap();
    let place = |path: &str| list.iter().position(|r| path.ends_with(r["id"].as_str().unwrap())).unwrap();
    assert!(place(&second) < place(&first), "newest first");
    let entry = &list[place(&first)];
    assert_eq!((&entry["state"], &entry["samples"]), (&json!("done"), &json!(4)));
    assert!(entry["error"].as_f64().is_some());
}

#[tokio::test]
async fn frame_png_has_a_strong_tag_and_answers_304_to_who_has_it() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&small()).await;
    let frame = format!("{path}/frame.png");
    // ?wait=final blocks until the render is done. Asked for at once, it gives the last frame.
    let response = api.get(&format!("{frame}?wait=final")).await;
    assert_eq!(response.status(), 200);
    check_frame_headers(response.headers(), "4");
    let etag = response.headers()["etag"].to_str().unwrap().to_owned();
    let png = response.bytes().await.unwrap();
    assert_eq!(api.get(&frame).await.bytes().await.unwrap(), png);
    for (tags, status) in
        [(etag.clone(), 304), (format!("\"other\", {etag}"), 304), ("*".into(), 304), ("\"other\"".into(), 200)]
    {
        let response = api.request(Method::GET, &frame).header("If-None-Match", &tags).send().await.unwrap();
        assert_eq!(response.status(), status, "for {tags}");
        assert_eq!(response.headers()["etag"], etag);
        assert_eq!(response.bytes().await.unwrap().is_empty(), status == 304);
    }
    // The tag depends on the inputs of the bytes, not on the render: another render of the same request has the same tag.
    let other = api.post(&small(), "image/png").await;
    assert_eq!(other.headers()["etag"], etag);
}

#[tokio::test]
async fn frame_png_of_a_running_render_is_not_final() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let response = api.get(&format!("{path}/frame.png")).await;
    assert_eq!(response.status(), 200);
    assert_eq!(response.headers()["x-cloudchamber-final"], "false");
    assert!(colours(&response.bytes().await.unwrap()) > 50);
    assert_eq!(api.delete(&path).await.status(), 200);
}

#[tokio::test]
async fn events_tell_progress_and_the_end_and_resume_where_a_client_left() {
    let server = shared();
    let api = Api::new(&server);
    let body = json!({"technique": "emission_absorption", "image": {"width": 256, "height": 256}, "budget": {"time_ms": 1000}});
    let path = api.start(&body).await;
    let response = api.get(&format!("{path}/events")).await;
    assert_eq!(response.headers()["content-type"], "text/event-stream");
    let events_seen = events(&response.text().await.unwrap());
    let (last, before) = events_seen.split_last().unwrap();
    assert!(before.len() >= 2, "a second of rendering has more than {} events", events_seen.len());
    assert!(before.iter().all(|(name, _, data)| name == "progress" && data["final"] == false), "{before:?}");
    assert_eq!(last.0, "final");
    assert_eq!(
        (&last.2["final"], &last.2["stopped_by"], &last.2["state"]),
        (&json!(true), &json!("time"), &json!("done"))
    );
    assert!(events_seen.windows(2).all(|w| w[0].1 < w[1].1), "ids rise");
    assert!(events_seen.windows(2).all(|w| w[0].2["samples"].as_u64() <= w[1].2["samples"].as_u64()));
    assert_eq!(last.2["samples"], api.get_json(&path).await["samples"]);
    // A client that saw an earlier event is told only of the end, and so is a new client, since only the latest event counts.
    for seen in [before[0].1.to_string(), "0".into()] {
        let again = api.request(Method::GET, &format!("{path}/events")).header("Last-Event-ID", &seen);
        let again = events(&again.send().await.unwrap().text().await.unwrap());
        assert_eq!(again, vec![last.clone()]);
    }
}

#[tokio::test]
async fn last_event_id_skips_what_was_seen_of_a_running_render() {
    let server = shared();
    let api = Api::new(&server);
    let body =
        json!({"technique": "emission_absorption", "image": {"width": 128, "height": 128}, "budget": {"time_ms": 800}});
    let path = api.start(&body).await;
    api.until(&path, "at its third frame", |r| r["trace"].as_array().unwrap().len() >= 3).await;
    let resumed = api.request(Method::GET, &format!("{path}/events")).header("Last-Event-ID", "1000000");
    let resumed = events(&resumed.send().await.unwrap().text().await.unwrap());
    assert_eq!(resumed.iter().map(|e| e.0.as_str()).collect::<Vec<_>>(), ["final"], "every frame but the end was seen");
}

#[tokio::test]
async fn convergence_is_a_chart_in_svg() {
    let server = shared();
    let api = Api::new(&server);
    let path = format!("/v1/renders/{}/convergence.svg", api.finish(&small()).await["id"].as_str().unwrap());
    let response = api.get(&path).await;
    assert_eq!(
        (response.status().as_u16(), &response.headers()["content-type"]),
        (200, &"image/svg+xml".parse().unwrap())
    );
    let svg = response.text().await.unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("error") && svg.contains("ms"), "the axes are named");
}

#[tokio::test]
async fn delete_cancels_and_leaves_the_resource_readable() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let deleted = api.delete(&path).await;
    assert_eq!(deleted.status(), 200);
    assert_eq!(deleted.json::<Value>().await.unwrap()["state"], "cancelled");
    assert_eq!(api.get_json(&path).await["state"], "cancelled");
    assert_eq!(api.delete(&path).await.status(), 200, "once more changes nothing");
    problem(api.get(&format!("{path}/frame.png?wait=final")).await, 409, "the last frame of a cancelled render").await;
    // A done render stays done.
    let done = api.finish(&small()).await;
    let path = done["links"]["self"].as_str().unwrap();
    assert_eq!(api.delete(path).await.json::<Value>().await.unwrap()["state"], "done");
    assert_eq!(api.get(&format!("{path}/frame.png")).await.status(), 200);
}

#[tokio::test]
async fn an_idempotency_key_makes_one_render() {
    let server = shared();
    let api = Api::new(&server);
    let post =
        |body: Value| api.request(Method::POST, "/v1/renders").header("Idempotency-Key", "once").json(&body).send();
    let id = |r: Value| r["id"].as_str().unwrap().to_owned();
    let first = id(post(small()).await.unwrap().json().await.unwrap());
    assert_eq!(id(post(small()).await.unwrap().json().await.unwrap()), first);
    api.until_state(&format!("/v1/renders/{first}"), "done").await;
    assert_eq!(id(post(small()).await.unwrap().json().await.unwrap()), first, "also when it is done");
    problem(post(with(small(), "/seed", json!(1))).await.unwrap(), 409, "another body under the same key").await;
    let other = api.request(Method::POST, "/v1/renders").header("Idempotency-Key", "twice").json(&small());
    assert_ne!(id(other.send().await.unwrap().json().await.unwrap()), first);
    // The client retries before the first answer comes.
    let hasty = || api.request(Method::POST, "/v1/renders").header("Idempotency-Key", "hasty").json(&small()).send();
    let answers = futures_util::future::join_all((0..8).map(|_| hasty())).await;
    let mut ids = std::collections::HashSet::new();
    for answer in answers {
        ids.insert(id(answer.unwrap().json().await.unwrap()));
    }
    assert_eq!(ids.len(), 1, "eight at once are one render");
}
