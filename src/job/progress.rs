//! The changing part of a job, and the reports of its executor.

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

/// The changing part of a job. It has one lock, which is held for moments.
pub(super) struct Progress {
    pub state: State,
    /// The number of the newest camera. Work for an older one is thrown away.
    pub generation: u64,
    /// The time at which the render, or its newest camera, was asked for.
    pub asked: Instant,
    pub task: Task,
    /// True if the executor holds the job. A job that it does not hold is submitted again with a new camera.
    pub in_engine: bool,
    pub reasons: Vec<String>,
    pub warnings: Vec<Value>,
    pub trace: Vec<TracePoint>,
    pub timings: Timings,
    /// The time that the first frame of a recent camera took, ms. It counts from the request for the camera, or from the frame before if that came
    /// later.
    pub frame_ms: Option<f64>,
    /// The time at which the newest frame came.
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
    /// The device time of the field, ms.
    pub field_ms: f64,
    /// The field once it has all its histories. A new camera looks at it again.
    pub complete_field: Option<Arc<Volume>>,
    pub sequence: u64,
    /// The progress of an export. `file` is its file at the end.
    pub work: Option<technique::Progress>,
    pub file: Option<Arc<File>>,
    /// The file of an export, until it is kept.
    pub handed: Option<File>,
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
            handed: None,
        }
    }
}

/// The newest camera of a job, on which an executor works.
pub(crate) struct NewestCamera {
    /// The number of the camera.
    pub generation: u64,
    /// The time at which it was asked for.
    pub asked: Instant,
    pub scene: Scene,
    /// The time that the first frame of the camera before took, ms.
    pub frame_ms: Option<f64>,
    /// The complete field, if an earlier camera has looked at all of it.
    pub complete_field: Option<Arc<Volume>>,
}

impl Job {
    /// The newest camera, unless its generation is `seen`.
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

    /// Sets the state to running. The first time, it notes the time that the job waited.
    pub(crate) fn started(&self) {
        let mut progress = self.lock();
        progress.waits_for = None;
        if progress.state == State::Queued {
            progress.state = State::Running;
            progress.timings.queued_ms = Some(progress.asked.elapsed().as_secs_f64() * 1e3);
            self.updates.send_modify(|u| u.state = State::Running);
        }
    }

    /// Notes the kernel that the job waits for.
    pub(crate) fn waits_for(&self, kernel: String) {
        self.lock().waits_for = Some(kernel);
    }

    /// Notes the reasons for its plan.
    pub(crate) fn set_reasons(&self, reasons: Vec<String>) {
        self.lock().reasons = reasons;
    }

    /// Notes the warnings about the volume and the parameters on it.
    pub(crate) fn set_warnings(&self, warnings: Vec<Value>, non_finite_voxels: u64) {
        let mut progress = self.lock();
        progress.warnings = warnings;
        progress.counts.non_finite_voxels = non_finite_voxels;
    }

    /// Adds a warning.
    pub(crate) fn warn(&self, warning: Value) {
        self.lock().warnings.push(warning);
    }

    /// Notes the grid of its field as it is, and the device time that it took. A complete grid serves every later camera.
    pub(crate) fn set_field(&self, field: &Arc<Volume>, complete: bool, device_ms: f64) {
        let mut progress = self.lock();
        progress.field = Some(field.clone());
        progress.field_ms = device_ms;
        if complete {
            progress.complete_field = Some(field.clone());
        }
    }

    /// Takes the encoder. True if no snapshot was being encoded; only then is a new one worth while.
    pub(crate) fn take_encoder(&self) -> bool {
        !self.encoding.swap(true, Ordering::AcqRel)
    }

    /// Leaves a snapshot to be encoded. It replaces one that waits.
    pub(crate) fn leave_snapshot(&self, snapshot: Snapshot) {
        self.encoding.store(true, Ordering::Release);
        self.snapshots.send_replace(Some(Arc::new(snapshot)));
    }

    /// Notes that the executor has finished the job for the camera of `generation`. `false` if there is a newer camera, so that the executor has to
    /// go on.
    pub(crate) fn leave(&self, generation: u64) -> bool {
        let mut progress = self.lock();
        let newest = progress.generation == generation;
        progress.in_engine &= !newest;
        newest
    }

    /// Fails for good. The text of an internal error is for the log; a client learns only that it happened.
    pub(crate) fn fail(&self, error: &Error) -> bool {
        if let Error::Internal(cause) = error {
            tracing::error!(render = %self.id, %cause, "render failed");
        }
        self.end(State::Failed, Some(error.clone()))
    }
}
