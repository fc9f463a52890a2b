//! `./dev bench delivery`: the cost of a frame beyond its device time, with one client; it needs no data. Prints Markdown.
//!
//! `SIDES=512,1024` measures other sizes, `PICTURES=folder` keeps a frame of each.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;

use std::time::Instant;

use common::Server;
use serde_json::{Value, json};

/// The number of frames of a full turn.
const FRAMES: usize = 25;

/// The way in which a client asks for frames.
#[derive(Clone, Copy)]
enum Way {
    /// A render of its own for each frame: `POST` with `Accept: image/png`.
    Post,
    /// One render whose camera turns: `PUT …/camera`, then the final frame.
    Put,
}

/// One delivered frame.
struct Delivered {
    wall_ms: f64,
    device_ms: f64,
    bytes: usize,
}

struct Client {
    server: Server,
    http: reqwest::Client,
    runtime: tokio::runtime::Runtime,
}

fn camera(frame: usize) -> Value {
    let angle = frame as f64 / FRAMES as f64 * std::f64::consts::TAU;
    json!({"eye": [4.0 * angle.sin(), -4.0 * angle.cos(), 1.3], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 30})
}

fn scene(volume: &str, side: u32, frame: usize) -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"builtin": volume, "resolution": 128}, "image": {"width": side, "height": side},
        "camera": camera(frame), "budget": {"samples": 1}
    })
}

impl Client {
    fn new() -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        Self {
            server: Server::start().once_compiled(),
            http: reqwest::Client::builder().no_proxy().build().unwrap(),
            runtime,
        }
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.server.url())
    }

    /// Sends the requests one after the other. The last reply is the picture.
    fn picture(&self, requests: Vec<reqwest::RequestBuilder>) -> (Delivered, Vec<u8>) {
        let started = Instant::now();
        let (headers, png) = self.runtime.block_on(async {
            let mut last = None;
            for request in requests {
                let reply = request.send().await.unwrap().error_for_status().unwrap();
                last = Some((reply.headers().clone(), reply.bytes().await.unwrap()));
            }
            last.unwrap()
        });
        let wall_ms = started.elapsed().as_secs_f64() * 1e3;
        let device_ms = headers["x-cloudchamber-device-ms"].to_str().unwrap().parse().unwrap();
        (Delivered { wall_ms, device_ms, bytes: png.len() }, png.to_vec())
    }

    fn post(&self, scene: &Value) -> (Delivered, Vec<u8>) {
        self.picture(vec![self.http.post(self.url("/v1/renders")).header("Accept", "image/png").json(scene)])
    }

    fn start(&self, scene: &Value) -> String {
        let post = self.http.post(self.url("/v1/renders")).header("Accept", "application/json").json(scene);
        let reply: Value = self.runtime.block_on(async { post.send().await.unwrap().json().await.unwrap() });
        let path = format!("/v1/renders/{}", reply["id"].as_str().unwrap());
        let first = self.http.get(self.url(&format!("{path}/frame.png?wait=final")));
        self.picture(vec![first]);
        path
    }

    /// A full turn, after a frame of warm-up.
    fn turn(&self, way: Way, volume: &str, side: u32) -> Vec<Delivered> {
        let first = scene(volume, side, 0);
        let keep = |png: &[u8]| {
            let folder = std::env::var_os("PICTURES");
            folder.map(|f| std::fs::write(std::path::Path::new(&f).join(format!("{volume}-{side}.png")), png).unwrap())
        };
        match way {
            Way::Post => {
                keep(&self.post(&first).1);
                (0..FRAMES).map(|frame| self.post(&scene(volume, side, frame)).0).collect()
            }
            Way::Put => {
                let path = self.start(&first);
                let put = |frame| {
                    let put = self.http.put(self.url(&format!("{path}/camera"))).json(&camera(frame));
                    let get = self.http.get(self.url(&format!("{path}/frame.png?wait=final")));
                    self.picture(vec![put, get]).0
                };
                (1..=FRAMES).map(put).collect()
            }
        }
    }
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn main() {
    let sides = std::env::var("SIDES").unwrap_or_else(|_| "512,1024,2048".into());
    let client = Client::new();
    println!(
        "| emission_absorption, 128³, one pass a frame | device ms | delivered ms | delivered − device ms | PNG bytes | frames/s |"
    );
    println!("|---|---|---|---|---|---|");
    for (way, name) in [(Way::Post, "POST, image/png"), (Way::Put, "PUT camera")] {
        for volume in ["smoke", "marschner_lobb"] {
            for side in sides.split(',').map(|side| side.parse::<u32>().unwrap()) {
                let frames = client.turn(way, volume, side);
                let of = |value: fn(&Delivered) -> f64| median(frames.iter().map(value));
                let wall = of(|f| f.wall_ms);
                println!(
                    "| {name}, `{volume}` {side}² | {:.1} | {wall:.1} | {:.1} | {:.0} | {:.1} |",
                    of(|f| f.device_ms),
                    of(|f| f.wall_ms - f.device_ms),
                    of(|f| f.bytes as f64),
                    1e3 / wall,
                );
            }
        }
    }
}
