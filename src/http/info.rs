//! The service's information about itself: techniques, device, health and metrics.

use std::sync::OnceLock;

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use serde_json::{Value, json};

use super::App;
use crate::device::NO_DEVICE;
use crate::error::{Error, Result};
use crate::job::Readiness;
use crate::{render, technique};

/// The recorder of the process's metrics. There is one, however many servers are in the process.
///
/// # Errors
/// [`Error::Internal`] when another recorder is installed.
pub(super) fn recorder() -> Result<PrometheusHandle> {
    static HANDLE: OnceLock<std::result::Result<PrometheusHandle, String>> = OnceLock::new();
    HANDLE
        .get_or_init(|| PrometheusBuilder::new().install_recorder().map_err(|e| e.to_string()))
        .clone()
        .map_err(Error::Internal)
}

/// `GET /v1/techniques`.
pub(super) async fn techniques(State(app): State<App>) -> Json<Value> {
    let one = |t: &technique::Technique| json!({"name": t.name, "kind": t.kind_name(), "summary": t.summary, "schema": render::parameters_schema(t, app.service.limits()), "example": (t.example)()});
    Json(json!({"techniques": technique::all().map(one).collect::<Vec<_>>()}))
}

/// `GET /v1/device`.
pub(super) async fn device(State(app): State<App>) -> Result<Response> {
    match app.service.engine().readiness() {
        Readiness::Ready(info) => {
            let mut all = serde_json::to_value(&*info).map_err(Error::internal)?;
            all["kernels"] = json!(app.service.engine().kernels());
            Ok(Json(all).into_response())
        }
        Readiness::Starting => Err(Error::Unavailable("the device is being opened".into())),
        Readiness::Failed(_) => Err(Error::Unavailable(NO_DEVICE.into())),
    }
}

/// `GET /healthz`: the process is alive.
pub(super) async fn healthz() -> Json<Value> {
    Json(json!({"status": "ok"}))
}

/// `GET /readyz`: success if the first picture can be rendered, the queue has room, and the server is not draining. The reply also has the progress
/// of other kernels and the attempts to open the device that were given up.
pub(super) async fn readyz(State(app): State<App>) -> Result<Json<Value>> {
    if app.service.engine().is_draining() {
        return Err(Error::Unavailable("the server is shutting down".into()));
    }
    match app.service.engine().readiness() {
        Readiness::Starting => Err(Error::Unavailable("the first kernels are being built".into())),
        Readiness::Failed(cause) => {
            tracing::error!(%cause, "not ready");
            Err(Error::Unavailable(NO_DEVICE.into()))
        }
        Readiness::Ready(_) if !app.service.engine().has_room() => Err(Error::Unavailable("the queue is full".into())),
        Readiness::Ready(info) => {
            Ok(Json(json!({"status": "ready", "kernels": app.service.engine().kernels(), "lanes": info.lanes,
            "level": info.level, "gave_up": info.gave_up})))
        }
    }
}

/// The resident memory of this process in bytes, from the kernel's own account.
fn resident_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib * 1024.0)
}

/// `GET /metrics`, in Prometheus' text format.
pub(super) async fn metrics(State(app): State<App>) -> Response {
    metrics::gauge!("cloudchamber_renders_unfinished").set(app.service.engine().unfinished() as f64);
    metrics::gauge!("cloudchamber_streams_open")
        .set((app.service.limits().max_streams - app.streams.available_permits()) as f64);
    let (stored, resident) = app.service.assets().sizes();
    metrics::gauge!("cloudchamber_volumes_stored_bytes").set(stored as f64);
    metrics::gauge!("cloudchamber_volumes_resident_bytes").set(resident as f64);
    if let Some(bytes) = resident_bytes() {
        metrics::gauge!("process_resident_memory_bytes").set(bytes);
    }
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], app.metrics.render()).into_response()
}
