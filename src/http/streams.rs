//! Streams of a render: frames as `multipart/x-mixed-replace`, and server-sent events. Both show the latest update and skip those that a slow
//! reader missed, so that nothing grows. Both end with the render or with the server.

use std::convert::Infallible;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream::{self, Stream, StreamExt};
use serde_json::json;
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use super::App;
use super::frames::frame_headers;
use super::problem::Id;

use crate::error::Result;
use crate::job::{CancelOnDrop, Frame, Job, State as JobState, Update};

/// A reader of a job's updates. It knows the last one that it has shown.
struct Reader {
    job: Arc<Job>,
    updates: watch::Receiver<Update>,
    stop: CancellationToken,
    shown: u64,
    over: bool,
    _permit: OwnedSemaphorePermit,
    _guard: Option<CancelOnDrop>,
}

impl Reader {
    fn new(app: &App, job: Arc<Job>, shown: u64, guard: Option<CancelOnDrop>) -> Result<Self> {
        let _permit = app.stream_permit()?;
        job.set_followed(true);
        metrics::counter!("cloudchamber_streams_total").increment(1);
        Ok(Self { updates: job.watch(), job, stop: app.stop.clone(), shown, over: false, _permit, _guard: guard })
    }

    /// The next update that is not shown yet, or the end; `None` after the end or when the server stops.
    async fn next(&mut self) -> Option<Update> {
        while !self.over {
            let update = self.updates.borrow_and_update().clone();
            let fresh = update.sequence() > self.shown;
            self.over = update.state.is_terminal();
            if fresh || self.over {
                self.shown = self.shown.max(update.sequence());
                return Some(update);
            }
            tokio::select! {
                changed = self.updates.changed() => changed.ok()?,
                () = self.stop.cancelled() => return None,
            }
        }
        None
    }
}

const OPENING: &[u8] = b"--frame\r\n";

/// A part, with the boundary behind it at once: a browser shows a part when it sees the part's end. All readers share the picture itself, so that
/// idle readers cost no memory.
fn part(frame: &Frame, last: bool) -> [Bytes; 3] {
    let mut head = format!("Content-Type: image/png\r\nContent-Length: {}\r\n", frame.png.len());
    for (name, value) in frame_headers(frame) {
        head += &format!("{name}: {value}\r\n");
    }
    let boundary: &[u8] = if last { b"\r\n--frame--\r\n" } else { b"\r\n--frame\r\n" };
    [(head + "\r\n").into(), frame.png.clone(), Bytes::from_static(boundary)]
}

fn multipart(reader: Reader) -> impl Stream<Item = std::result::Result<Bytes, Infallible>> {
    let mut before = 0;
    let parts = stream::unfold(reader, |mut reader| async move { reader.next().await.map(|update| (update, reader)) });
    let parts = parts.filter_map(move |update| {
        // An end without a new frame just stops the stream.
        let fresh = update.frame.filter(|f| f.sequence > before);
        before = fresh.as_ref().map_or(before, |f| f.sequence);
        let pieces = fresh.map(|f| stream::iter(part(&f, update.state.is_terminal()).map(Ok)));
        async move { pieces }
    });
    stream::once(async { Ok(Bytes::from_static(OPENING)) }).chain(parts.flatten())
}

/// The frames of a job as a response. A `fresh` job, which was made for this request, is cancelled when the response ends.
pub(super) fn frames_of(app: &App, job: Arc<Job>, fresh: bool) -> Result<Response> {
    let guard = fresh.then(|| CancelOnDrop::new(app.service.engine(), job.clone()));
    let reader = Reader::new(app, job, 0, guard)?;
    let headers =
        [(header::CONTENT_TYPE, "multipart/x-mixed-replace; boundary=frame"), (header::CACHE_CONTROL, "no-store")];
    Ok((headers, Body::from_stream(multipart(reader))).into_response())
}

/// `GET /v1/renders/{id}/frames`.
pub(super) async fn frames(State(app): State<App>, Id(id): Id) -> Result<Response> {
    frames_of(&app, app.render(&id)?, false)
}

fn event(job: &Job, update: &Update) -> Event {
    let name = match update.state {
        JobState::Done => "final",
        JobState::Cancelled => "cancelled",
        JobState::Failed => "failed",
        JobState::Queued | JobState::Running => "progress",
    };
    let resource = job.resource();
    let frame = update.frame.as_ref();
    let id = update.sequence().to_string();
    if !job.is_render() {
        let data = json!({"state": update.state, "progress": resource["progress"], "failure": resource["failure"]});
        return Event::default().event(name).id(id).data(data.to_string());
    }
    let data = json!({
        "state": update.state,
        "samples": frame.map_or(0, |f| f.samples),
        "error": frame.and_then(|f| f.error.total),
        "lowered": frame.map(|f| f.lowered.words()),
        "elapsed_ms": frame.map(|f| f.elapsed_ms),
        "device_ms": frame.map(|f| f.device_ms),
        "final": frame.is_some_and(|f| f.is_final),
        "stopped_by": resource["stopped_by"],
        "failure": resource["failure"],
    });
    Event::default().event(name).id(id).data(data.to_string())
}

/// `GET /v1/renders/{id}/events`; `Last-Event-ID` gives the last event that was seen.
pub(super) async fn events(State(app): State<App>, Id(id): Id, headers: HeaderMap) -> Result<Response> {
    events_of(&app, app.render(&id)?, &headers)
}

/// `GET /v1/exports/{id}/events`, likewise.
pub(super) async fn export_events(State(app): State<App>, Id(id): Id, headers: HeaderMap) -> Result<Response> {
    events_of(&app, app.export(&id)?, &headers)
}

fn events_of(app: &App, job: Arc<Job>, headers: &HeaderMap) -> Result<Response> {
    let seen = headers.get("last-event-id").and_then(|v| v.to_str().ok()?.parse().ok()).unwrap_or(0);
    let reader = Reader::new(app, job, seen, None)?;
    let events = stream::unfold(reader, |mut reader| async move {
        let update = reader.next().await?;
        Some((Ok::<_, Infallible>(event(&reader.job, &update)), reader))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::default()).into_response())
}
