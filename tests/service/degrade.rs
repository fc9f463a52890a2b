//! A server with a faulty device: fewer lanes, a kernel that does not build, or no device at all.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::common::Server;
use serde_json::{Value, json};

/// The kernels with `text` before one of them.
fn kernels_with(name: &str, text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let all = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels");
    std::fs::create_dir(folder.path().join("shared")).unwrap();
    for sub in ["", "shared"] {
        let files = std::fs::read_dir(all.join(sub)).unwrap().map(|entry| entry.unwrap().path());
        for file in files.filter(|path| path.is_file()) {
            let to: PathBuf = folder.path().join(sub).join(file.file_name().unwrap());
            let before = if to.ends_with(name) { text } else { "" };
            std::fs::write(to, format!("{before}\n{}", std::fs::read_to_string(&file).unwrap())).unwrap();
        }
    }
    folder
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap()
}

fn get(url: &str) -> (u16, Value) {
    runtime().block_on(async {
        let reply = reqwest::get(url).await.unwrap();
        (reply.status().as_u16(), reply.json().await.unwrap())
    })
}

/// The status and body of an awaited render: a PNG's size, or the problem.
fn render(server: &Server, request: &Value) -> (u16, Value) {
    let post = reqwest::Client::new().post(format!("{}/v1/renders", server.url())).header("Accept", "image/png");
    runtime().block_on(async {
        let reply = post.json(request).send().await.unwrap();
        let (status, bytes) = (reply.status().as_u16(), reply.bytes().await.unwrap());
        (status, serde_json::from_slice(&bytes).unwrap_or_else(|_| json!(bytes.len())))
    })
}

fn picture(shading: bool) -> Value {
    json!({"technique": "emission_absorption", "volume": {"builtin": "sphere", "resolution": 12}, "image": {"width": 9, "height": 7},
        "budget": {"samples": 1}, "emission_absorption": {"shading": shading}})
}

#[test]
fn fewer_lanes_are_tried_where_the_first_kernels_do_not_build() {
    let folder = kernels_with("lanes.h", "#if LANES > 4\n#error \"too many for this compiler\"\n#endif");
    let server = Server::start_with(&["--kernels", folder.path().to_str().unwrap()]);
    let (status, device) = get(&format!("{}/v1/device", server.url()));
    assert_eq!((status, &device["lanes"]), (200, &json!(4)), "{device}");
    let (_, ready) = get(&format!("{}/readyz", server.url()));
    assert_eq!((&ready["lanes"], &ready["level"]), (&device["lanes"], &device["level"]));
    // A device that prefers four lanes at most has nothing to give up.
    let wide = device["native_vector_width_float"].as_u64().unwrap() > 4;
    let gave_up = ready["gave_up"].as_array().unwrap();
    assert_eq!(!gave_up.is_empty(), wide, "{ready}");
    assert!(gave_up.iter().all(|words| words.as_str().unwrap().contains("lanes")), "{ready}");
    assert_eq!(render(&server, &picture(false)).0, 200);
}

#[test]
fn a_kernel_that_does_not_build_takes_only_itself_out() {
    let folder = kernels_with("emission_absorption.cl", "#if SHADED\n#error \"no light here\"\n#endif");
    let server = Server::start_with(&["--kernels", folder.path().to_str().unwrap()]);
    let (status, problem) = render(&server, &picture(true));
    assert_eq!(status, 501, "{problem}");
    let words = problem["detail"].as_str().unwrap();
    // The volume's floats are taken as words.
    assert!(words.contains("emission_absorption u16") && words.contains("SHADED=1"), "{words}");
    assert_eq!(problem["type"], "/problems/kernel-not-available");
    assert_eq!(render(&server, &picture(false)).0, 200);
    // The resource has the same message.
    let url = format!("{}/v1/renders", server.url());
    let made = runtime().block_on(async {
        let post = reqwest::Client::new().post(&url).json(&picture(true));
        post.send().await.unwrap().json::<Value>().await.unwrap()
    });
    let ended = wait_for(&format!("{url}/{}", made["id"].as_str().unwrap()), |r| r["state"] == "failed");
    assert!(ended["failure"].as_str().unwrap().contains("SHADED=1"), "{ended}");
    let ready = wait_for(&format!("{}/readyz", server.url()), |r| r["kernels"]["failed"] != json!([]));
    assert_eq!(ready["status"], "ready", "{ready}");
    assert!(ready["kernels"]["failed"].as_array().unwrap().iter().any(|v| v.as_str().unwrap().contains("SHADED=1")));
}

#[test]
fn a_render_waits_for_its_kernel_and_says_so() {
    let cache = tempfile::tempdir().unwrap();
    let server = Server::start_env(&[], &[("POCL_CACHE_DIR", cache.path().to_str().unwrap())]);
    let request = json!({"technique": "single_scatter", "volume": {"builtin": "sphere", "resolution": 8}, "image": {"width": 9, "height": 7},
        "budget": {"samples": 1}, "single_scatter": {"interpolation": "nearest"}});
    let (url, post) = (format!("{}/v1/renders", server.url()), reqwest::Client::new());
    let made: Value =
        runtime().block_on(async { post.post(&url).json(&request).send().await.unwrap().json().await.unwrap() });
    let url = format!("{url}/{}", made["id"].as_str().unwrap());
    let waiting = wait_for(&url, |r| !r["waits_for"].is_null() || r["state"] == "done");
    assert_eq!(waiting["state"], "queued", "{waiting}");
    assert!(waiting["waits_for"]["kernel"].as_str().unwrap().starts_with("single_scatter f32"), "{waiting}");
    // Other requests are served meanwhile.
    assert_eq!(render(&server, &picture(false)).0, 200);
    let done = wait_for(&url, |r| r["state"] == "done");
    assert_eq!((&done["waits_for"], &done["samples"]), (&Value::Null, &json!(1)));
}

#[test]
fn without_a_device_the_problem_says_what_to_do() {
    let server = Server::spawn(&["--device", "abacus"]);
    let problem = wait_for(&format!("{}/readyz", server.url()), |r| r["detail"].to_string().contains("install"));
    assert_eq!(problem["status"], 503, "{problem}");
    for problem in [problem, get(&format!("{}/v1/device", server.url())).1, render(&server, &picture(false)).1] {
        let words = problem["detail"].as_str().unwrap();
        assert!(words.contains("pocl-opencl-icd") && words.contains("--device"), "{words}");
    }
}

/// A document, once it satisfies `wanted`.
fn wait_for(url: &str, wanted: impl Fn(&Value) -> bool) -> Value {
    let started = Instant::now();
    loop {
        let (_, found) = get(url);
        if wanted(&found) {
            return found;
        }
        assert!(started.elapsed() < Duration::from_secs(120), "not in two minutes: {found}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
