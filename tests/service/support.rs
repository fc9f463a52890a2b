//! The common part of the tests of the service: a client, the resource's life, problem documents, multipart parts and pixels.

#![allow(dead_code, reason = "each test file uses its own part of this")]

use std::collections::HashMap;
use std::io::{Cursor, Read, Write};
use std::net::TcpStream;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use reqwest::{Client, Method, RequestBuilder, Response};
use serde_json::{Value, json};

use crate::common::Server;

/// The time after which anything here counts as never.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The server that the tests of one file share. It ends with the last test that holds it. A static would never be dropped, and its process would
/// outlive the tests.
pub fn shared() -> Arc<Server> {
    static SHARED: Mutex<Weak<Server>> = Mutex::new(Weak::new());
    let mut slot = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    slot.upgrade().unwrap_or_else(|| {
        let server = Arc::new(Server::start());
        *slot = Arc::downgrade(&server);
        server
    })
}

/// A client of one server.
pub struct Api {
    pub http: Client,
    pub base: String,
}

impl Api {
    pub fn new(server: &Server) -> Self {
        Self { http: Client::builder().no_proxy().timeout(PATIENCE).build().unwrap(), base: server.url() }
    }

    pub fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.http.request(method, format!("{}{path}", self.base))
    }

    pub async fn get(&self, path: &str) -> Response {
        self.request(Method::GET, path).send().await.unwrap()
    }

    pub async fn get_json(&self, path: &str) -> Value {
        let response = self.get(path).await;
        assert_eq!(response.status(), 200, "GET {path}");
        response.json().await.unwrap()
    }

    pub async fn delete(&self, path: &str) -> Response {
        self.request(Method::DELETE, path).send().await.unwrap()
    }

    pub async fn put(&self, path: &str, body: &Value) -> Response {
        self.request(Method::PUT, path).json(body).send().await.unwrap()
    }

    /// Posts JSON to a path.
    pub async fn post_to(&self, path: &str, body: &Value) -> Response {
        self.request(Method::POST, path).header("Accept", "application/json").json(body).send().await.unwrap()
    }

    /// Posts a render, asking for `accept`.
    pub async fn post(&self, body: &Value, accept: &str) -> Response {
        self.request(Method::POST, "/v1/renders").header("Accept", accept).json(body).send().await.unwrap()
    }

    /// Posts a render and returns its path, `/v1/renders/…`.
    pub async fn start(&self, body: &Value) -> String {
        let response = self.post(body, "application/json").await;
        assert_eq!(response.status(), 202, "{}", response.text().await.unwrap());
        response.headers()["location"].to_str().unwrap().to_owned()
    }

    /// The PNG of a render.
    pub async fn png(&self, body: &Value) -> Vec<u8> {
        let response = self.post(body, "image/png").await;
        assert_eq!(response.status(), 200, "{}", response.text().await.unwrap());
        response.bytes().await.unwrap().to_vec()
    }

    /// Waits until the resource satisfies `wanted`.
    pub async fn until(&self, path: &str, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let started = Instant::now();
        loop {
            let resource = self.get_json(path).await;
            if wanted(&resource) {
                return resource;
            }
            assert!(started.elapsed() < PATIENCE, "{path} never came to be {what}: {resource}");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    pub async fn until_state(&self, path: &str, state: &str) -> Value {
        self.until(path, state, |r| r["state"] == state).await
    }

    /// Runs a render to its end and returns the resource.
    pub async fn finish(&self, body: &Value) -> Value {
        let path = self.start(body).await;
        self.until_state(&path, "done").await
    }

    /// Uploads a volume and returns the answer.
    pub async fn upload(&self, query: &str, bytes: Vec<u8>) -> Response {
        let request = self.request(Method::POST, &format!("/v1/volumes{query}"));
        request.header("Content-Type", "application/octet-stream").body(bytes).send().await.unwrap()
    }
}

/// A render that takes a few tens of milliseconds.
pub fn small() -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 32},
        "image": {"width": 64, "height": 48}, "budget": {"samples": 4},
    })
}

/// A render that no test waits for: half an hour of samples, each of which is soon there.
pub fn endless() -> Value {
    json!({
        "technique": "emission_absorption", "volume": {"builtin": "smoke", "resolution": 128},
        "image": {"width": 256, "height": 256}, "budget": {"samples": 65536},
        "emission_absorption": {"opacity_threshold": 1, "empty_space_skipping": false},
    })
}

/// `value` with the field at `pointer` set. Missing objects on the way are made.
pub fn with(mut value: Value, pointer: &str, field: Value) -> Value {
    let at = pointer.split('/').skip(1).fold(&mut value, |at, name| &mut at[name]);
    *at = field;
    value
}

/// Checks that the answer is a problem document of `status` and returns it.
pub async fn problem(response: Response, status: u16, about: &str) -> Value {
    let (code, headers) = (response.status().as_u16(), response.headers().clone());
    let text = response.text().await.unwrap();
    assert_eq!(code, status, "{about}: {text}");
    check_problem(status, headers.get("content-type").map_or("none", |v| v.to_str().unwrap()), &text, about)
}

/// Checks an answer that came over a bare socket.
pub fn check_problem(status: u16, content_type: &str, body: &str, about: &str) -> Value {
    assert_eq!(content_type, "application/problem+json", "{about}: {body}");
    let problem: Value = serde_json::from_str(body).unwrap_or_else(|e| panic!("{about}: {e} in {body}"));
    assert_eq!(problem["status"], status, "{about}: {body}");
    for field in ["type", "title", "detail"] {
        assert!(problem[field].as_str().is_some_and(|t| !t.is_empty()), "{about}: no {field} in {body}");
    }
    problem
}

/// Checks that a 422 names `pointer` and the permitted values there.
pub fn names(problem: &Value, pointer: &str, about: &str) {
    let errors = problem["errors"].as_array().unwrap();
    let found = errors.iter().find(|e| e["pointer"] == pointer);
    let found = found.unwrap_or_else(|| panic!("{about}: expected {pointer} in {errors:?}"));
    for field in ["detail", "permitted"] {
        assert!(found[field].as_str().is_some_and(|t| !t.is_empty()), "{about}: no {field} in {found}");
    }
}

/// The width, height and 8-bit RGB of a PNG.
pub fn pixels(png: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut rgb).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width, info.height, rgb)
}

/// The number of different colours in a PNG.
pub fn colours(png: &[u8]) -> usize {
    pixels(png).2.chunks_exact(3).collect::<std::collections::HashSet<_>>().len()
}

/// The description in one of our PNGs.
pub fn description(png: &[u8]) -> Value {
    serde_json::from_str(&cloudchamber::frame::read_description(png).unwrap()).unwrap()
}

/// The size and samples of an EXR, as the `exr` crate reads it.
pub fn exr_samples(bytes: &[u8]) -> ([usize; 2], HashMap<String, Vec<f32>>) {
    use exr::prelude::*;
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(bytes)).unwrap();
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list.iter();
    let values = channels.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect();
    ([size.width(), size.height()], values)
}

/// A part of a `multipart/x-mixed-replace` answer.
#[derive(Debug, Clone)]
pub struct Part {
    pub headers: HashMap<String, String>,
    pub body: Vec<u8>,
}

impl Part {
    pub fn number(&self, header: &str) -> f64 {
        self.headers[header].parse().unwrap()
    }

    pub fn is_final(&self) -> bool {
        self.headers["x-cloudchamber-final"] == "true"
    }
}

/// Takes the whole parts off the front of `bytes`. Returns them, and true if the closing boundary came.
pub fn take_parts(bytes: &mut Vec<u8>) -> (Vec<Part>, bool) {
    let mut parts = Vec::new();
    let find = |from: &[u8], what: &[u8]| from.windows(what.len()).position(|w| w == what);
    loop {
        let rest = bytes.strip_prefix(b"\r\n").unwrap_or(bytes);
        if rest.starts_with(b"--frame--\r\n") {
            return (parts, true);
        }
        let Some(rest) = rest.strip_prefix(b"--frame\r\n") else {
            assert!(rest.len() < 11, "no boundary where one belongs");
            return (parts, false);
        };
        let Some(end) = find(rest, b"\r\n\r\n") else { return (parts, false) };
        let text = std::str::from_utf8(&rest[..end]).unwrap();
        let headers: HashMap<String, String> = text
            .split("\r\n")
            .map(|line| line.split_once(": ").unwrap())
            .map(|(n, v)| (n.to_lowercase(), v.to_owned()))
            .collect();
        let length: usize = headers["content-length"].parse().unwrap();
        let Some(body) = rest.get(end + 4..end + 4 + length) else { return (parts, false) };
        parts.push(Part { headers, body: body.to_vec() });
        *bytes = rest[end + 4 + length..].to_vec();
    }
}

/// Reads a multipart answer to its end. Returns the parts, and true if its boundary closed it.
pub async fn all_parts(response: Response) -> (Vec<Part>, bool) {
    assert_eq!(response.status(), 200);
    assert_eq!(response.headers()["content-type"], "multipart/x-mixed-replace; boundary=frame");
    take_parts(&mut response.bytes().await.unwrap().to_vec())
}

/// A server-sent event: name, id, data.
pub type Event = (String, u64, Value);

/// The events of a finished event stream.
pub fn events(text: &str) -> Vec<Event> {
    let field = |event: &str, name: &str| {
        let value = event.lines().find_map(|l| l.strip_prefix(&format!("{name}: "))).unwrap();
        value.to_owned()
    };
    let blocks = text.split("\n\n").filter(|b| b.contains("data:"));
    blocks
        .map(|b| (field(b, "event"), field(b, "id").parse().unwrap(), serde_json::from_str(&field(b, "data")).unwrap()))
        .collect()
}

/// Sends bytes over a bare socket and returns the status, the content type and the body of the answer. `half_closed` ends the sending side, as a
/// client that breaks off does.
pub fn raw(server: &Server, request: &[u8], half_closed: bool) -> (u16, String, String) {
    let mut socket = TcpStream::connect(server.address()).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    // The server may answer and close before it has read all bytes.
    drop(socket.write_all(request));
    if half_closed {
        socket.shutdown(std::net::Shutdown::Write).unwrap();
    }
    read_answer(&mut socket)
}

/// Reads one answer with a Content-Length.
pub fn read_answer(socket: &mut TcpStream) -> (u16, String, String) {
    let mut bytes = Vec::new();
    let mut buffer = [0; 4096];
    loop {
        if let Some(end) = bytes.windows(4).position(|w| w == b"\r\n\r\n") {
            let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
            let header = |name: &str| head.lines().find_map(|l| l.strip_prefix(&format!("{name}: "))).unwrap_or("0");
            if bytes.len() >= end + 4 + header("content-length").parse::<usize>().unwrap() {
                let status = head.split(' ').nth(1).unwrap().parse().unwrap();
                return (status, header("content-type").into(), String::from_utf8_lossy(&bytes[end + 4..]).into());
            }
        }
        match socket.read(&mut buffer) {
            Ok(n) if n > 0 => bytes.extend_from_slice(&buffer[..n]),
            other => panic!("the answer broke off ({other:?}) after {:?}", String::from_utf8_lossy(&bytes)),
        }
    }
}
