//! `/v1/exports`: post, list, show, cancel, and the file.

use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use super::App;
use super::problem::Id;
use crate::error::{Error, Result};
use crate::job::{Job, State as JobState};

/// `POST /v1/exports`.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let body = app.read_json(request).await?;
    let job = app.service.queue(app.service.prepare_export(body).await?);
    let location = format!("/v1/exports/{}", job.id());
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, location)], Json(job.resource())).into_response())
}

/// `GET /v1/exports`.
pub(super) async fn list(State(app): State<App>) -> Json<Value> {
    let exports = app.service.engine().list().into_iter().filter(|job| !job.is_render());
    Json(json!({"exports": exports.map(|job| job.summary()).collect::<Vec<_>>()}))
}

/// `GET /v1/exports/{id}`.
pub(super) async fn show(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    Ok(Json(app.export(&id)?.resource()))
}

/// `DELETE /v1/exports/{id}`.
pub(super) async fn cancel(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    let job = app.export(&id)?;
    app.service.engine().cancel(&job);
    Ok(Json(job.resource()))
}

/// The query of `file`.
#[derive(Deserialize)]
pub(super) struct FileQuery {
    wait: Option<String>,
}

/// `GET /v1/exports/{id}/file`: 409 before the file is there, unless `?wait=final` waits for it.
pub(super) async fn file(
    State(app): State<App>,
    Id(id): Id,
    query: std::result::Result<Query<FileQuery>, axum::extract::rejection::QueryRejection>,
) -> Result<Response> {
    let job = app.export(&id)?;
    let Query(FileQuery { wait }) = query.map_err(|e| Error::Malformed(e.body_text()))?;
    match wait.as_deref() {
        Some("final") => wait_for_end(&app, &job).await?,
        Some(other) => return Err(Error::invalid("query:wait", format!("'{other}' is not known"), "final")),
        None => {}
    }
    let Some(file) = job.file() else { return Err(why_not(&job)) };
    let disposition = format!("attachment; filename=\"{}.{}\"", job.id(), file.extension);
    let headers = [(header::CONTENT_TYPE, file.media_type.to_owned()), (header::CONTENT_DISPOSITION, disposition)];
    Ok((headers, file.bytes.clone()).into_response())
}

async fn wait_for_end(app: &App, job: &Arc<Job>) -> Result<()> {
    let _permit = app.stream_permit()?;
    let mut updates = job.watch();
    tokio::select! {
        ended = updates.wait_for(|update| update.state.is_terminal()) => ended.map(drop).map_err(Error::internal),
        () = app.stop.cancelled() => Err(Error::Unavailable("the server is shutting down".into())),
    }
}

/// The reason for a missing file, as an error.
fn why_not(job: &Job) -> Error {
    match job.state() {
        JobState::Failed => job.failure().unwrap_or_else(|| Error::internal("an export failed")),
        JobState::Cancelled => Error::Conflict("this export was cancelled".into()),
        _ => Error::Conflict("the file is not there yet; ?wait=final waits for it".into()),
    }
}
