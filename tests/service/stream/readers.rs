//! The readers of frames: to the end, many at once, or not at all.

use std::io::Write;
use std::net::TcpStream;

use futures_util::StreamExt;
use futures_util::future::join_all;
use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

/// A render of about `time_ms`, with pictures that hardly compress.
fn lasting_ms(time_ms: u64, side: u32) -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 64},
        "image": {"width": side, "height": side}, "budget": {"time_ms": time_ms},
    })
}

#[tokio::test]
async fn frames_have_their_headers_never_fall_and_end_with_the_final_one() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&lasting_ms(1500, 384)).await;
    let (parts, closed) = all_parts(api.get(&format!("{path}/frames")).await).await;
    assert!(closed, "the stream ends by its boundary");
    assert!(parts.len() >= 3, "a render of 1.5 s has more than {} frames", parts.len());
    let (last, before) = parts.split_last().unwrap();
    assert!(last.is_final() && !before.iter().any(Part::is_final), "only the last is final");
    for part in &parts {
        assert_eq!(part.headers["content-type"], "image/png");
        // Of a preview with a longer step no error is known.
        let is_known = part.headers["x-cloudchamber-error"] != "unknown";
        assert!(!is_known || part.number("x-cloudchamber-error") >= 0.0);
        assert!(is_known || !part.is_final());
        assert_eq!(pixels(&part.body).0, 384, "every frame has the full size");
        assert_eq!(description(&part.body)["samples"], part.number("x-cloudchamber-samples") as u64);
    }
    for name in ["x-cloudchamber-samples", "x-cloudchamber-elapsed-ms"] {
        assert!(parts.windows(2).all(|w| w[0].number(name) <= w[1].number(name)), "{name} falls");
    }
    assert_eq!(last.body, api.get(&format!("{path}/frame.png")).await.bytes().await.unwrap());
    // A reader who comes when all is over gets the final frame, and the end.
    let (late, closed) = all_parts(api.get(&format!("{path}/frames")).await).await;
    assert!(closed && late.len() == 1 && late[0].body == last.body);
}

#[tokio::test]
async fn a_stream_is_not_compressed() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&small()).await;
    let frames = api.request(reqwest::Method::GET, &format!("{path}/frames")).header("Accept-Encoding", "gzip");
    assert!(!frames.send().await.unwrap().headers().contains_key("content-encoding"), "gzip would hold frames back");
}

#[tokio::test]
async fn the_first_frame_comes_long_before_the_last() {
    let server = shared();
    let api = Api::new(&server);
    let mut stream = api.post(&endless(), "multipart/x-mixed-replace").await.bytes_stream();
    let mut bytes = Vec::new();
    let mut parts = Vec::new();
    // A part must be complete, with the boundary behind it, as soon as it is there, since a browser shows it only then.
    while parts.len() < 2 {
        bytes.extend_from_slice(&stream.next().await.unwrap().unwrap());
        parts.extend(take_parts(&mut bytes).0);
        assert!(!parts.is_empty() || bytes.len() < 8 << 20);
    }
    assert!(!parts[0].is_final());
    assert!(bytes.starts_with(b"\r\n--frame\r\n") || bytes.len() < 11, "the boundary comes with the part");
}

/// Opens a stream and reads no byte of it.
fn stalled(server: &Server, path: &str) -> TcpStream {
    let mut socket = TcpStream::connect(server.address()).unwrap();
    socket.write_all(format!("GET {path} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes()).unwrap();
    socket
}

#[tokio::test]
async fn clients_that_stop_reading_cost_no_growing_memory_and_delay_nobody() {
    const STALLED: usize = 48;
    let server = Server::start();
    let api = Api::new(&server);
    let colourful = json!({"transfer_function": {"preset": "hls"}});
    let path = api.start(&with(lasting_ms(600_000, 512), "/emission_absorption", colourful)).await;
    let stuck: Vec<_> = (0..STALLED).map(|_| stalled(&server, &format!("{path}/frames"))).collect();
    let mut reader = api.get(&format!("{path}/frames")).await.bytes_stream();
    let (mut bytes, mut frames, mut size, mut before) = (Vec::new(), 0, 0, 0);
    while frames < 70 {
        bytes.extend_from_slice(&reader.next().await.unwrap().unwrap());
        for part in take_parts(&mut bytes).0 {
            frames += 1;
            size += part.body.len();
            if frames == 10 {
                before = server.resident_bytes();
            }
        }
    }
    // A server that keeps frames for each reader would hold 60 of them 48 times. The memory that is bounded by the number of readers alone (the
    // frame in hand, the socket's buffers) was taken before the tenth frame. The allowance is a tenth of the leak.
    let growth = server.resident_bytes().saturating_sub(before);
    let leak = (size / frames * 60 * STALLED) as u64;
    assert!(leak > 100 << 20, "the pictures are too small to tell: {leak} bytes");
    assert!(growth < (leak / 10).max(32 << 20), "{} MiB more", growth >> 20);
    assert_eq!(api.png(&small()).await, Api::new(&shared()).png(&small()).await, "others are served");
    drop(stuck);
    api.delete(&path).await;
}

#[tokio::test]
async fn two_hundred_streams_on_one_render_all_get_the_final_frame() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&lasting_ms(3000, 128)).await;
    let streams = join_all((0..200).map(|_| async { all_parts(api.get(&format!("{path}/frames")).await).await })).await;
    let last = api.get(&format!("{path}/frame.png")).await.bytes().await.unwrap();
    let mut progressive = 0;
    for (parts, closed) in streams {
        assert!(closed);
        assert_eq!(parts.last().unwrap().body, last);
        assert_eq!(parts.iter().filter(|p| p.is_final()).count(), 1);
        progressive += usize::from(parts.len() > 1);
    }
    assert!(progressive > 100, "only {progressive} of 200 saw the picture refine");
}

#[tokio::test]
async fn streams_past_the_limit_are_refused_and_the_places_come_back() {
    let server = Server::start_with(&["--max-streams", "3"]);
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let mut open = Vec::new();
    for _ in 0..3 {
        open.push(api.get(&format!("{path}/frames")).await);
        assert_eq!(open.last().unwrap().status(), 200);
    }
    let refused = api.get(&format!("{path}/events")).await;
    assert!(refused.headers()["retry-after"].to_str().unwrap().parse::<u64>().unwrap() >= 1);
    problem(refused, 429, "a fourth stream").await;
    // A render without its stream must not run on for nobody.
    problem(api.post(&small(), "multipart/x-mixed-replace").await, 429, "a render with a fourth stream").await;
    problem(api.post(&small(), "image/png").await, 429, "a render that waits").await;
    let left = api.get_json("/v1/renders").await;
    let live = left["renders"].as_array().unwrap().iter().filter(|r| r["state"] == "running" || r["state"] == "queued");
    assert_eq!(live.count(), 1, "{left}");
    drop(open);
    let started = std::time::Instant::now();
    while api.get(&format!("{path}/frame.png")).await.status() != 200 {
        assert!(started.elapsed() < PATIENCE, "the places never come back");
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    api.delete(&path).await;
}

#[tokio::test]
async fn streams_and_events_end_when_their_render_is_cancelled() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let (frames, told) = (api.get(&format!("{path}/frames")).await, api.get(&format!("{path}/events")).await);
    api.until(&path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
    api.delete(&path).await;
    let (parts, _) = all_parts(frames).await;
    assert!(!parts.iter().any(Part::is_final), "no frame of it is final");
    let told = events(&told.text().await.unwrap());
    assert_eq!(told.last().unwrap().0, "cancelled");
}

/// Waits until the newest endless render of that size has the state.
async fn newest_becomes(api: &Api, side: u32, state: &str) {
    let started = std::time::Instant::now();
    loop {
        let list = api.get_json("/v1/renders").await;
        let newest = list["renders"].as_array().unwrap().iter().find(|r| r["image"] == json!([side, side]));
        if newest.is_some_and(|r| r["state"] == state) {
            return;
        }
        assert!(started.elapsed() < PATIENCE, "not {state}: {newest:?}");
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn a_client_that_goes_away_takes_the_render_it_waits_for_along() {
    let server = shared();
    let api = Api::new(&server);
    for (side, accept) in [(250u32, "image/png"), (251, "multipart/x-mixed-replace"), (252, "image/x-exr")] {
        let body = with(endless(), "/image", json!({"width": side, "height": side})).to_string();
        let mut socket = TcpStream::connect(server.address()).unwrap();
        let head =
            format!("POST /v1/renders HTTP/1.1\r\nHost: x\r\nAccept: {accept}\r\nContent-Type: application/json\r\n");
        socket.write_all(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes()).unwrap();
        newest_becomes(&api, side, "running").await;
        drop(socket);
        newest_becomes(&api, side, "cancelled").await;
    }
}

#[tokio::test]
async fn a_reader_that_goes_away_leaves_the_render_to_others() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.start(&endless()).await;
    let mut stream = api.get(&format!("{path}/frames")).await.bytes_stream();
    stream.next().await.unwrap().unwrap();
    drop(stream);
    let samples = api.get_json(&path).await["samples"].as_u64();
    api.until(&path, "further on", |r| r["state"] == "running" && r["samples"].as_u64() > samples).await;
    api.delete(&path).await;
}
