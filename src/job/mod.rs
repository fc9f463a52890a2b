//! The record of a render or an export: its request, its state, its events, its reply, and the reports of its executor. The engine admits jobs to a
//! queue, keeps them readable and hands them to an [`Executor`]. It knows nothing of the work on them.
//!
//! The HTTP side and the executor share a [`Job`]. The executor leaves snapshots of the film. A task of the async runtime encodes the newest of
//! them as a frame (`encode.rs`). Readers watch the latest frame and never hold anybody up.

mod cancel;
mod encode;
mod engine;
mod executor;
mod export;
mod progress;
mod report;
mod resource;
mod snapshot;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;
use tokio::sync::watch;

use crate::error::{Error, Result};
use crate::render::{ExportTask, Scene};
use crate::scene::camera::Camera;

pub use cancel::CancelOnDrop;
pub use engine::{Engine, Place};
pub use executor::{Executor, KernelProgress, Readiness};
pub(crate) use progress::NewestCamera;
use progress::Progress;
pub use report::{Counts, Frame, State, Timings, TracePoint, Update};
pub(crate) use snapshot::{SampleCounts, Snapshot};

/// The consequences of a new camera for the engine.
pub(crate) struct Restart {
    /// True if the executor has left the job and must be given it again.
    pub again: bool,
    /// True if the job was done, so that it needs a place in the queue again.
    pub was_done: bool,
}

/// The product of a job.
#[derive(Clone)]
pub enum Task {
    /// A picture that gets better: a render.
    Picture(Box<Scene>),
    /// A file: an export.
    File(Box<ExportTask>),
}

/// One render or export.
pub struct Job {
    id: String,
    request: Value,
    /// The planner's answer, if the planner chose the technique.
    planned: Option<Value>,
    /// True if it is a planner's pilot, which nobody else sees.
    pilot: bool,
    created_unix_s: u64,
    cancelled: AtomicBool,
    /// True if nobody looks at frames before the final one.
    final_only: AtomicBool,
    /// True if its film is waited for. It is then kept whatever the limit.
    film_wanted: AtomicBool,
    /// True while a snapshot is being encoded. The executor then skips snapshots, since nobody could use them.
    encoding: AtomicBool,
    progress: Mutex<Progress>,
    updates: watch::Sender<Update>,
    snapshots: watch::Sender<Option<Arc<Snapshot>>>,
}

impl Job {
    pub(crate) fn new(request: Value, task: Task, planned: Option<Value>, pilot: bool) -> Arc<Self> {
        Arc::new(Self {
            id: uuid::Uuid::new_v4().simple().to_string(),
            request,
            planned,
            pilot,
            created_unix_s: SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()),
            cancelled: AtomicBool::new(false),
            final_only: AtomicBool::new(pilot),
            film_wanted: AtomicBool::new(pilot),
            encoding: AtomicBool::new(false),
            progress: Mutex::new(Progress::new(task)),
            updates: watch::Sender::new(Update {
                state: State::Queued,
                frame: None,
                work: None,
                is_handed_over: false,
            }),
            snapshots: watch::Sender::new(None),
        })
    }

    /// The seed of a render's random numbers; `None` for an export.
    pub fn seed(&self) -> Option<u64> {
        match &self.lock().task {
            Task::Picture(scene) => Some(scene.seed()),
            Task::File(_) => None,
        }
    }

    pub(crate) fn is_pilot(&self) -> bool {
        self.pilot
    }

    /// The render's id.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Locks the progress. A poisoned lock is taken over: every change under it is a plain assignment, so nothing is ever half done.
    fn lock(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// A camera for this job's scene, from the body of `PUT …/camera`.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn camera_from_json(&self, body: &Value) -> Result<Camera> {
        // The task is copied, since checking takes a while and the executor wants the lock.
        let task = self.lock().task.clone();
        match task {
            Task::Picture(scene) => scene.camera_from_json(body),
            Task::File(_) => Err(Error::internal("an export has no camera")),
        }
    }

    /// True if the job makes a picture, and not a file.
    pub fn is_render(&self) -> bool {
        matches!(self.lock().task, Task::Picture(_))
    }

    /// The present state.
    pub fn state(&self) -> State {
        self.lock().state
    }

    /// A receiver of its state and latest frame, and of each change of them.
    pub fn watch(&self) -> watch::Receiver<Update> {
        self.updates.subscribe()
    }

    /// The grid of a field technique, if the render has one and it has started.
    pub fn field(&self) -> Option<Arc<crate::volume::Volume>> {
        self.lock().field.clone()
    }

    /// The device time of that grid, ms.
    pub(crate) fn field_ms(&self) -> f64 {
        self.lock().field_ms
    }

    /// Notes if somebody looks at frames before the final one. If nobody does, the device and the encoder do not make them.
    pub fn set_followed(&self, followed: bool) {
        self.final_only.store(!followed, Ordering::Release);
    }

    pub(crate) fn is_followed(&self) -> bool {
        !self.final_only.load(Ordering::Acquire)
    }

    /// Notes if somebody waits for its end to see its film. The film is then not dropped.
    pub fn set_film_wanted(&self, wanted: bool) {
        self.film_wanted.store(wanted, Ordering::Release);
    }

    pub(crate) fn is_film_wanted(&self) -> bool {
        self.film_wanted.load(Ordering::Acquire)
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Acquire)
    }

    /// Asks for the job to end. The executor leaves it at its next slice. True if it was still going.
    pub(crate) fn cancel(&self) -> bool {
        // A job that has ended is not marked, since a done render may yet get a new camera.
        let ended = self.end(State::Cancelled, None);
        self.cancelled.fetch_or(ended, Ordering::AcqRel);
        ended
    }

    /// The error by which it failed.
    pub fn failure(&self) -> Option<Error> {
        self.lock().failure.clone()
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

    /// Puts a new camera in and forgets the results of the old one.
    ///
    /// # Errors
    /// [`Error::Conflict`] for a render that was cancelled or failed.
    pub(crate) fn restart(&self, camera: Camera) -> Result<Restart> {
        let mut progress = self.lock();
        if matches!(progress.state, State::Cancelled | State::Failed) {
            return Err(Error::Conflict("this render was cancelled or has failed; post a new one".into()));
        }
        if let Task::Picture(scene) = &mut progress.task {
            scene.set_camera(camera);
        }
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
            // The final frame is not final any more.
            u.frame = u.frame.as_ref().map(|f| Arc::new(Frame { is_final: false, ..(**f).clone() }));
        });
        Ok(Restart { again, was_done })
    }

    /// The bytes that are held for readers.
    pub(crate) fn bytes(&self) -> usize {
        let frame = self.updates.borrow().frame.as_ref().map_or(0, |f| f.png.len());
        let progress = self.lock();
        frame
            + progress.field.as_ref().map_or(0, |f| f.bytes() as usize)
            + progress.file.as_ref().map_or(0, |f| f.bytes.len())
    }

    /// The request as it was posted, with the planner's additions.
    pub fn request(&self) -> &Value {
        &self.request
    }

    /// Its convergence trace.
    pub fn trace(&self) -> Vec<TracePoint> {
        self.lock().trace.clone()
    }
}
