//! The service's information about itself: techniques, device, health, metrics, viewer, and access.

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

#[tokio::test]
async fn every_technique_has_an_example_that_works() {
    let server = shared();
    let api = Api::new(&server);
    let techniques = api.get_json("/v1/techniques").await;
    let techniques = techniques["techniques"].as_array().unwrap();
    let named: Vec<_> = techniques.iter().map(|t| t["name"].as_str().unwrap()).collect();
    assert!(named.contains(&"emission_absorption") && named.contains(&"photon_transport"), "{named:?}");
    for technique in techniques {
        if technique["kind"] == "export" {
            let response = api.post_to("/v1/exports", &technique["example"]).await;
            assert_eq!(response.status(), 202, "{technique}");
            let file = format!("{}/file?wait=final", response.headers()["location"].to_str().unwrap());
            assert!(api.get(&file).await.bytes().await.unwrap().len() > 20, "{technique}");
            continue;
        }
        let png = api.png(&technique["example"]).await;
        assert!(colours(&png) > 20, "{} has {} colours", technique["name"], colours(&png));
    }
}

#[tokio::test]
async fn every_technique_is_described_by_a_closed_schema() {
    let server = shared();
    let api = Api::new(&server);
    let document = api.get_json("/openapi.json").await;
    let [request, export] = ["RenderRequest", "ExportRequest"].map(|name| &document["components"]["schemas"][name]);
    for technique in api.get_json("/v1/techniques").await["techniques"].as_array().unwrap() {
        let name = technique["name"].as_str().unwrap();
        let parent = if technique["kind"] == "view" {
            let names = request["properties"]["technique"]["enum"].as_array().unwrap();
            assert!(names.contains(&technique["name"]), "{name} is not in {names:?}");
            request
        } else if technique["kind"] == "export" {
            export
        } else {
            assert_eq!(technique["kind"], "field");
            &request["properties"]["volume"]
        };
        let whole = if technique["kind"] == "export" { export } else { request };
        let requests = jsonschema::validator_for(whole).unwrap();
        let schema = &technique["schema"];
        let keys = |s: &Value| s["properties"].as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        assert_eq!(keys(&parent["properties"][name]), keys(schema), "{name}");
        jsonschema::validator_for(schema).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(schema["additionalProperties"], false, "{name}");
        for (parameter, described) in schema["properties"].as_object().unwrap() {
            assert!(described["description"].is_string(), "{name}.{parameter} is not described");
        }
        assert!(requests.is_valid(&technique["example"]), "{name}: the example is not what the schema permits");
        assert!(technique["summary"].as_str().is_some_and(|s| s.len() > 10), "{name}");
    }
}

#[tokio::test]
async fn the_device_is_told() {
    let server = shared();
    let device = Api::new(&server).get_json("/v1/device").await;
    for name in ["platform", "device"] {
        assert!(device[name].as_str().is_some_and(|t| !t.is_empty()), "{name} in {device}");
    }
    assert!([1, 4, 8, 16].contains(&device["lanes"].as_u64().unwrap()), "{device}");
}

#[tokio::test]
async fn health_and_readiness_are_told_apart() {
    let server = Server::spawn(&[]);
    let api = Api::new(&server);
    // The process is alive before it is ready. The kernel cache decides if readiness is still to come.
    assert_eq!(api.get("/healthz").await.status(), 200);
    let early = api.get("/readyz").await;
    if early.status() != 200 {
        problem(early, 503, "before the kernels are built").await;
    }
    let started = std::time::Instant::now();
    while api.get("/readyz").await.status() != 200 {
        assert!(started.elapsed() < 3 * PATIENCE);
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
}

/// The value of the first line that starts with `name` and has every one of `labels`.
fn metric(text: &str, name: &str, labels: &[&str]) -> f64 {
    let line = text.lines().find(|l| l.starts_with(name) && labels.iter().all(|label| l.contains(label)));
    let line = line.unwrap_or_else(|| panic!("no {name} {labels:?} in\n{text}"));
    line.rsplit(' ').next().unwrap().parse().unwrap()
}

#[tokio::test]
async fn metrics_count_requests_by_route_and_tell_the_memory() {
    let server = Server::start();
    let api = Api::new(&server);
    api.png(&small()).await;
    for id in 0..5 {
        assert_eq!(api.get(&format!("/v1/renders/{id}")).await.status(), 404);
        assert_eq!(api.get(&format!("/nowhere/{id}")).await.status(), 404);
    }
    let response = api.get("/metrics").await;
    assert!(response.headers()["content-type"].to_str().unwrap().starts_with("text/plain"));
    let text = response.text().await.unwrap();
    let count = |labels: &[&str]| metric(&text, "cloudchamber_http_requests_total", labels);
    assert_eq!(count(&["method=\"POST\"", "route=\"/v1/renders\"", "status=\"200\""]), 1.0);
    assert_eq!(count(&["method=\"GET\"", "route=\"/v1/renders/{id}\"", "status=\"404\""]), 5.0);
    assert!(!text.contains("/nowhere/3"), "a label must not grow with what clients ask for");
    assert_eq!(metric(&text, "cloudchamber_renders_ended_total", &["done"]), 1.0);
    assert_eq!(metric(&text, "cloudchamber_renders_unfinished", &[]), 0.0);
    let (told, seen) = (metric(&text, "process_resident_memory_bytes", &[]), server.resident_bytes() as f64);
    assert!((told - seen).abs() < 0.3 * seen, "told {told}, seen {seen}");
}

#[tokio::test]
async fn odd_methods_do_not_grow_the_metrics() {
    let server = shared();
    let api = Api::new(&server);
    let method = reqwest::Method::from_bytes(b"FROBNICATE").unwrap();
    problem(api.request(method, "/v1/renders").send().await.unwrap(), 405, "a method of one's own").await;
    let text = api.get("/metrics").await.text().await.unwrap();
    assert!(!text.contains("FROBNICATE"), "a client could make any number of time series");
}

#[tokio::test]
async fn the_viewer_is_served_with_a_strict_policy() {
    let server = shared();
    let api = Api::new(&server);
    let page = api.get("/").await;
    assert_eq!(page.status(), 200);
    assert!(page.headers()["content-type"].to_str().unwrap().starts_with("text/html"));
    let policy = page.headers()["content-security-policy"].to_str().unwrap().to_owned();
    assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe"), "{policy}");
    let html = page.text().await.unwrap();
    assert!(!html.contains("://cdn"), "nothing comes from elsewhere");
    // Every local file that the page names is there, with a media type for browsers.
    for (attribute, kind) in [("src=\"", "text/javascript"), ("href=\"", "")] {
        for rest in html.split(attribute).skip(1) {
            let file = rest.split('"').next().unwrap().trim_start_matches(['.', '/']);
            if file.starts_with('#') || file.contains(':') || file.is_empty() {
                continue;
            }
            let response = api.get(&format!("/{file}")).await;
            assert_eq!(response.status(), 200, "{file}");
            assert!(response.headers()["content-type"].to_str().unwrap().starts_with(kind), "{file}");
        }
    }
}

#[tokio::test]
async fn a_token_is_asked_for_on_everything_but_healthz() {
    let server = Server::spawn(&["--token", "sesame"]);
    let api = Api::new(&server);
    assert_eq!(api.get("/healthz").await.status(), 200);
    for path in [
        "/",
        "/readyz",
        "/metrics",
        "/openapi.json",
        "/docs/",
        "/v1/renders",
        "/v1/volumes",
        "/v1/device",
        "/nowhere",
        "/healthz/",
    ] {
        let refused = api.get(path).await;
        assert!(refused.headers().contains_key("www-authenticate"), "{path}");
        problem(refused, 401, path).await;
    }
    problem(api.post(&small(), "image/png").await, 401, "a render").await;
    for (token, admitted) in [("sesame", true), ("Sesame", false), ("", false), ("sesame ", true), ("sesames", false)] {
        let response =
            api.request(reqwest::Method::GET, "/v1/volumes").header("Authorization", format!("Bearer {token}"));
        let status = response.send().await.unwrap().status();
        assert_eq!(status, if admitted { 200 } else { 401 }, "'{token}'");
    }
    let basic = api.request(reqwest::Method::GET, "/").basic_auth("anybody", Some("sesame"));
    assert_eq!(basic.send().await.unwrap().status(), 200, "a browser sends it as a password");
    let basic = api.request(reqwest::Method::GET, "/").basic_auth("sesame", Some("open"));
    assert_eq!(basic.send().await.unwrap().status(), 401);
}

#[tokio::test]
async fn origins_are_let_in_only_by_name() {
    let closed = shared();
    let origin = |r: &reqwest::Response| r.headers().get("access-control-allow-origin").cloned();
    let ask = |api: &Api| api.request(reqwest::Method::GET, "/healthz").header("Origin", "https://example.org").send();
    assert_eq!(origin(&ask(&Api::new(&closed)).await.unwrap()), None);
    let open = Server::spawn(&["--cors-origin", "https://example.org", "--token", "sesame"]);
    let api = Api::new(&open);
    assert_eq!(origin(&ask(&api).await.unwrap()).unwrap(), "https://example.org");
    let other = api.request(reqwest::Method::GET, "/healthz").header("Origin", "https://evil.example").send();
    assert_ne!(origin(&other.await.unwrap()), Some("https://evil.example".parse().unwrap()));
    // A browser's preflight carries no token and must be admitted.
    let preflight = api.request(reqwest::Method::OPTIONS, "/v1/renders").header("Origin", "https://example.org");
    let preflight = preflight.header("Access-Control-Request-Method", "POST");
    let preflight = preflight
        .header("Access-Control-Request-Headers", "content-type,idempotency-key,x-filename")
        .send()
        .await
        .unwrap();
    assert_eq!(preflight.status(), 200);
    let allowed = preflight.headers()["access-control-allow-headers"].to_str().unwrap().to_lowercase();
    for header in ["content-type", "authorization", "idempotency-key", "x-filename", "last-event-id"] {
        assert!(allowed.contains(header), "{header} is not in {allowed}");
    }
    assert_eq!(json!(preflight.headers()["access-control-allow-origin"].to_str().unwrap()), "https://example.org");
}
