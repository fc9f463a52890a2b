//! Bodies that are too large, too slow, too deep, broken, or break off.

use std::io::Write;
use std::net::TcpStream;

use reqwest::Method;
use serde_json::json;

use crate::common::Server;
use crate::support::*;

/// Posts text as JSON.
async fn text(api: &Api, body: impl Into<reqwest::Body>) -> reqwest::Response {
    let request = api.request(Method::POST, "/v1/renders").header("Content-Type", "application/json");
    request.body(body).send().await.unwrap()
}

/// Posts all broken JSON to a server.
pub async fn broken_json(server: &Server) {
    let api = Api::new(server);
    let deep_arrays = "[".repeat(100_000);
    let deep_objects = "{\"a\":".repeat(100_000);
    for body in [
        "",
        "{",
        "nonsense",
        "{\"technique\": \"emission_absorption\"",
        "{\"a\": NaN}",
        "{'a': 1}",
        "{\"a\": 1,}",
        "{} {}",
        &deep_arrays,
        &deep_objects,
    ] {
        let shown: String = body.chars().take(40).collect();
        let told = problem(text(&api, body.to_owned()).await, 400, &shown).await;
        assert!(told["detail"].as_str().unwrap().contains("line 1"), "{shown}: it says where: {told}");
    }
    problem(text(&api, b"{\"technique\": \"\xff\xfe\"}".to_vec()).await, 400, "not UTF-8").await;
    for body in ["[]", "null", "7", "\"emission_absorption\""] {
        let told = problem(text(&api, body).await, 422, body).await;
        assert_eq!(told["errors"][0]["pointer"], "", "{body}");
    }
}

#[tokio::test]
async fn broken_json_is_400_and_says_where() {
    broken_json(&shared()).await;
}

#[tokio::test]
async fn announced_bodies_past_the_limit_are_413_before_they_are_sent() {
    let server = shared();
    for (path, kind, length) in [
        ("/v1/renders", "application/json", "1048577"),
        ("/v1/volumes", "application/octet-stream", "5000000000"),
        ("/v1/volumes", "application/octet-stream", "9223372036854775807"),
    ] {
        let head =
            format!("POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n\r\n");
        let (status, kind, body) = raw(&server, head.as_bytes(), false);
        assert_eq!(status, 413, "{length}: {body}");
        let told = check_problem(status, &kind, &body, length);
        assert!(told["detail"].as_str().unwrap().contains("limit of 1"), "the limit is told: {told}");
    }
}

#[tokio::test]
async fn streamed_bodies_past_the_limit_are_413_when_they_pass_it() {
    let server = Server::start_with(&["--max-body-bytes", "300000"]);
    for (path, kind, limit) in
        [("/v1/renders", "application/json", 1 << 20), ("/v1/volumes", "application/octet-stream", 300_000)]
    {
        let mut request = format!(
            "POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\nTransfer-Encoding: chunked\r\n\r\n{:x}\r\n",
            limit + 1
        )
        .into_bytes();
        request.resize(request.len() + limit + 1, b' ');
        let (status, kind, body) = raw(&server, &request, false);
        assert_eq!(status, 413, "{body}");
        check_problem(status, &kind, &body, path);
    }
    // A body at the limit is read, and is wrong for another reason.
    let api = Api::new(&server);
    problem(text(&api, vec![b' '; 1 << 20]).await, 400, "blanks up to the limit").await;
}

#[tokio::test]
async fn bodies_that_stop_coming_are_408() {
    let server = Server::start_with(&["--request-timeout-ms", "300"]);
    for (path, kind) in [("/v1/renders", "application/json"), ("/v1/volumes", "application/octet-stream")] {
        for framing in [
            "Content-Length: 100\r\n\r\n{",
            "Transfer-Encoding: chunked\r\n\r\n1\r\n{\r\n",
            "Content-Length: 100\r\n\r\n",
        ] {
            let request = format!("POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\n{framing}");
            let (status, kind, body) = raw(&server, request.as_bytes(), false);
            assert_eq!(status, 408, "{path} {framing}: {body}");
            check_problem(status, &kind, &body, path);
        }
    }
    // A body that comes in pieces, each in time, is read: the patience is for silence.
    let body = small().to_string();
    let mut socket = TcpStream::connect(server.address()).unwrap();
    let head = "POST /v1/renders HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n";
    socket.write_all(format!("{head}Content-Length: {}\r\n\r\n", body.len()).as_bytes()).unwrap();
    for piece in body.as_bytes().chunks(body.len().div_ceil(6)) {
        std::thread::sleep(std::time::Duration::from_millis(80));
        socket.write_all(piece).unwrap();
    }
    assert_eq!(read_answer(&mut socket).0, 202);
}

#[tokio::test]
async fn bodies_that_break_off_harm_nobody() {
    let server = shared();
    for framing in [
        "Content-Length: 100\r\n\r\n{",
        "Transfer-Encoding: chunked\r\n\r\nffff\r\n{",
        "Transfer-Encoding: chunked\r\n\r\nzz\r\n",
    ] {
        let request = format!("POST /v1/renders HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n{framing}");
        let mut socket = TcpStream::connect(server.address()).unwrap();
        socket.write_all(request.as_bytes()).unwrap();
        drop(socket);
    }
    let request = "POST /v1/renders HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n";
    let (status, kind, body) = raw(&server, request.as_bytes(), false);
    check_problem(status, &kind, &body, "a bad chunk");
    assert_eq!(status, 400);
    assert_eq!(Api::new(&server).get("/healthz").await.status(), 200);
}

#[tokio::test]
async fn a_full_body_of_legal_but_absurd_json_is_refused_quickly() {
    let server = shared();
    let api = Api::new(&server);
    // The bodies have a megabyte of unknown fields, of points, or of numbers, each within the limit of bytes.
    let fields: serde_json::Map<_, _> = (0..40_000).map(|i| (format!("field{i}"), json!(i))).collect();
    let many = serde_json::Value::Object(fields);
    let told =
        problem(api.post(&with(small(), "/emission_absorption", many), "image/png").await, 422, "40,000 fields").await;
    assert!(told.to_string().len() < 1 << 20, "the answer is not larger than the question");
    let points: Vec<_> = (0..10_000).map(|i| json!({"value": i, "color": [0, 0, 0], "opacity_per_unit": 0})).collect();
    let body = with(small(), "/emission_absorption/transfer_function/points", json!(points));
    let at = "/emission_absorption/transfer_function/points";
    names(&problem(api.post(&body, "image/png").await, 422, "10,000 points").await, at, "10,000 points");
    let body = with(small(), "/camera/camera_to_world", json!(vec![1; 100_000]));
    names(
        &problem(api.post(&body, "image/png").await, 422, "100,000 numbers").await,
        "/camera/camera_to_world",
        "numbers",
    );
}
