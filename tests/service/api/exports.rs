//! `/v1/exports`: post, follow, fetch the file, cancel, and refused requests; and `export` on the command line.

use std::process::Command;

use futures_util::StreamExt;
use reqwest::Method;
use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

fn request() -> Value {
    json!({"technique": "histogram", "volume": {"builtin": "sphere", "resolution": 32}, "histogram": {"bins": 4}})
}

async fn post(api: &Api, body: &Value) -> (u16, Value, String) {
    let response = api.post_to("/v1/exports", body).await;
    let location = response.headers().get("location").map_or("", |v| v.to_str().unwrap()).to_owned();
    (response.status().as_u16(), response.json().await.unwrap(), location)
}

#[tokio::test]
async fn an_export_is_a_job_with_a_file() {
    let server = shared();
    let api = Api::new(&server);
    let (status, resource, location) = post(&api, &request()).await;
    assert_eq!((status, resource["links"]["self"].as_str()), (202, Some(location.as_str())));
    let response = api.get(&format!("{location}/file?wait=final")).await;
    assert_eq!((response.status().as_u16(), &response.headers()["content-type"]), (200, &"text/csv".parse().unwrap()));
    let disposition = response.headers()["content-disposition"].to_str().unwrap().to_owned();
    assert!(disposition.ends_with(&format!("{}.csv\"", resource["id"].as_str().unwrap())), "{disposition}");
    let table = response.text().await.unwrap();
    assert_eq!(table.lines().count(), 5, "{table}");
    let done = api.get_json(&location).await;
    assert_eq!((done["state"].as_str(), done["progress"]["of"].as_str()), (Some("done"), Some("voxels")));
    assert_eq!((&done["progress"]["done"], &done["file"]["bytes"]), (&json!(32768), &json!(table.len())));
    assert!(done["timings"]["device_ms"].as_f64().unwrap() > 0.0 && done["result"]["voxels"] == 32768, "{done}");
    // It is an export and no render.
    let listed = |list: &Value, kind: &str| list[kind].as_array().unwrap().iter().any(|e| e["id"] == done["id"]);
    assert!(
        listed(&api.get_json("/v1/exports").await, "exports") && !listed(&api.get_json("/v1/renders").await, "renders")
    );
    let id = done["id"].as_str().unwrap();
    for path in [format!("/v1/renders/{id}"), format!("/v1/renders/{id}/frame.png"), "/v1/exports/none".into()] {
        assert_eq!(api.get(&path).await.status(), 404, "{path}");
    }
    let render = api.start(&small()).await;
    assert_eq!(api.get(&render.replace("renders", "exports")).await.status(), 404, "a render is no export");
}

#[tokio::test]
async fn its_events_rise_to_the_final_one() {
    let server = shared();
    let api = Api::new(&server);
    let field = json!({"photon_transport": {"photons": 400_000, "grid": [24, 24, 24]}});
    let (_, _, location) = post(&api, &json!({"technique": "histogram", "volume": field})).await;
    let mut stream = api.get(&format!("{location}/events")).await.bytes_stream();
    let mut text = String::new();
    while let Some(piece) = stream.next().await {
        text += &String::from_utf8_lossy(&piece.unwrap());
    }
    let data: Vec<Value> =
        text.lines().filter_map(|l| l.strip_prefix("data: ")).map(|d| serde_json::from_str(d).unwrap()).collect();
    assert!(text.contains("event: final") && data.last().unwrap()["state"] == "done", "{text}");
    let photons: Vec<u64> = data
        .iter()
        .filter(|d| d["progress"]["of"] == "photons")
        .map(|d| d["progress"]["done"].as_u64().unwrap())
        .collect();
    assert!(photons.windows(2).all(|w| w[0] <= w[1]), "{photons:?}");
}

#[tokio::test]
async fn a_cancelled_export_ends_and_has_no_file() {
    let server = shared();
    let api = Api::new(&server);
    let field = json!({"photon_transport": {"photons": 100_000_000, "grid": [24, 24, 24]}});
    let (_, _, location) = post(&api, &json!({"technique": "histogram", "volume": field})).await;
    let early = api.get(&format!("{location}/file")).await;
    assert_eq!(early.status(), 409, "it is not there yet");
    assert_eq!(api.delete(&location).await.status(), 200);
    assert_eq!(api.get_json(&location).await["state"], "cancelled");
    assert_eq!(api.get(&format!("{location}/file?wait=final")).await.status(), 409);
    // The device is free.
    let (_, _, next) = post(&api, &request()).await;
    assert_eq!(api.get(&format!("{next}/file?wait=final")).await.status(), 200);
}

#[tokio::test]
async fn mistakes_are_told_with_their_field() {
    let server = shared();
    let api = Api::new(&server);
    for (body, pointer) in [
        (json!({"technique": "slice"}), "/technique"),
        (json!({"technique": "histogram", "histogram": {"bins": 0}}), "/histogram/bins"),
        (json!({"technique": "histogram", "histogram": {"bins": 70_000}}), "/histogram/bins"),
        (json!({"technique": "histogram", "histogram": {"range": [2, 1]}}), "/histogram/range/1"),
        (json!({"technique": "histogram", "histogram": {"width": 2}}), "/histogram/width"),
        (json!({"technique": "histogram", "volume": {"builtin": "teapot"}}), "/volume/builtin"),
        (json!({"technique": "histogram", "volume": {"id": "none"}}), "/volume/id"),
        (json!({"technique": "histogram", "camera": {}}), "/camera"),
        (json!({"volume": {"builtin": "smoke"}}), "/technique"),
        (json!([1]), ""),
    ] {
        let (status, problem, _) = post(&api, &body).await;
        let pointers: Vec<&str> =
            problem["errors"].as_array().unwrap().iter().map(|e| e["pointer"].as_str().unwrap()).collect();
        assert!(status == 422 && pointers.contains(&pointer), "{body}: {status} {problem}");
    }
    let (status, problem, _) = {
        let response = api.post(&json!({"technique": "histogram"}), "application/json").await;
        (response.status().as_u16(), response.json::<Value>().await.unwrap(), ())
    };
    assert!(status == 422 && problem["errors"][0]["pointer"] == "/technique", "a render of no view: {problem}");
    let (_, _, location) = post(&api, &request()).await;
    assert_eq!(api.get(&format!("{location}/file?wait=maybe")).await.status(), 422);
    assert_eq!(api.request(Method::PUT, &location).send().await.unwrap().status(), 405);
}

#[test]
fn the_command_line_exports_here_and_there() {
    let server = Server::start();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("request.json");
    std::fs::write(&file, request().to_string()).unwrap();
    let run = |more: &[&str], out: &str| {
        let out = folder.path().join(out);
        let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
        command
            .arg("export")
            .arg(&file)
            .arg("-o")
            .arg(&out)
            .args(more)
            .env("POCL_CACHE_DIR", crate::common::kernel_cache());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read_to_string(out).unwrap()
    };
    let here = run(&["--data-dir", folder.path().to_str().unwrap()], "here.csv");
    let there = run(&["--server", &server.url()], "there.csv");
    assert!(here == there && here.lines().count() == 5, "{here}\n{there}");
}
