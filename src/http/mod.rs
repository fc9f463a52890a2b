//! The HTTP side: routes, negotiation, problem documents, streams. No physics, and the only home of axum.

mod accept;
mod guard;
mod info;
mod openapi;
mod plans;
mod problem;
mod renders;
mod routes;
mod streams;
mod studies;
mod viewer;
mod volumes;

use std::collections::HashMap;
use std::future::Future;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::config::{Config, Limits};
use crate::error::{Error, Result};
use crate::job::Engine;
use crate::plan::Calibrations;
use crate::study::shelf::Shelf;
use crate::volume::Store;

/// Uploads at the same time: each may be as large as the limit of a body.
const UPLOADS: usize = 4;
/// Idempotency keys that are remembered.
const IDEMPOTENCY_KEYS: usize = 4096;
/// After draining, connections that still will not end get this long.
const LAST_WORDS: Duration = Duration::from_secs(3);

/// What every handler shares.
#[derive(Clone)]
pub(crate) struct App {
    engine: Engine,
    store: Arc<Store>,
    studies: Arc<Shelf>,
    calibrations: Arc<Calibrations>,
    limits: Arc<Limits>,
    request_timeout: Duration,
    streams: Arc<Semaphore>,
    /// Uploads that are held in memory at the same time; the others wait unread.
    uploads: Arc<Semaphore>,
    /// Ends every stream when the server stops.
    stop: CancellationToken,
    idempotency: Arc<Mutex<Idempotency>>,
    static_dir: Option<PathBuf>,
    metrics: metrics_exporter_prometheus::PrometheusHandle,
}

/// Idempotency keys with the hash of their body and the render that they made, and the order in which they came.
#[derive(Default)]
struct Idempotency {
    by_key: HashMap<String, (blake3::Hash, String)>,
    order: std::collections::VecDeque<String>,
}

impl Idempotency {
    fn remember(&mut self, key: String, body: blake3::Hash, id: String) {
        if self.order.len() >= IDEMPOTENCY_KEYS
            && let Some(oldest) = self.order.pop_front()
        {
            self.by_key.remove(&oldest);
        }
        self.order.push_back(key.clone());
        self.by_key.insert(key, (body, id));
    }
}

impl App {
    /// A place for a stream or a waiting request.
    fn stream_permit(&self) -> Result<OwnedSemaphorePermit> {
        let open = self.limits.max_streams;
        self.streams.clone().try_acquire_owned().map_err(|_| Error::StreamsFull { open, retry_after_s: 1 })
    }
}

/// Measures the device for the planner; a plan that comes meanwhile waits for it.
async fn calibrate(app: App) {
    if app.engine.ready().await.is_err() {
        return;
    }
    app.engine.compiled().await;
    if let Err(error) = plans::planner(&app).calibrate().await {
        tracing::warn!(%error, "the device is not calibrated");
    }
}

/// A server that is bound and starting.
pub struct Server {
    listener: TcpListener,
    router: axum::Router,
    engine: Engine,
    stop: CancellationToken,
    drain: Duration,
}

impl Server {
    /// Opens the store, starts the engine and binds the address. The device warms up meanwhile; `/readyz` says when.
    ///
    /// # Errors
    /// [`Error::Internal`] with the cause in words.
    pub async fn bind(config: &Config) -> Result<Self> {
        let store = Store::open(&config.device.data_dir().join("volumes"), config.limits.store())?;
        let engine = Engine::start(config.device.device_config(), config.limits.clone())?;
        let stop = CancellationToken::new();
        let app = App {
            engine: engine.clone(),
            store: Arc::new(store),
            calibrations: Arc::new(Calibrations::kept_in(&config.device.data_dir())),
            studies: Arc::new(Shelf::new(config.device.data_dir().join("studies"))),
            limits: Arc::new(config.limits.clone()),
            request_timeout: Duration::from_millis(config.request_timeout_ms),
            streams: Arc::new(Semaphore::new(config.limits.max_streams)),
            uploads: Arc::new(Semaphore::new(UPLOADS)),
            stop: stop.clone(),
            idempotency: Arc::default(),
            static_dir: config.static_dir.clone(),
            metrics: info::recorder()?,
        };
        if config.calibrate {
            tokio::spawn(calibrate(app.clone()));
        }
        let router = routes::router(app, guard::Tokens::read(config)?, &config.cors_origin)?;
        let listener = TcpListener::bind(config.listen)
            .await
            .map_err(|e| Error::internal(format!("cannot listen on {}: {e}", config.listen)))?;
        Ok(Self { listener, router, engine, stop, drain: config.drain() })
    }

    /// The address that it listens on.
    ///
    /// # Errors
    /// [`Error::Internal`] when the socket has none.
    pub fn address(&self) -> Result<std::net::SocketAddr> {
        self.listener.local_addr().map_err(Error::internal)
    }

    /// The engine behind it.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Serves until `signal` comes, then drains: new work is refused, running renders get their time, streams end.
    ///
    /// # Errors
    /// [`Error::Internal`] when the listener fails.
    pub async fn run(self, signal: impl Future<Output = ()> + Send + 'static) -> Result<()> {
        let (engine, stop, drain) = (self.engine.clone(), self.stop.clone(), self.drain);
        let drained = CancellationToken::new();
        let shutdown = {
            let drained = drained.clone();
            async move {
                signal.await;
                tracing::info!("draining");
                engine.drain(drain).await;
                // One moment for the last frames to be written to those who wait for them.
                tokio::time::sleep(Duration::from_millis(50)).await;
                stop.cancel();
                drained.cancel();
            }
        };
        let served = axum::serve(self.listener, self.router).with_graceful_shutdown(shutdown);
        tokio::select! {
            result = async { served.await } => result.map_err(Error::internal),
            () = async { drained.cancelled().await; tokio::time::sleep(LAST_WORDS).await } => Ok(()),
        }
    }
}
