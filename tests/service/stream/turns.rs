//! The queue and the turns on the device: a full queue, fair turns, cancelled renders.

use std::time::Instant;

use serde_json::{Value, json};

use crate::common::Server;
use crate::support::*;

#[tokio::test]
async fn of_a_hundred_renders_the_65th_is_the_first_refused_and_all_comes_back() {
    let server = Server::start();
    let api = Api::new(&server);
    let large = with(endless(), "/image", json!({"width": 512, "height": 512}));
    // The server is warm: volume, buffers and threads are there before memory is measured.
    let path = api.start(&large).await;
    api.until(&path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
    api.delete(&path).await;
    api.png(&small()).await;
    let before = server.resident_bytes();

    let mut paths = Vec::new();
    for n in 1..=100 {
        let response = api.post(&large, "application/json").await;
        if n <= 64 {
            assert_eq!(response.status(), 202, "render {n} has a place");
            paths.push(response.headers()["location"].to_str().unwrap().to_owned());
            continue;
        }
        assert!(response.headers()["retry-after"].to_str().unwrap().parse::<u64>().unwrap() >= 1);
        problem(response, 429, &format!("render {n}")).await;
    }
    problem(api.get("/readyz").await, 503, "ready with a full queue").await;
    assert_eq!(api.get("/healthz").await.status(), 200, "full is not ill");
    // A bad request is told its fault, or that there is no room, and never anything else.
    let refused = api.post(&json!({"technique": "none"}), "image/png").await.status().as_u16();
    assert!([422, 429].contains(&refused), "{refused}");

    for path in &paths {
        assert_eq!(api.delete(path).await.json::<Value>().await.unwrap()["state"], "cancelled");
    }
    let started = Instant::now();
    while api.get("/readyz").await.status() != 200 {
        assert!(started.elapsed() < PATIENCE, "never ready again");
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    api.png(&small()).await;
    // A cancelled render's newest picture stays readable, so the eight with turns keep 8 MiB each. The buffers of the device and the memory of the
    // 56 others must be gone.
    let growth = server.resident_bytes().saturating_sub(before);
    assert!(growth < 160 << 20, "{} MiB more than before", growth >> 20);
}

#[tokio::test]
async fn finished_renders_are_forgotten_past_the_limits() {
    let server = Server::start_with(&["--keep-renders", "5", "--keep-bytes", "16777216"]);
    let api = Api::new(&server);
    let body = |seed: u32| {
        with(
            with(with(small(), "/image", json!({"width": 512, "height": 512})), "/seed", json!(seed)),
            "/budget/samples",
            json!(2),
        )
    };
    for seed in 0..8 {
        api.png(&body(seed)).await;
    }
    let before = server.resident_bytes();
    let mut first = None;
    for seed in 0..40 {
        let resource = api.finish(&body(seed)).await;
        first.get_or_insert(resource["links"]["self"].as_str().unwrap().to_owned());
    }
    assert!(api.get_json("/v1/renders").await["renders"].as_array().unwrap().len() <= 6);
    problem(api.get(&first.unwrap()).await, 404, "a forgotten render").await;
    // Forty films of 6 MiB each would be 240 MiB.
    let growth = server.resident_bytes().saturating_sub(before);
    assert!(growth < 64 << 20, "{} MiB more", growth >> 20);
}

#[tokio::test]
async fn short_renders_finish_while_long_ones_run() {
    let server = shared();
    let api = Api::new(&server);
    let mut long = Vec::new();
    for _ in 0..3 {
        long.push(api.start(&endless()).await);
    }
    for path in &long {
        api.until(path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
    }
    for seed in 0..3 {
        assert!(colours(&api.png(&with(small(), "/seed", json!(seed))).await) > 50);
    }
    for path in &long {
        let resource = api.get_json(path).await;
        assert_eq!(resource["state"], "running");
        let samples = resource["samples"].as_u64();
        // The long renders all go on, so nobody starves.
        api.until(path, "further on", |r| r["samples"].as_u64() > samples).await;
    }
    for path in &long {
        api.delete(path).await;
    }
}

#[tokio::test]
async fn equal_renders_get_equal_shares_of_the_device() {
    let server = Server::start();
    let api = Api::new(&server);
    let (first, second) = (api.start(&endless()).await, api.start(&endless()).await);
    let device_ms = |r: &Value| r["timings"]["device_ms"].as_f64().unwrap();
    api.until(&first, "a while on", |r| device_ms(r) > 1500.0).await;
    let (a, b) = (device_ms(&api.get_json(&first).await), device_ms(&api.get_json(&second).await));
    // Round robin would give 1. A frame's worth of time and a slow machine's noise are far within 3.
    assert!(a / b < 3.0 && b / a < 3.0, "{a} ms and {b} ms of device time");
}

#[tokio::test]
async fn the_device_is_free_soon_after_a_cancel() {
    let server = Server::start();
    let api = Api::new(&server);
    api.png(&small()).await;
    let mut waits = Vec::new();
    for _ in 0..5 {
        let path = api.start(&endless()).await;
        api.until(&path, "visible", |r| r["samples"].as_u64() >= Some(1)).await;
        assert_eq!(api.delete(&path).await.json::<Value>().await.unwrap()["state"], "cancelled", "at once");
        let next = api.finish(&small()).await;
        waits.push(next["timings"]["queued_ms"].as_f64().unwrap());
        // Nothing of the cancelled render comes after its end.
        let ended = api.get_json(&path).await;
        assert_eq!((&ended["state"], &ended["stopped_by"]), (&json!("cancelled"), &json!(null)));
    }
    // The next render's own account of its wait for the device: 100 ms are promised. Other work on this machine may make some of the five late, but
    // a device that is held makes all of them late.
    let least = waits.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(least < 100.0, "waited {waits:?} ms");
}

/// Scenes with voxels of sides so different that a ray takes millions of steps, and paths that hardly end.
fn endless_work(volume: &Value) -> Vec<Value> {
    let scene = |more: Value| {
        crate::common::with(&json!({"image": {"width": 64, "height": 64}, "budget": {"samples": 4}}), &more)
    };
    let march = |technique: &str, own: Value| scene(json!({"technique": technique, "volume": volume, technique: own}));
    let chamber = |photons: u32| {
        json!({"photon_transport": {"albedo": 0.85, "extinction_scale": 0.22, "march_step_mm": 0.0087, "size_mm": [0.001, 1e6, 485814.7],
            "photons": photons, "grid": [16, 3, 16]}})
    };
    let forward = json!({"photon_transport": {"march_step_mm": 29964.9, "medium": {"mu_s_per_mm": 448787.4, "phase": {"type": "rayleigh"}},
        "photons": 100, "size_mm": [0.001, 112169.9, 525097.8], "tally": "absorbed", "grid": [16, 33, 8]}});
    let trapped = json!({"photon_transport": {"photons": 20_000, "size_mm": [1, 1, 1], "grid": [8, 8, 8],
        "medium": {"mu_a_per_mm": 0, "mu_s_per_mm": 1e6}, "boundary": {"x": "mirror", "y": "mirror", "z": "mirror"}}});
    let white = json!({"medium": {"sigma_t_per_unit": 1e5, "albedo": 1, "phase": {"type": "henyey_greenstein", "g": 0.99}}, "roulette_threshold": 0});
    vec![
        scene(json!({"technique": "isosurface", "volume": chamber(100)})),
        scene(json!({"technique": "isosurface", "volume": chamber(20_000)})),
        scene(json!({"technique": "emission_absorption", "volume": forward})),
        scene(json!({"technique": "projection", "volume": trapped})),
        march("emission_absorption", json!({"step_voxels": 0.05})),
        march("emission_absorption", json!({"step_voxels": 0.05, "order": "back_to_front"})),
        march("isosurface", json!({"isovalue": 0.5, "step_voxels": 0.05})),
        march(
            "isosurface",
            json!({"surfaces": [{"isovalue": 0.3, "opacity": 0.01}, {"isovalue": 0.6, "opacity": 0.01}]}),
        ),
        march("projection", json!({"step_voxels": 0.05, "exact": false, "interpolation": "b_spline"})),
        scene(
            json!({"technique": "volume_path", "volume": {"builtin": "constant", "resolution": 16}, "volume_path": white}),
        ),
    ]
}

/// The device is free within 100 ms of a cancel, whatever the scene.
#[tokio::test]
async fn no_scene_holds_the_device() {
    let server = Server::start();
    let api = Api::new(&server);
    let voxels: Vec<u8> = (0..16 * 3 * 16u32).flat_map(|i| ((i * 37 % 101) as f32 / 100.0).to_le_bytes()).collect();
    let upload = api.request(reqwest::Method::POST, "/v1/volumes?dims=16,3,16&type=f32&spacing=6e-5,333333,30363");
    let volume: Value = upload.body(voxels).send().await.unwrap().json().await.unwrap();
    api.png(&small()).await;
    for body in endless_work(&json!({"id": volume["id"]})) {
        let mut waits = Vec::new();
        for _ in 0..3 {
            let path = api.start(&body).await;
            // Its kernels may have to be compiled first.
            api.until(&path, "running or done", |r| r["state"] != "queued").await;
            tokio::time::sleep(std::time::Duration::from_millis(150)).await;
            api.delete(&path).await;
            let next = api.finish(&small()).await;
            waits.push(next["timings"]["queued_ms"].as_f64().unwrap());
        }
        // Other work on this machine may make some of them late, but a device that is held makes all of them late.
        let least = waits.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least < 100.0, "{body}: waited {waits:?} ms");
    }
}

/// Large fields are made on the device's thread too. Their preparation must not hold up others.
#[tokio::test]
async fn a_large_simulation_does_not_hold_up_a_small_render() {
    let server = shared();
    let api = Api::new(&server);
    let body = json!({
        "technique": "emission_absorption", "image": {"width": 64, "height": 64},
        "volume": {"photon_transport": {"photons": 1_000_000_000, "grid": [256, 256, 256]}},
    });
    let longest = async |seeds: std::ops::Range<u32>| {
        let mut longest: f64 = 0.0;
        for seed in seeds {
            let resource = api.finish(&with(small(), "/seed", json!(seed))).await;
            longest = longest.max(resource["timings"]["elapsed_ms"].as_f64().unwrap());
        }
        longest
    };
    // Its kernels may have to be compiled first, and the machine may have other work.
    longest(100..101).await;
    let before = longest(0..4).await;
    let path = api.start(&body).await;
    let beside = longest(4..12).await;
    assert_eq!(api.get_json(&path).await["state"], "running");
    api.delete(&path).await;
    // Some turns of the other are between its own. A hundred times as long is a sign that something held the device.
    assert!(beside < 100.0 * before.max(20.0), "a render of 64 by 48 pixels took {beside} ms, and {before} ms before");
}

#[tokio::test]
async fn cancelled_renders_give_their_place_in_the_queue_back() {
    let server = Server::start_with(&["--queue", "2"]);
    let api = Api::new(&server);
    for _ in 0..10 {
        let (first, second) = (api.start(&endless()).await, api.start(&endless()).await);
        problem(api.post(&endless(), "application/json").await, 429, "a third of two").await;
        api.delete(&first).await;
        api.delete(&first).await;
        api.delete(&second).await;
        let started = Instant::now();
        while api.get("/readyz").await.status() != 200 {
            assert!(started.elapsed() < PATIENCE, "the places never come back");
        }
        // A second delete must not give a second place back: in the next round two renders fit, and a third does not.
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
}
