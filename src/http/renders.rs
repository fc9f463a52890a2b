//! `/v1/renders`: post, list, show, cancel, a new camera, differences, and the grid of a field.

use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use super::accept::negotiate;
use super::problem::Id;
use super::{App, frames, streams};
use crate::error::{Error, Result};
use crate::job::{CancelOnDrop, Job};
use crate::{chart, volume};

/// The media types that `POST /v1/renders` can answer with, in the order of preference if the client has none.
const OFFERS: [&str; 4] = ["application/json", "image/png", "image/x-exr", "multipart/x-mixed-replace"];

/// `POST /v1/renders`.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let headers = request.headers().clone();
    let answer = negotiate(&headers, &OFFERS)?;
    let body = app.read_json(request).await?;
    let (job, fresh) = submit(&app, &headers, body).await?;
    let location = format!("/v1/renders/{}", job.id());
    let mut response = match answer {
        "application/json" => (StatusCode::ACCEPTED, Json(job.resource())).into_response(),
        "multipart/x-mixed-replace" => streams::frames_of(&app, job, fresh)?,
        format => finished(&app, job, fresh, format).await?,
    };
    let value = location.parse().map_err(Error::internal)?;
    response
        .headers_mut()
        .insert(if answer == "application/json" { header::LOCATION } else { header::CONTENT_LOCATION }, value);
    Ok(response)
}

/// The job for a body: a new one, or the one that was made with the same idempotency key before (then `false`).
async fn submit(app: &App, headers: &HeaderMap, body: Value) -> Result<(Arc<Job>, bool)> {
    let key = headers.get("idempotency-key").and_then(|v| v.to_str().ok()).map(str::to_owned);
    let Some(key) = key else { return Ok((app.service.submit(body).await?, true)) };
    let hash = blake3::hash(body.to_string().as_bytes());
    let known = |id: String| app.service.engine().job(&id);
    if let Some(job) = app.idempotency().made_by(&key, hash)?.and_then(known) {
        return Ok((job, false));
    }
    let prepared = app.service.prepare(body).await?;
    let mut idempotency = app.idempotency();
    // Another request with this key may have been quicker.
    if let Some(job) = idempotency.made_by(&key, hash)?.and_then(known) {
        return Ok((job, false));
    }
    let job = app.service.queue(prepared);
    idempotency.remember(key, hash, job.id().to_owned());
    Ok((job, true))
}

/// Waits for the final frame of a job. A `fresh` job, which was made for this request, is cancelled when the client goes away.
async fn finished(app: &App, job: Arc<Job>, fresh: bool, format: &str) -> Result<Response> {
    let _guard = fresh.then(|| CancelOnDrop::new(app.service.engine(), job.clone()));
    let _permit = app.stream_permit()?;
    if fresh {
        job.set_followed(false);
        job.set_film_wanted(format == "image/x-exr");
    }
    let frame = frames::wait_for(app, &job, true).await?;
    if format == "image/png" { Ok(frames::png(&frame)) } else { frames::exr(app, &job, &frame).await }
}

/// `GET /v1/renders`.
pub(super) async fn list(State(app): State<App>) -> Json<Value> {
    let renders = app.service.engine().list().into_iter().filter(|job| job.is_render());
    Json(json!({"renders": renders.map(|job| job.summary()).collect::<Vec<_>>()}))
}

/// `GET /v1/renders/{id}`.
pub(super) async fn show(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    Ok(Json(app.render(&id)?.resource()))
}

/// `DELETE /v1/renders/{id}`.
pub(super) async fn cancel(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    let job = app.render(&id)?;
    app.service.engine().cancel(&job);
    Ok(Json(job.resource()))
}

/// `PUT /v1/renders/{id}/camera`.
pub(super) async fn set_camera(State(app): State<App>, Id(id): Id, request: Request<Body>) -> Result<Json<Value>> {
    let job = app.render(&id)?;
    let body = app.read_json(request).await?;
    let camera = job.camera_from_json(&body)?;
    app.service.engine().set_camera(&job, camera)?;
    Ok(Json(json!({"id": job.id(), "state": job.state(), "camera": camera.to_json()})))
}

/// The query of `difference`.
#[derive(Deserialize)]
pub(super) struct DifferenceQuery {
    with: String,
}

/// `GET /v1/renders/{id}/difference?with=…`: a test that two renders are of the same picture.
pub(super) async fn difference(
    State(app): State<App>,
    Id(id): Id,
    query: std::result::Result<Query<DifferenceQuery>, axum::extract::rejection::QueryRejection>,
    headers: HeaderMap,
) -> Result<Response> {
    let answer = negotiate(&headers, &["image/png", "application/json"])?;
    let Ok(Query(DifferenceQuery { with })) = query else {
        return Err(Error::invalid("query:with", "missing", "the id of another render"));
    };
    let (one, other) = (app.render(&id)?, app.render(&with)?);
    let correlated = one.seed() == other.seed();
    let (ours, theirs) = (app.service.engine().film(&one).await?, app.service.engine().film(&other).await?);
    let compared = tokio::task::spawn_blocking(move || -> Result<_> {
        let difference = ours.compare(&theirs, correlated)?;
        let png = difference.png()?;
        Ok((difference, png))
    });
    let (difference, png) = compared.await.map_err(Error::internal)??;
    if answer == "application/json" {
        return Ok(Json(difference).into_response());
    }
    let told = [
        (header::CONTENT_TYPE.as_str(), "image/png".to_owned()),
        ("X-Cloudchamber-P-Value", format!("{:.6e}", difference.p_value)),
        ("X-Cloudchamber-Pixels-Beyond", difference.beyond.to_string()),
        ("X-Cloudchamber-Agree", difference.agree.to_string()),
        ("X-Cloudchamber-Correlated", difference.correlated.to_string()),
    ];
    Ok((told, png).into_response())
}

/// `GET /v1/renders/{id}/field`.
pub(super) async fn field(State(app): State<App>, Id(id): Id) -> Result<Response> {
    let job = app.render(&id)?;
    let grid = job.field().ok_or_else(|| Error::NotFound { what: "field of render", id: job.id().into() })?;
    let bytes = tokio::task::spawn_blocking(move || volume::write_nrrd(&grid)).await.map_err(Error::internal)??;
    let disposition = format!("attachment; filename=\"{}.nrrd\"", job.id());
    Ok((
        [(header::CONTENT_TYPE, "application/octet-stream".to_owned()), (header::CONTENT_DISPOSITION, disposition)],
        bytes,
    )
        .into_response())
}

/// `GET /v1/renders/{id}/convergence.svg`.
pub(super) async fn convergence(State(app): State<App>, Id(id): Id) -> Result<Response> {
    let job = app.render(&id)?;
    let state = format!("{:?}", job.state()).to_lowercase();
    let svg = chart::convergence(&job.trace(), &state)?;
    Ok(([(header::CONTENT_TYPE, "image/svg+xml"), (header::CACHE_CONTROL, "no-cache")], svg).into_response())
}
