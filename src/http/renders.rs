//! `/v1/renders`: post, list, show, cancel, a new camera, and the newest frame in its formats.

use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use headers::HeaderMapExt;
use serde::Deserialize;
use serde_json::{Value, json};

use super::accept::negotiate;
use super::problem::{self, Id};
use super::{App, plans, streams};
use crate::error::{Error, Result};
use crate::frame;
use crate::job::{Frame, Job, State as JobState};
use crate::scene::Scene;
use crate::{chart, volume};

/// What `POST /v1/renders` can answer with, in the order of preference when the client has none.
const OFFERS: [&str; 4] = ["application/json", "image/png", "image/x-exr", "multipart/x-mixed-replace"];

/// `POST /v1/renders`.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let headers = request.headers().clone();
    let answer = negotiate(&headers, &OFFERS)?;
    let body = problem::read_json(request, app.limits.max_json_bytes, app.request_timeout).await?;
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

/// The job for a body: a new one, or the one that the same idempotency key made before (then `false`).
async fn submit(app: &App, headers: &HeaderMap, body: Value) -> Result<(Arc<Job>, bool)> {
    let key = headers.get("idempotency-key").and_then(|v| v.to_str().ok()).map(str::to_owned);
    let hash = blake3::hash(body.to_string().as_bytes());
    let remembered = |app: &App, key: &str| -> Result<Option<Arc<Job>>> {
        let known = app.idempotency.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match known.by_key.get(key) {
            Some((before, _)) if *before != hash => {
                Err(Error::Conflict("this Idempotency-Key came with another body before".into()))
            }
            Some((_, id)) => Ok(app.engine.job(id)),
            None => Ok(None),
        }
    };
    if let Some(key) = &key
        && let Some(job) = remembered(app, key)?
    {
        return Ok((job, false));
    }
    let (body, planned) = plans::planner(app).resolve(body).await?;
    // A place in the queue before anything is loaded for the request.
    let place = app.engine.reserve()?;
    // Decoding a volume or making a built-in takes a while: not on the runtime's own threads.
    let scene = tokio::task::spawn_blocking({
        let (app, body) = (app.clone(), body.clone());
        move || Scene::from_json(&body, &app.store, &app.limits)
    })
    .await
    .map_err(Error::internal)??;
    let Some(key) = key else { return Ok((app.engine.submit_planned(place, body, scene, planned), true)) };
    if let Some(job) = remembered(app, &key)? {
        return Ok((job, false));
    }
    let job = app.engine.submit_planned(place, body, scene, planned);
    let mut known = app.idempotency.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.remember(key, hash, job.id().to_owned());
    Ok((job, true))
}

/// Cancels a render when the request that it was made for goes away before its end.
pub(super) struct CancelOnDrop {
    app: App,
    job: Arc<Job>,
    armed: bool,
}

impl CancelOnDrop {
    /// Armed only for a render that this request made.
    pub fn new(app: &App, job: &Arc<Job>, armed: bool) -> Self {
        Self { app: app.clone(), job: job.clone(), armed }
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        if self.armed {
            self.app.engine.cancel(&self.job);
        }
    }
}

async fn finished(app: &App, job: Arc<Job>, fresh: bool, format: &str) -> Result<Response> {
    let mut guard = CancelOnDrop::new(app, &job, fresh);
    let _permit = app.stream_permit()?;
    if fresh {
        job.set_followed(false);
        job.set_film_wanted(format == "image/x-exr");
    }
    let frame = wait_for(app, &job, true).await?;
    guard.armed = false;
    if format == "image/png" { Ok(png_response(&frame)) } else { exr_response(app, &job, &frame).await }
}

/// The newest frame; the final one if `last`, else the first that there is.
async fn wait_for(app: &App, job: &Job, last: bool) -> Result<Arc<Frame>> {
    let mut updates = job.watch();
    loop {
        let update = updates.borrow_and_update().clone();
        match (update.state, update.frame) {
            (JobState::Done, Some(frame)) => return Ok(frame),
            (JobState::Failed, _) => {
                return Err(job.failure().unwrap_or_else(|| Error::internal("the render failed")));
            }
            (JobState::Cancelled, Some(frame)) if !last => return Ok(frame),
            (JobState::Cancelled, _) => return Err(Error::Conflict("the render was cancelled".into())),
            (_, Some(frame)) if !last => return Ok(frame),
            _ => {}
        }
        tokio::select! {
            changed = updates.changed() => changed.map_err(|_| Error::internal("the render is gone"))?,
            () = app.stop.cancelled() => return Err(Error::Unavailable("the server is shutting down".into())),
        }
    }
}

/// What a frame says of itself in headers.
pub(super) fn frame_headers(frame: &Frame) -> Vec<(&'static str, String)> {
    let lowered = (!frame.lowered.is_none()).then(|| ("X-Cloudchamber-Lowered", frame.lowered.words().join("; ")));
    let always = [
        ("X-Cloudchamber-Samples", frame.samples.to_string()),
        ("X-Cloudchamber-Error", format!("{:.6}", frame.error.total)),
        ("X-Cloudchamber-Elapsed-Ms", format!("{:.1}", frame.elapsed_ms)),
        ("X-Cloudchamber-Final", frame.is_final.to_string()),
    ];
    always.into_iter().chain(lowered).collect()
}

fn with_frame_headers(response: Response, frame: &Frame, etag: &str) -> Response {
    let fixed = [("Cache-Control", "no-cache".to_owned()), ("ETag", etag.to_owned())];
    let device = [("X-Cloudchamber-Device-Ms", format!("{:.1}", frame.device_ms))];
    let mut response = response;
    for (name, value) in fixed.into_iter().chain(device).chain(frame_headers(frame)) {
        if let Ok(value) = value.parse() {
            response.headers_mut().insert(name, value);
        }
    }
    response
}

fn png_response(frame: &Frame) -> Response {
    with_frame_headers(([(header::CONTENT_TYPE, "image/png")], frame.png.clone()).into_response(), frame, &frame.etag)
}

/// The film as it is by now: that of a running render may have more samples than its newest frame.
async fn exr_response(app: &App, job: &Arc<Job>, frame: &Frame) -> Result<Response> {
    let film = app.engine.film(job).await;
    job.set_film_wanted(false);
    let film = film?;
    let frame = Frame { samples: film.main.count, error: film.error(), lowered: film.lowered, ..frame.clone() };
    let bytes = tokio::task::spawn_blocking(move || film.exr()).await.map_err(Error::internal)??;
    let etag = frame::etag(&bytes);
    Ok(with_frame_headers(([(header::CONTENT_TYPE, "image/x-exr")], bytes).into_response(), &frame, &etag))
}

pub(super) fn find(app: &App, id: &str) -> Result<Arc<Job>> {
    app.engine.job(id).ok_or_else(|| Error::NotFound { what: "render", id: id.chars().take(64).collect() })
}

/// `GET /v1/renders`.
pub(super) async fn list(State(app): State<App>) -> Json<Value> {
    Json(json!({"renders": app.engine.list().iter().map(|j| j.summary()).collect::<Vec<_>>()}))
}

/// `GET /v1/renders/{id}`.
pub(super) async fn show(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    Ok(Json(find(&app, &id)?.resource()))
}

/// `DELETE /v1/renders/{id}`.
pub(super) async fn cancel(State(app): State<App>, Id(id): Id) -> Result<Json<Value>> {
    let job = find(&app, &id)?;
    app.engine.cancel(&job);
    Ok(Json(job.resource()))
}

/// `PUT /v1/renders/{id}/camera`.
pub(super) async fn set_camera(State(app): State<App>, Id(id): Id, request: Request<Body>) -> Result<Json<Value>> {
    let job = find(&app, &id)?;
    let body = problem::read_json(request, app.limits.max_json_bytes, app.request_timeout).await?;
    let camera = job.camera_from_json(&body)?;
    app.engine.set_camera(&job, camera)?;
    Ok(Json(json!({"id": job.id(), "state": job.state(), "camera": camera.to_json()})))
}

/// The query of `frame.png` and `frame.exr`.
#[derive(Deserialize)]
pub(super) struct FrameQuery {
    wait: Option<String>,
}

impl FrameQuery {
    fn last(&self) -> Result<bool> {
        match self.wait.as_deref() {
            None => Ok(false),
            Some("final") => Ok(true),
            Some(other) => Err(Error::invalid("query:wait", format!("'{other}' is not known"), "final")),
        }
    }
}

/// Whether the client has the frame of this tag already.
fn unchanged(headers: &HeaderMap, etag: &str) -> bool {
    let tag = etag.parse::<headers::ETag>().ok();
    headers.typed_get::<headers::IfNoneMatch>().zip(tag).is_some_and(|(seen, tag)| !seen.precondition_passes(&tag))
}

type FrameRequest =
    (State<App>, Id, std::result::Result<Query<FrameQuery>, axum::extract::rejection::QueryRejection>, HeaderMap);

async fn newest((State(app), Id(id), query, _): &FrameRequest) -> Result<(Arc<Job>, Arc<Frame>)> {
    let job = find(app, id)?;
    let last = query.as_ref().map_err(|e| Error::Malformed(e.body_text()))?.last()?;
    let _permit = app.stream_permit()?;
    if !last {
        job.set_followed(true);
    }
    let frame = wait_for(app, &job, last).await?;
    Ok((job, frame))
}

/// `GET /v1/renders/{id}/frame.png`.
pub(super) async fn frame_png(request: FrameRequest) -> Result<Response> {
    let (_, frame) = newest(&request).await?;
    if unchanged(&request.3, &frame.etag) {
        return Ok(with_frame_headers(StatusCode::NOT_MODIFIED.into_response(), &frame, &frame.etag));
    }
    Ok(png_response(&frame))
}

/// `GET /v1/renders/{id}/frame.exr`.
pub(super) async fn frame_exr(request: FrameRequest) -> Result<Response> {
    let (job, frame) = newest(&request).await?;
    let response = exr_response(&request.0, &job, &frame).await?;
    let etag = response.headers().get(header::ETAG).and_then(|v| v.to_str().ok()).unwrap_or_default().to_owned();
    if unchanged(&request.3, &etag) {
        return Ok(with_frame_headers(StatusCode::NOT_MODIFIED.into_response(), &frame, &etag));
    }
    Ok(response)
}

/// The query of `difference`.
#[derive(Deserialize)]
pub(super) struct DifferenceQuery {
    with: String,
}

/// `GET /v1/renders/{id}/difference?with=…`: whether two renders are of the same picture.
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
    let (one, other) = (find(&app, &id)?, find(&app, &with)?);
    let (ours, theirs) = (app.engine.film(&one).await?, app.engine.film(&other).await?);
    let compared = tokio::task::spawn_blocking(move || -> Result<_> {
        let difference = ours.compare(&theirs)?;
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
    ];
    Ok((told, png).into_response())
}

/// `GET /v1/renders/{id}/field`.
pub(super) async fn field(State(app): State<App>, Id(id): Id) -> Result<Response> {
    let job = find(&app, &id)?;
    let grid = job.field().ok_or_else(|| Error::NotFound { what: "field of render", id: job.id().into() })?;
    let bytes = tokio::task::spawn_blocking(move || volume::write_nrrd(&grid)).await.map_err(Error::internal)?;
    let disposition = format!("attachment; filename=\"{}.nrrd\"", job.id());
    Ok((
        [(header::CONTENT_TYPE, "application/octet-stream".to_owned()), (header::CONTENT_DISPOSITION, disposition)],
        bytes,
    )
        .into_response())
}

/// `GET /v1/renders/{id}/convergence.svg`.
pub(super) async fn convergence(State(app): State<App>, Id(id): Id) -> Result<Response> {
    let job = find(&app, &id)?;
    let state = format!("{:?}", job.state()).to_lowercase();
    let svg = chart::convergence(&job.trace(), &state)?;
    Ok(([(header::CONTENT_TYPE, "image/svg+xml"), (header::CACHE_CONTROL, "no-cache")], svg).into_response())
}
