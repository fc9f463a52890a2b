//! The HTTP side: routes, negotiation, problem documents, streams. It has no physics, and it is the only home of axum.

mod accept;
mod exports;
mod form;
mod frames;
mod guard;
mod idempotency;
mod info;
mod openapi;
mod operations;
mod plans;
mod problem;
mod projections;
mod renders;
mod routes;
mod sinograms;
mod streams;
mod studies;
mod viewer;
mod volumes;

use std::future::Future;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::body::Body;
use axum::http::Request;
use serde_json::Value;
use tokio::net::TcpListener;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::job::{Engine, Job};
use crate::service::Service;
use crate::study::results::Results;
use idempotency::Idempotency;

/// The number of uploads at the same time. Each may be as large as the limit of a body.
const UPLOADS: usize = 4;
/// The time that unfinished connections still get after draining.
const LAST_WORDS: Duration = Duration::from_secs(3);

/// The state that all handlers share.
#[derive(Clone)]
pub(crate) struct App {
    service: Service,
    studies: Arc<Results>,
    request_timeout: Duration,
    streams: Arc<Semaphore>,
    /// The permits for uploads in memory. Other uploads wait unread.
    uploads: Arc<Semaphore>,
    /// Ends every stream when the server stops.
    stop: CancellationToken,
    idempotency: Arc<Mutex<Idempotency>>,
    static_dir: Option<PathBuf>,
    metrics: metrics_exporter_prometheus::PrometheusHandle,
}

impl App {
    /// The render with an id.
    fn render(&self, id: &str) -> Result<Arc<Job>> {
        let missing = || Error::NotFound { what: "render", id: id.chars().take(64).collect() };
        self.service.engine().job(id).filter(|job| job.is_render()).ok_or_else(missing)
    }

    /// The export with an id.
    fn export(&self, id: &str) -> Result<Arc<Job>> {
        let missing = || Error::NotFound { what: "export", id: id.chars().take(64).collect() };
        self.service.engine().job(id).filter(|job| !job.is_render()).ok_or_else(missing)
    }

    /// The idempotency keys.
    fn idempotency(&self) -> MutexGuard<'_, Idempotency> {
        self.idempotency.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The JSON of a body.
    async fn read_json(&self, request: Request<Body>) -> Result<Value> {
        problem::read_json(request, self.service.limits().max_json_bytes, self.request_timeout).await
    }

    /// A place for a stream or a waiting request.
    fn stream_permit(&self) -> Result<OwnedSemaphorePermit> {
        let open = self.service.limits().max_streams;
        self.streams.clone().try_acquire_owned().map_err(|_| Error::StreamsFull { open, retry_after_s: 1 })
    }
}

/// Measures the device for the planner. A plan that is asked for meanwhile waits for the measurement.
async fn calibrate(service: Service) {
    if service.engine().ready().await.is_err() {
        return;
    }
    service.engine().compiled().await;
    if let Err(error) = service.planner().calibrate().await {
        tracing::warn!(%error, "the device is not calibrated");
    }
}

/// A server that is bound and starting.
pub struct Server {
    listener: TcpListener,
    router: axum::Router,
    service: Service,
    stop: CancellationToken,
    drain: Duration,
}

impl Server {
    /// Starts the service and binds the address. The device warms up meanwhile; `/readyz` tells when it is ready.
    ///
    /// # Errors
    /// [`Error::Internal`] with the cause in words.
    pub async fn bind(config: &Config) -> Result<Self> {
        let data_dir = config.device.data_dir();
        let service = Service::start(config.device.device_config(), &data_dir, config.limits.clone())?;
        let stop = CancellationToken::new();
        let app = App {
            service: service.clone(),
            studies: Arc::new(Results::new(data_dir.join("studies"))),
            request_timeout: Duration::from_millis(config.request_timeout_ms),
            streams: Arc::new(Semaphore::new(config.limits.max_streams)),
            uploads: Arc::new(Semaphore::new(UPLOADS)),
            stop: stop.clone(),
            idempotency: Arc::default(),
            static_dir: config.static_dir.clone(),
            metrics: info::recorder()?,
        };
        if config.calibrate {
            tokio::spawn(calibrate(service.clone()));
        }
        let router = routes::router(app, guard::Tokens::read(config)?, &config.cors_origin)?;
        let listener = TcpListener::bind(config.listen)
            .await
            .map_err(|e| Error::internal(format!("cannot listen on {}: {e}", config.listen)))?;
        Ok(Self { listener, router, service, stop, drain: config.drain() })
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
        self.service.engine()
    }

    /// Serves until `signal` comes, then drains: new work is refused, running renders get their time, and streams end.
    ///
    /// # Errors
    /// [`Error::Internal`] when the listener fails.
    pub async fn run(self, signal: impl Future<Output = ()> + Send + 'static) -> Result<()> {
        let (engine, stop, drain) = (self.service.engine().clone(), self.stop.clone(), self.drain);
        let drained = CancellationToken::new();
        let shutdown = {
            let drained = drained.clone();
            async move {
                signal.await;
                tracing::info!("draining");
                engine.drain(drain).await;
                // The last frames get a moment to be written to those who wait for them.
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
