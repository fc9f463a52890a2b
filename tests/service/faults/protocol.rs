//! Paths, methods, media types: the faults before a body is read.

use reqwest::Method;
use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

const UNKNOWN: [&str; 12] = [
    "/v1/renders/none",
    "/v1/renders/none/frames",
    "/v1/renders/none/frame.png",
    "/v1/renders/none/frame.exr?wait=final",
    "/v1/renders/none/field",
    "/v1/renders/none/events",
    "/v1/renders/none/convergence.svg",
    "/v1/volumes/none",
    "/v1/volumes/..",
    "/nowhere",
    "/v1",
    "/v1/renders/none/nothing",
];

#[tokio::test]
async fn unknown_paths_and_ids_are_404() {
    let server = shared();
    let api = Api::new(&server);
    for path in UNKNOWN {
        problem(api.get(path).await, 404, path).await;
    }
    for path in ["/v1/renders/none", "/v1/volumes/none"] {
        problem(api.delete(path).await, 404, path).await;
    }
    let long = format!("/v1/renders/{}", "x".repeat(5000));
    let told = problem(api.get(&long).await, 404, "a long id").await;
    assert!(told["detail"].as_str().unwrap().len() < 500, "a long id is not thrown back");
}

#[tokio::test]
async fn ids_that_are_not_utf8_are_refused_by_a_problem() {
    let server = shared();
    for path in
        ["/v1/renders/%FF", "/v1/renders/%FF/frames", "/v1/renders/%FF/frame.png", "/v1/volumes/%FF", "/docs/%FF"]
    {
        let (status, kind, body) = raw(&server, format!("GET {path} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes(), false);
        assert!(status == 400 || status == 404, "{path}: {status}");
        check_problem(status, &kind, &body, path);
    }
}

#[tokio::test]
async fn wrong_methods_are_405_and_name_the_right_ones() {
    let server = shared();
    let api = Api::new(&server);
    for (method, path, allowed) in [
        (Method::PUT, "/v1/renders", "POST"),
        (Method::DELETE, "/v1/renders", "GET"),
        (Method::POST, "/v1/renders/none", "DELETE"),
        (Method::GET, "/v1/renders/none/camera", "PUT"),
        (Method::POST, "/v1/renders/none/frames", "GET"),
        (Method::PATCH, "/v1/volumes", "POST"),
        (Method::POST, "/healthz", "GET"),
        (Method::DELETE, "/v1/techniques", "GET"),
    ] {
        let response = api.request(method.clone(), path).send().await.unwrap();
        let named = response.headers().get("allow").map_or(String::new(), |v| v.to_str().unwrap().to_owned());
        problem(response, 405, &format!("{method} {path}")).await;
        assert!(named.contains(allowed), "{method} {path}: Allow is '{named}' (RFC 9110, 15.5.6)");
    }
    problem(api.request(Method::POST, "/").send().await.unwrap(), 405, "POST to the viewer").await;
}

#[tokio::test]
async fn answers_that_cannot_be_made_are_406() {
    let server = shared();
    let api = Api::new(&server);
    for accept in ["text/html", "image/webp", "application/json;q=0", "video/*", "image/png;q=0, text/*"] {
        let told = problem(api.post(&small(), accept).await, 406, accept).await;
        assert!(told["detail"].as_str().unwrap().contains("multipart/x-mixed-replace"), "it says what can be made");
    }
}

/// Posts bytes with a content type, if one is given.
async fn typed(api: &Api, path: &str, content_type: Option<&str>, body: &str) -> reqwest::Response {
    let request = api.request(Method::POST, path).body(body.to_owned());
    content_type.map_or(request.try_clone().unwrap(), |t| request.header("Content-Type", t)).send().await.unwrap()
}

#[tokio::test]
async fn bodies_of_another_type_are_415() {
    let server = shared();
    let api = Api::new(&server);
    let body = small().to_string();
    for content_type in
        [Some("text/plain"), Some("application/x-www-form-urlencoded"), Some("nonsense"), Some("image/png"), None]
    {
        problem(typed(&api, "/v1/renders", content_type, &body).await, 415, &format!("{content_type:?}")).await;
    }
    for content_type in ["application/json; charset=utf-8", "Application/JSON", "application/vnd.scene+json"] {
        assert_eq!(typed(&api, "/v1/renders", Some(content_type), &body).await.status(), 202, "{content_type}");
    }
    for content_type in ["multipart/form-data; boundary=x", "application/json"] {
        problem(typed(&api, "/v1/volumes", Some(content_type), "x").await, 415, content_type).await;
    }
}

#[tokio::test]
async fn bad_queries_are_refused_by_name() {
    let server = shared();
    let api = Api::new(&server);
    let path = api.finish(&small()).await["links"]["self"].as_str().unwrap().to_owned();
    for frame in ["frame.png", "frame.exr"] {
        let told = problem(api.get(&format!("{path}/{frame}?wait=forever")).await, 422, frame).await;
        names(&told, "query:wait", frame);
        problem(api.get(&format!("{path}/{frame}?wait=final&wait=final")).await, 400, "twice").await;
    }
}

/// The request goes over a bare socket, since a client library would tidy the path up.
#[test]
fn no_path_leads_out_of_the_viewers_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("site")).unwrap();
    std::fs::write(folder.path().join("site/index.html"), "the viewer").unwrap();
    std::fs::write(folder.path().join("site/.hidden"), "secret").unwrap();
    std::fs::write(folder.path().join("Cargo.toml"), "secret").unwrap();
    let embedded = shared();
    let from_folder = Server::start_with(&["--static", folder.path().join("site").to_str().unwrap()]);
    let absolute = format!("/{}", folder.path().join("Cargo.toml").display());
    for server in [&*embedded, &from_folder] {
        for path in [
            "/../Cargo.toml",
            "/%2e%2e/Cargo.toml",
            "/..%2fCargo.toml",
            "/%2e%2e%2fCargo.toml",
            "/.%2e/Cargo.toml",
            "/./../Cargo.toml",
            "/site/../../Cargo.toml",
            "//etc/passwd",
            "/%2fetc/passwd",
            "/..\\Cargo.toml",
            "/..%5cCargo.toml",
            "/index.html/../../Cargo.toml",
            "/.hidden",
            "/%00",
            "/index.html%00.js",
            "/docs/../Cargo.toml",
            "/docs/%2e%2e/%2e%2e/Cargo.toml",
            "/v1/volumes/..%2f..%2fCargo.toml",
            "/v1/volumes/%2e%2e",
            &absolute,
        ] {
            let (status, kind, body) = raw(server, format!("GET {path} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes(), false);
            assert_eq!(status, 404, "{path}: {body}");
            check_problem(status, &kind, &body, path);
        }
    }
    let (status, _, body) = raw(&from_folder, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", false);
    assert_eq!((status, body.as_str()), (200, "the viewer"), "the folder is served at all");
}

#[test]
fn what_is_not_http_is_dropped_and_harms_nobody() {
    let server = shared();
    let many_headers = format!("GET / HTTP/1.1\r\n{}\r\n", "X: y\r\n".repeat(500));
    let long_header = format!("GET / HTTP/1.1\r\nX: {}\r\n\r\n", "y".repeat(1 << 20));
    for bytes in [
        "\0\0\0\0\r\n\r\n",
        "GET\r\n\r\n",
        "GET / HTTP/9.9\r\n\r\n",
        &many_headers,
        &long_header,
        "\u{16}\u{3}\u{1}hello",
    ] {
        use std::io::{Read, Write};
        let mut socket = std::net::TcpStream::connect(server.address()).unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        drop(socket.write_all(bytes.as_bytes()));
        drop(socket.shutdown(std::net::Shutdown::Write));
        let mut answer = Vec::new();
        drop(socket.read_to_end(&mut answer));
        let answer = String::from_utf8_lossy(&answer);
        let shown: String = bytes.chars().take(30).collect();
        assert!(
            answer.is_empty() || answer.starts_with("HTTP/1.1 4") || answer.starts_with("HTTP/1.1 5"),
            "{shown}: {answer}"
        );
    }
    let (status, _, body) = raw(&server, b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n", false);
    assert_eq!((status, serde_json::from_str::<Value>(&body).unwrap()), (200, json!({"status": "ok"})));
}
