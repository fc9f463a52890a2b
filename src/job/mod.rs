//! Renders as jobs: a bounded queue, fair slices on the device thread, cancellation, and the latest frame.
//!
//! A [`Job`] is what the HTTP side and the device thread share. The device thread leaves snapshots of the film; a task of
//! the async runtime develops the newest of them into a frame (`develop.rs`); readers watch the latest frame and never hold
//! anybody up.

mod begin;
mod compile;
mod context;
mod develop;
mod device_thread;
mod device_volume;
mod distances;
mod engine;
mod field_run;
mod gathered;
mod kernels;
mod layer;
mod live;
mod motion;
mod pace;
mod places;
mod report;
mod resource;
mod rounds;
mod snapshot;
mod tiling;
mod verdict;
mod view_run;
mod warm;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;
use tokio::sync::watch;

use crate::device::program::Variant;
use crate::error::{Error, Result};
use crate::film::ErrorEstimate;
use crate::scene::Scene;
use crate::scene::camera::Camera;

pub use compile::compile_kernels;
pub use engine::{Engine, Place, Readiness};
pub use field_run::PICTURES_ON_THE_WAY;
pub use kernels::KernelProgress;
pub use report::{Counts, Frame, State, Timings, TracePoint, Update};
pub(crate) use snapshot::{SampleCounts, Snapshot};

/// Points of the convergence trace that are kept; past this, every second one is dropped.
const TRACE_POINTS: usize = 512;

/// What a new camera means for the engine.
pub(crate) struct Restart {
    /// The device thread has left the job and must be given it again.
    pub again: bool,
    /// It was done, so it needs a place in the queue again.
    pub was_done: bool,
}

/// What changes while a job lives. One lock, held for moments.
pub(crate) struct Progress {
    pub state: State,
    /// Counts cameras: work for an older one is thrown away.
    pub generation: u64,
    /// When the render, or its newest camera, was asked for.
    pub asked: Instant,
    pub scene: Scene,
    /// Whether the engine holds the job; a new camera for one that it does not hold is submitted again.
    pub in_engine: bool,
    pub reasons: Vec<String>,
    pub warnings: Vec<Value>,
    pub trace: Vec<TracePoint>,
    pub timings: Timings,
    /// What the first frame of a camera took of late, ms: since that was asked for, or since the frame before where cameras wait for theirs.
    pub frame_ms: Option<f64>,
    /// When the newest frame came.
    pub published: Option<Instant>,
    pub counts: Counts,
    pub samples: u32,
    pub error: Option<ErrorEstimate>,
    pub stopped_by: Option<&'static str>,
    pub failure: Option<Error>,
    /// The kernel that it waits for, while that is compiled.
    pub waits_for: Option<String>,
    pub result: Option<Value>,
    pub field: Option<Arc<crate::volume::Volume>>,
    /// The field once all its histories are in it: a new camera looks at it again.
    pub complete_field: Option<Arc<crate::volume::Volume>>,
    pub sequence: u64,
}

/// One render.
pub struct Job {
    id: String,
    request: Value,
    /// What the planner said of it, where it chose it.
    planned: Option<Value>,
    /// A planner's: seen by nobody else.
    pilot: bool,
    created_unix_s: u64,
    cancelled: AtomicBool,
    /// Nobody looks at frames before the final one.
    final_only: AtomicBool,
    /// Its film is waited for, whatever the limit of those that are kept.
    film_wanted: AtomicBool,
    /// Set while a snapshot is being developed: the device thread skips snapshots that nobody could use.
    pub(crate) developing: AtomicBool,
    progress: Mutex<Progress>,
    updates: watch::Sender<Update>,
    pub(crate) snapshots: watch::Sender<Option<Arc<Snapshot>>>,
}

impl Job {
    pub(crate) fn new(request: Value, scene: Scene, planned: Option<Value>, pilot: bool) -> Arc<Self> {
        let progress = Progress {
            state: State::Queued,
            generation: 0,
            asked: Instant::now(),
            scene,
            in_engine: true,
            reasons: Vec::new(),
            warnings: Vec::new(),
            trace: Vec::new(),
            timings: Timings::default(),
            frame_ms: None,
            published: None,
            counts: Counts::default(),
            samples: 0,
            error: None,
            stopped_by: None,
            failure: None,
            waits_for: None,
            result: None,
            field: None,
            complete_field: None,
            sequence: 0,
        };
        Arc::new(Self {
            id: uuid::Uuid::new_v4().simple().to_string(),
            request,
            planned,
            pilot,
            created_unix_s: SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()),
            cancelled: AtomicBool::new(false),
            final_only: AtomicBool::new(pilot),
            film_wanted: AtomicBool::new(pilot),
            developing: AtomicBool::new(false),
            progress: Mutex::new(progress),
            updates: watch::Sender::new(Update { state: State::Queued, frame: None }),
            snapshots: watch::Sender::new(None),
        })
    }

    pub(crate) fn is_pilot(&self) -> bool {
        self.pilot
    }

    /// The render's id.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// A poisoned lock is taken over: every change under it is a plain assignment, so nothing is ever half done.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// A camera for this job's scene, from the body of `PUT …/camera`.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn camera_from_json(&self, body: &Value) -> Result<Camera> {
        // A copy: checking takes a while, and the device thread wants the lock.
        let scene = self.lock().scene.clone();
        scene.camera_from_json(body)
    }

    /// Where it stands.
    pub fn state(&self) -> State {
        self.lock().state
    }

    /// Its state and latest frame, and each change of them.
    pub fn watch(&self) -> watch::Receiver<Update> {
        self.updates.subscribe()
    }

    /// The grid of a field technique, if the render has one and it has started.
    pub fn field(&self) -> Option<Arc<crate::volume::Volume>> {
        self.lock().field.clone()
    }

    /// Whether somebody looks at frames before the final one. Where nobody does the device and the encoder are not kept busy with them.
    pub fn set_followed(&self, followed: bool) {
        self.final_only.store(!followed, Ordering::Release);
    }

    pub(crate) fn is_followed(&self) -> bool {
        !self.final_only.load(Ordering::Acquire)
    }

    /// Whether somebody waits for its end to see its film, which is not let go of then.
    pub fn set_film_wanted(&self, wanted: bool) {
        self.film_wanted.store(wanted, Ordering::Release);
    }

    pub(crate) fn is_film_wanted(&self) -> bool {
        self.film_wanted.load(Ordering::Acquire)
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Acquire)
    }

    /// Asks for the job to end; the device leaves it at its next slice. Says whether it was still going.
    pub(crate) fn cancel(&self) -> bool {
        // Not for one that has ended: a done render may yet get a new camera.
        let ended = self.end(State::Cancelled, None);
        self.cancelled.fetch_or(ended, Ordering::AcqRel);
        ended
    }

    pub(crate) fn fail(&self, error: &Error) -> bool {
        // An internal error's text is for the log; a client learns that it happened.
        if let Error::Internal(cause) = error {
            tracing::error!(render = %self.id, %cause, "render failed");
        }
        self.end(State::Failed, Some(error.clone()))
    }

    /// What it failed by.
    pub fn failure(&self) -> Option<Error> {
        self.lock().failure.clone()
    }

    /// Notes which kernel it waits for.
    pub(crate) fn waits_for(&self, variant: &Variant) {
        self.lock().waits_for = Some(variant.label());
    }

    fn end(&self, state: State, failure: Option<Error>) -> bool {
        let mut progress = self.lock();
        if progress.state.is_terminal() {
            return false;
        }
        progress.state = state;
        progress.failure = failure;
        progress.in_engine = false;
        self.updates.send_modify(|u| u.state = state);
        true
    }

    /// Sets the state to running; the first time notes how long the job waited.
    pub(crate) fn started(&self) {
        let mut progress = self.lock();
        progress.waits_for = None;
        if progress.state == State::Queued {
            progress.state = State::Running;
            progress.timings.queued_ms = Some(progress.asked.elapsed().as_secs_f64() * 1e3);
            self.updates.send_modify(|u| u.state = State::Running);
        }
    }

    /// Puts a new camera in and forgets what was gathered for the old one.
    ///
    /// # Errors
    /// [`Error::Conflict`] for a render that was cancelled or failed.
    pub(crate) fn restart(&self, camera: Camera) -> Result<Restart> {
        let mut progress = self.lock();
        if matches!(progress.state, State::Cancelled | State::Failed) {
            return Err(Error::Conflict("this render was cancelled or has failed; post a new one".into()));
        }
        progress.scene.set_camera(camera);
        progress.generation += 1;
        progress.asked = Instant::now();
        progress.trace.clear();
        progress.timings = Timings::default();
        progress.stopped_by = None;
        let again = !progress.in_engine;
        progress.in_engine = true;
        let was_done = progress.state == State::Done;
        if was_done {
            progress.state = State::Queued;
        }
        let state = progress.state;
        self.updates.send_modify(|u| {
            u.state = state;
            // What was final is not any more.
            u.frame = u.frame.as_ref().map(|f| Arc::new(Frame { is_final: false, ..(**f).clone() }));
        });
        Ok(Restart { again, was_done })
    }

    /// The device thread is through with the job for the camera of `generation`. `false` when there is a newer camera, so
    /// that it has to go on.
    pub(crate) fn leave(&self, generation: u64) -> bool {
        let mut progress = self.lock();
        let newest = progress.generation == generation;
        progress.in_engine &= !newest;
        newest
    }

    /// Publishes a frame of `snapshot`, and with the final one of the newest camera ends the job. `true` when it ended.
    /// A frame of the camera before is worth showing while the newest has none: cameras may come faster than frames.
    pub(crate) fn publish(&self, snapshot: &Snapshot, png: Vec<u8>, error: ErrorEstimate) -> bool {
        let mut progress = self.lock();
        if progress.state.is_terminal() {
            return false;
        }
        let newest = snapshot.generation == progress.generation;
        let ends = newest && snapshot.stopped_by.is_some();
        progress.sequence += 1;
        progress.samples = snapshot.film.main.count;
        progress.error = Some(error);
        snapshot.counts.report(&snapshot.film, &mut progress.counts);
        progress.stopped_by = snapshot.stopped_by.filter(|_| ends);
        progress.timings.elapsed_ms = snapshot.elapsed_ms;
        progress.timings.device_ms = snapshot.device_ms;
        let since = |t: Instant| t.elapsed().as_secs_f64() * 1e3;
        let now = since(progress.asked);
        progress.timings.first_frame_ms.get_or_insert(now);
        let before = progress.published.replace(Instant::now());
        if snapshot.is_first {
            let waited = snapshot.elapsed_ms + since(snapshot.made);
            progress.frame_ms = Some(before.map_or(waited, |before| waited.min(since(before))));
        }
        if let Some(result) = &snapshot.result {
            progress.result = Some(result.clone());
        }
        if progress.trace.len() >= TRACE_POINTS {
            let mut index = 0;
            progress.trace.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
        if newest {
            progress.trace.push(TracePoint {
                elapsed_ms: snapshot.elapsed_ms,
                samples: snapshot.film.main.count,
                error: error.total,
                stride: snapshot.film.main.stride as u32,
            });
        }
        if ends {
            progress.state = State::Done;
        }
        let frame = Arc::new(Frame {
            sequence: progress.sequence,
            etag: crate::frame::etag(&png),
            png: png.into(),
            samples: snapshot.film.main.count,
            error,
            lowered: snapshot.film.lowered,
            elapsed_ms: snapshot.elapsed_ms,
            device_ms: snapshot.device_ms,
            is_final: ends,
        });
        self.updates.send_replace(Update { state: progress.state, frame: Some(frame) });
        ends
    }

    /// Bytes held for readers.
    pub(crate) fn bytes(&self) -> usize {
        let frame = self.updates.borrow().frame.as_ref().map_or(0, |f| f.png.len());
        let progress = self.lock();
        frame + progress.field.as_ref().map_or(0, |f| f.bytes() as usize)
    }

    /// Its convergence trace.
    pub fn trace(&self) -> Vec<TracePoint> {
        self.lock().trace.clone()
    }
}
