//! A frame as a response: PNG and EXR with the frame's numbers in headers, and `frame.png` and `frame.exr`.

use std::sync::Arc;

use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use headers::HeaderMapExt;
use serde::Deserialize;

use super::App;
use super::problem::Id;
use crate::error::{Error, Result};
use crate::frame;
use crate::job::{Frame, Job, State as JobState};

/// Waits for a frame: the final one if `last`, else the newest, or the first if there is none yet.
pub(super) async fn wait_for(app: &App, job: &Job, last: bool) -> Result<Arc<Frame>> {
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

/// The numbers of a frame as headers.
pub(super) fn frame_headers(frame: &Frame) -> Vec<(&'static str, String)> {
    let lowered = (!frame.lowered.is_none()).then(|| ("X-Cloudchamber-Lowered", frame.lowered.words().join("; ")));
    let always = [
        ("X-Cloudchamber-Samples", frame.samples.to_string()),
        ("X-Cloudchamber-Error", frame.error.total.map_or("unknown".into(), |error| format!("{error:.6}"))),
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

pub(super) fn png(frame: &Frame) -> Response {
    with_frame_headers(([(header::CONTENT_TYPE, "image/png")], frame.png.clone()).into_response(), frame, &frame.etag)
}

/// The present film as EXR. The film of a running render may have more samples than its newest frame.
pub(super) async fn exr(app: &App, job: &Arc<Job>, frame: &Frame) -> Result<Response> {
    let film = app.service.engine().film(job).await;
    job.set_film_wanted(false);
    let film = film?;
    let frame = Frame { samples: film.main.count, error: film.error(), lowered: film.lowered, ..frame.clone() };
    let bytes = tokio::task::spawn_blocking(move || film.exr()).await.map_err(Error::internal)??;
    let etag = frame::etag(&bytes);
    Ok(with_frame_headers(([(header::CONTENT_TYPE, "image/x-exr")], bytes).into_response(), &frame, &etag))
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

/// True if the client already has the frame with this tag.
fn unchanged(headers: &HeaderMap, etag: &str) -> bool {
    let tag = etag.parse::<headers::ETag>().ok();
    headers.typed_get::<headers::IfNoneMatch>().zip(tag).is_some_and(|(seen, tag)| !seen.precondition_passes(&tag))
}

type FrameRequest =
    (State<App>, Id, std::result::Result<Query<FrameQuery>, axum::extract::rejection::QueryRejection>, HeaderMap);

async fn newest((State(app), Id(id), query, _): &FrameRequest) -> Result<(Arc<Job>, Arc<Frame>)> {
    let job = app.render(id)?;
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
    Ok(png(&frame))
}

/// `GET /v1/renders/{id}/frame.exr`.
pub(super) async fn frame_exr(request: FrameRequest) -> Result<Response> {
    let (job, frame) = newest(&request).await?;
    let response = exr(&request.0, &job, &frame).await?;
    let etag = response.headers().get(header::ETAG).and_then(|v| v.to_str().ok()).unwrap_or_default().to_owned();
    if unchanged(&request.3, &etag) {
        return Ok(with_frame_headers(StatusCode::NOT_MODIFIED.into_response(), &frame, &etag));
    }
    Ok(response)
}
