//! A real Chromium behind chromedriver, and a page of the viewer in it.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::actions::{InputSource, KeyAction, KeyActions, MOUSE_BUTTON_LEFT, MouseActions, PointerAction};
use fantoccini::elements::Element;
use fantoccini::key::Key;
use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tempfile::TempDir;

pub const CHROMEDRIVER: &str = "chromedriver";
/// The window is large enough for the panel beside the picture, and small enough to be rendered quickly.
pub const DESKTOP: [u32; 2] = [1024, 640];
pub const PHONE: [u32; 2] = [390, 844];
/// A render of a small picture takes well under a second, but a machine that also compiles takes longer.
pub const PATIENCE: Duration = Duration::from_secs(60);
pub const POLL: Duration = Duration::from_millis(50);
/// The mean difference of two thumbnails, of 255, above which a person sees another picture.
pub const ANOTHER_PICTURE: f64 = 1.0;
/// One step of a drag.
pub const DRAG_STEP: Duration = Duration::from_millis(20);

static ONE_BROWSER: tokio::sync::Mutex<()> = tokio::sync::Mutex::const_new(());

/// A chromedriver on a port of its own. Dropping it ends it and the browsers that it has started, also when a test fails.
pub struct Driver {
    process: Child,
    port: u16,
}

impl Driver {
    pub fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
        let process = Command::new(CHROMEDRIVER)
            .arg(format!("--port={port}"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| panic!("cannot start `{CHROMEDRIVER}` ({e}): install it with `./dev test` or `apt-get install chromium chromium-driver`"));
        let driver = Self { process, port };
        let start = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(start.elapsed() < PATIENCE, "`{CHROMEDRIVER}` does not listen on port {port}");
            std::thread::sleep(POLL);
        }
        driver
    }

    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    /// Shuts chromedriver down. To kill it would leave its Chromium behind; a shutdown ends both.
    pub fn shut_down(&self) -> std::io::Result<()> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(Duration::from_secs(5)))?;
        stream.write_all(b"GET /shutdown HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
        stream.read_to_end(&mut Vec::new()).map(|_| ())
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let asked = self.shut_down();
        let start = Instant::now();
        while asked.is_ok() && start.elapsed() < Duration::from_secs(5) && matches!(self.process.try_wait(), Ok(None)) {
            std::thread::sleep(POLL);
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The viewer in a browser, with its first picture under way. Fields are dropped in this order.
pub struct Page {
    client: Client,
    driver: Driver,
    _server: crate::common::Server,
    _profile: TempDir,
    _turn: tokio::sync::MutexGuard<'static, ()>,
}

impl Page {
    pub async fn open(size: [u32; 2]) -> Self {
        let turn = ONE_BROWSER.lock().await;
        let server = crate::common::Server::start();
        let driver = Driver::start();
        let profile = tempfile::tempdir().expect("a folder for the browser's profile");
        let flags = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-sync",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-dev-shm-usage",
        ];
        let mut args: Vec<String> = flags.iter().map(ToString::to_string).collect();
        args.push(format!("--user-data-dir={}", profile.path().display()));
        args.push(format!("--window-size={},{}", size[0], size[1]));
        let mut chrome = json!({ "args": args });
        if size == PHONE {
            let metrics = json!({ "width": size[0], "height": size[1], "pixelRatio": 1.0, "touch": true });
            chrome["mobileEmulation"] = json!({ "deviceMetrics": metrics });
        }
        let Value::Object(capabilities) =
            json!({ "goog:chromeOptions": chrome, "goog:loggingPrefs": { "browser": "ALL" } })
        else {
            panic!("an object was written above");
        };
        let client = ClientBuilder::new(HttpConnector::new()).capabilities(capabilities).connect(&driver.url()).await;
        let client = client.expect("a session with Chromium");
        client.goto(&server.url()).await.expect("the viewer's page");
        Self { client, driver, _server: server, _profile: profile, _turn: turn }
    }

    pub async fn js(&self, script: &str) -> Value {
        self.client.execute(script, Vec::new()).await.unwrap_or_else(|e| panic!("{script}: {e}"))
    }

    /// Waits until a JavaScript expression is true.
    pub async fn until(&self, what: &str, expression: &str) {
        let start = Instant::now();
        while self.js(&format!("return Boolean({expression})")).await != json!(true) {
            if start.elapsed() > PATIENCE {
                let said = self.js("return ['state', 'alert', 'notice'].map((id) => document.getElementById(id)?.textContent).join(' | ')").await;
                assert!(start.elapsed() <= PATIENCE, "never: {what} ({expression}); the page says: {said}");
            }
            tokio::time::sleep(POLL).await;
        }
    }

    pub async fn settled(&self) {
        self.until("the final frame", "document.querySelector('#picture').dataset.final === 'true'").await;
    }

    /// Makes a change of the picture, and waits for the final frame of the render after it.
    pub async fn after(&self, what: &str, change: impl Future<Output = ()>) -> Vec<f64> {
        let frame = self.js("return Number(document.querySelector('#picture').dataset.frame)").await;
        change.await;
        self.until(what, &format!("Number(document.querySelector('#picture').dataset.frame) > {frame}")).await;
        self.settled().await;
        self.thumbnail().await
    }

    /// The canvas' luminance, 32 × 32.
    pub async fn thumbnail(&self) -> Vec<f64> {
        let script = "
            const small = new OffscreenCanvas(32, 32).getContext('2d');
            small.imageSmoothingQuality = 'high';
            small.drawImage(document.querySelector('#picture'), 0, 0, 32, 32);
            const { data } = small.getImageData(0, 0, 32, 32);
            return Array.from({ length: 1024 }, (_, i) => 0.21 * data[4 * i] + 0.72 * data[4 * i + 1] + 0.07 * data[4 * i + 2]);";
        serde_json::from_value(self.js(script).await).expect("numbers")
    }

    pub async fn find(&self, css: &str) -> Element {
        self.client.find(Locator::Css(css)).await.unwrap_or_else(|e| panic!("{css}: {e}"))
    }

    pub async fn text(&self, css: &str) -> String {
        self.find(css).await.text().await.expect("its text")
    }

    pub async fn select(&self, css: &str, value: &str) {
        self.find(css).await.select_by_value(value).await.unwrap_or_else(|e| panic!("{css} has no {value}: {e}"));
    }

    /// Types into a number box and leaves it, as a person does.
    pub async fn enter(&self, css: &str, text: &str) {
        let element = self.find(css).await;
        self.js(&format!("const e = document.querySelector({}); e.scrollIntoView(); e.select()", json!(css))).await;
        element.send_keys(&format!("{text}{}", char::from(Key::Tab))).await.expect("typing");
    }

    pub async fn press(&self, keys: &[char]) {
        let both = |key: &char| [KeyAction::Down { value: *key }, KeyAction::Up { value: *key }];
        let actions = keys.iter().flat_map(both).fold(KeyActions::new("keys".into()), InputSource::then);
        self.client.perform_actions(actions).await.expect("keys");
    }

    pub async fn drag(&self, css: &str, from: [f64; 2], by: [f64; 2]) {
        let element = self.find(css).await;
        let mut actions = MouseActions::new("mouse".into())
            .then(PointerAction::MoveToElement { element, duration: None, x: from[0], y: from[1] })
            .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT });
        for _ in 0..5 {
            actions = actions.then(PointerAction::MoveBy { duration: Some(DRAG_STEP), x: by[0] / 5.0, y: by[1] / 5.0 });
        }
        self.client
            .perform_actions(actions.then(PointerAction::Up { button: MOUSE_BUTTON_LEFT }))
            .await
            .expect("a drag");
    }

    /// The complaints of the browser, less the refusals that a test provokes, which it logs as failed loads.
    pub async fn complaints(&self) -> Vec<String> {
        let session = self.client.session_id().await.ok().flatten().expect("a session");
        let url = format!("{}/session/{session}/se/log", self.driver.url());
        let reply = reqwest::Client::new()
            .post(url)
            .json(&json!({ "type": "browser" }))
            .send()
            .await
            .expect("the browser's log");
        let log: Value = reply.json().await.expect("JSON");
        let lines = log["value"].as_array().expect("a list of lines");
        let worth_saying = |line: &&Value| {
            line["level"] == "SEVERE"
                && !line["message"].as_str().unwrap_or_default().contains("Failed to load resource")
        };
        lines.iter().filter(worth_saying).map(|line| line["message"].to_string()).collect()
    }

    /// Ends a test. Nothing may have gone wrong unseen.
    pub async fn close(self) {
        assert_eq!(self.complaints().await, Vec::<String>::new(), "the browser's console");
        let _ = self.client.clone().close().await;
    }
}
