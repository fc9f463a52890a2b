//! The render resource of the HTTP contract.

use serde_json::{Value, json};

use super::Job;
use crate::error::Error;

impl Job {
    /// A line of `GET /v1/renders`.
    pub fn summary(&self) -> Value {
        let p = self.lock();
        json!({
            "id": self.id, "state": p.state, "technique": p.scene.technique().name, "image": p.scene.image(),
            "samples": p.samples, "error": p.error.map(|e| e.total), "created_unix_s": self.created_unix_s,
        })
    }

    /// The render resource.
    pub fn resource(&self) -> Value {
        let p = self.lock();
        let path = |rest: &str| format!("/v1/renders/{}{rest}", self.id);
        json!({
            "id": self.id,
            "state": p.state,
            "technique": p.scene.technique().name,
            "request": self.request,
            "camera": p.scene.camera().to_json(),
            "image": {"width": p.scene.image()[0], "height": p.scene.image()[1]},
            "plan": {"technique": p.scene.technique().name, "reasons": p.reasons, "planned": self.planned, "budget": {
                "samples": p.scene.budget().samples, "time_ms": p.scene.budget().time_ms, "max_error": p.scene.budget().max_error}},
            "samples": p.samples,
            "error": p.error.map(|e| e.total),
            "error_parts": p.error,
            "stopped_by": p.stopped_by,
            "failure": p.failure.as_ref().map(|error| match error {
                Error::Internal(_) => "the render failed on the server".to_owned(),
                other => other.to_string(),
            }),
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
