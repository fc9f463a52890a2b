//! What changes while a job lives, and what its executor tells it.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use serde_json::Value;

use super::report::{Counts, State, Timings, TracePoint};
use super::{Job, Snapshot, Task};
use crate::error::Error;
use crate::film::ErrorEstimate;
use crate::render::Scene;
use crate::technique::{self, File};
use crate::volume::Volume;

/// What changes while a job lives. One lock, held for moments.
pub(super) struct Progress {
    pub state: State,
    /// Counts cameras: work for an older one is thrown away.
    pub generation: u64,
    /// When the render, or its newest camera, was asked for.
    pub asked: Instant,
    pub task: Task,
    /// True if the engine holds the job; a new camera for one that it does not hold is submitted again.
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
    pub field: Option<Arc<Volume>>,
    /// What the device took for it, ms.
    pub field_ms: f64,
    /// The field once all its histories are in it: a new camera looks at it again.
    pub complete_field: Option<Arc<Volume>>,
    pub sequence: u64,
    /// How much of an export is done, and its file at the end.
    pub work: Option<technique::Progress>,
    pub file: Option<Arc<File>>,
}

impl Progress {
    pub fn new(task: Task) -> Self {
        Self {
            state: State::Queued,
            generation: 0,
            asked: Instant::now(),
            task,
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
            field_ms: 0.0,
            complete_field: None,
            sequence: 0,
            work: None,
            file: None,
        }
    }
}

/// What an executor works on: the newest camera of a job.
pub(crate) struct NewestCamera {
    /// Counts cameras.
    pub generation: u64,
    /// When it was asked for.
    pub asked: Instant,
    pub scene: Scene,
    /// What the first frame of the camera before took, ms.
    pub frame_ms: Option<f64>,
    /// The field, where an earlier camera has looked at all of it.
    pub complete_field: Option<Arc<Volume>>,
}

impl Job {
    /// The newest camera, unless it is that of generation `seen`.
    pub(crate) fn newest_camera(&self, seen: Option<u64>) -> Option<NewestCamera> {
        let mut progress = self.lock();
        let Task::Picture(scene) = progress.task.clone() else { return None };
        (Some(progress.generation) != seen).then(|| NewestCamera {
            generation: progress.generation,
            asked: progress.asked,
            scene: *scene,
            frame_ms: progress.frame_ms.take(),
            complete_field: progress.complete_field.clone(),
        })
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

    /// Notes which kernel it waits for.
    pub(crate) fn waits_for(&self, kernel: String) {
        self.lock().waits_for = Some(kernel);
    }

    /// Notes why it is planned so.
    pub(crate) fn set_reasons(&self, reasons: Vec<String>) {
        self.lock().reasons = reasons;
    }

    /// Notes what a reader should know of the volume and of the parameters on it.
    pub(crate) fn set_warnings(&self, warnings: Vec<Value>, non_finite_voxels: u64) {
        let mut progress = self.lock();
        progress.warnings = warnings;
        progress.counts.non_finite_voxels = non_finite_voxels;
    }

    /// Notes one thing more that a reader should know.
    pub(crate) fn warn(&self, warning: Value) {
        self.lock().warnings.push(warning);
    }

    /// Notes the grid of its field as it is, and what the device took for it; a complete one serves every camera to come.
    pub(crate) fn set_field(&self, field: &Arc<Volume>, complete: bool, device_ms: f64) {
        let mut progress = self.lock();
        progress.field = Some(field.clone());
        progress.field_ms = device_ms;
        if complete {
            progress.complete_field = Some(field.clone());
        }
    }

    /// Takes the encoder, where no snapshot is being encoded: only then is it worth while to make one.
    pub(crate) fn take_encoder(&self) -> bool {
        !self.encoding.swap(true, Ordering::AcqRel)
    }

    /// Leaves a snapshot to be encoded; one that waits is replaced.
    pub(crate) fn leave_snapshot(&self, snapshot: Snapshot) {
        self.encoding.store(true, Ordering::Release);
        self.snapshots.send_replace(Some(Arc::new(snapshot)));
    }

    /// The executor is through with the job for the camera of `generation`. `false` when there is a newer camera, so
    /// that it has to go on.
    pub(crate) fn leave(&self, generation: u64) -> bool {
        let mut progress = self.lock();
        let newest = progress.generation == generation;
        progress.in_engine &= !newest;
        newest
    }

    /// Fails for good. An internal error's text is for the log; a client learns that it happened.
    pub(crate) fn fail(&self, error: &Error) -> bool {
        if let Error::Internal(cause) = error {
            tracing::error!(render = %self.id, %cause, "render failed");
        }
        self.end(State::Failed, Some(error.clone()))
    }
}
