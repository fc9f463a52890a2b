//! The resources of the HTTP contract: a render's here, an export's in `export.rs`.

use serde_json::{Value, json};

use super::progress::Progress;
use super::{Job, Task};
use crate::error::Error;
use crate::render::Scene;

impl Progress {
    /// The failure in words for a client.
    pub(super) fn failure_words(&self) -> Option<String> {
        self.failure.as_ref().map(|error| match error {
            Error::Internal(_) => match &self.task {
                Task::Picture(_) => "the render failed on the server".to_owned(),
                Task::File(_) => "the export failed on the server".to_owned(),
            },
            other => other.to_string(),
        })
    }
}

impl Job {
    /// A line of `GET /v1/renders` or `/v1/exports`.
    pub fn summary(&self) -> Value {
        let p = self.lock();
        match &p.task {
            Task::Picture(scene) => json!({
                "id": self.id, "state": p.state, "technique": scene.technique().name, "image": scene.image(),
                "samples": p.samples, "error": p.error.and_then(|e| e.total), "created_unix_s": self.created_unix_s,
            }),
            Task::File(task) => json!({
                "id": self.id, "state": p.state, "technique": task.technique().name,
                "created_unix_s": self.created_unix_s,
            }),
        }
    }

    /// The whole resource of the render or export.
    pub fn resource(&self) -> Value {
        let p = self.lock();
        match &p.task {
            Task::Picture(scene) => self.render_resource(&p, scene),
            Task::File(task) => self.export_resource(&p, task),
        }
    }

    fn render_resource(&self, p: &Progress, scene: &Scene) -> Value {
        let path = |rest: &str| format!("/v1/renders/{}{rest}", self.id);
        let (technique, budget) = (scene.technique().name, scene.budget());
        json!({
            "id": self.id,
            "state": p.state,
            "technique": technique,
            "request": self.request,
            "camera": scene.camera().to_json(),
            "image": {"width": scene.image()[0], "height": scene.image()[1]},
            "plan": {"technique": technique, "reasons": p.reasons, "planned": self.planned, "budget": {
                "samples": budget.samples, "time_ms": budget.time_ms, "max_error": budget.max_error}},
            "samples": p.samples,
            "error": p.error.and_then(|e| e.total),
            "error_parts": p.error,
            "stopped_by": p.stopped_by,
            "failure": p.failure_words(),
            "waits_for": p.waits_for.as_ref().map(|kernel| json!({"kernel": kernel})),
            "timings": p.timings,
            "counts": p.counts,
            "warnings": p.warnings,
            "trace": p.trace,
            "trace_slope": super::report::slope(&p.trace),
            "result": p.result,
            "created_unix_s": self.created_unix_s,
            "links": {"self": path(""), "frames": path("/frames"), "png": path("/frame.png"), "exr": path("/frame.exr"),
                "events": path("/events"), "convergence": path("/convergence.svg"), "camera": path("/camera"), "field": path("/field")},
        })
    }
}
