//! The record of an export: its progress, and its file.

use std::sync::Arc;

use serde_json::{Value, json};

use super::progress::Progress;
use super::{Job, State, Task};
use crate::render::ExportTask;
use crate::technique::{self, File};

impl Job {
    /// The task of an export; `None` for a render.
    pub(crate) fn export(&self) -> Option<ExportTask> {
        match &self.lock().task {
            Task::File(task) => Some(ExportTask::clone(task)),
            Task::Picture(_) => None,
        }
    }

    /// Notes the progress of an export and its device time.
    pub(crate) fn worked(&self, work: technique::Progress, device_ms: f64) {
        let mut progress = self.lock();
        progress.work = Some(work);
        progress.timings.device_ms = device_ms;
        progress.timings.elapsed_ms = progress.asked.elapsed().as_secs_f64() * 1e3;
        self.updates.send_modify(|update| update.work = Some(work));
    }

    /// Hands over the file of an export that is kept as an asset before the export ends.
    pub(crate) fn hand_over(&self, file: File) {
        let mut progress = self.lock();
        if progress.state.is_terminal() {
            return;
        }
        progress.handed = Some(file);
        self.updates.send_modify(|update| update.is_handed_over = true);
    }

    /// The file that was handed over, once.
    pub(crate) fn handed_over(&self) -> Option<File> {
        self.lock().handed.take()
    }

    /// Ends an export with its file. False if it has ended already.
    pub(crate) fn finish_file(&self, file: File) -> bool {
        let mut progress = self.lock();
        if progress.state.is_terminal() {
            return false;
        }
        let warnings = file.result["warnings"].as_array();
        progress.warnings.extend(warnings.into_iter().flatten().cloned());
        progress.result = Some(file.result.clone());
        progress.file = Some(Arc::new(file));
        progress.state = State::Done;
        progress.in_engine = false;
        progress.timings.elapsed_ms = progress.asked.elapsed().as_secs_f64() * 1e3;
        self.updates.send_modify(|update| update.state = State::Done);
        true
    }

    /// The file of a finished export.
    pub fn file(&self) -> Option<Arc<File>> {
        self.lock().file.clone()
    }

    /// The export resource.
    pub(super) fn export_resource(&self, p: &Progress, task: &ExportTask) -> Value {
        let path = |rest: &str| format!("/v1/exports/{}{rest}", self.id);
        let file = p.file.as_ref();
        json!({
            "id": self.id,
            "state": p.state,
            "technique": task.technique().name,
            "request": self.request,
            "plan": {"technique": task.technique().name, "reasons": p.reasons},
            "progress": p.work.map(|work| json!({"of": work.of, "done": work.done, "total": work.total})),
            "file": file.map(|f| json!({"media_type": f.media_type, "extension": f.extension, "bytes": f.bytes.len()})),
            "failure": p.failure_words(),
            "waits_for": p.waits_for.as_ref().map(|kernel| json!({"kernel": kernel})),
            "timings": {"queued_ms": p.timings.queued_ms, "device_ms": p.timings.device_ms, "elapsed_ms": p.timings.elapsed_ms},
            "warnings": p.warnings,
            "result": p.result,
            "created_unix_s": self.created_unix_s,
            "links": {"self": path(""), "file": path("/file"), "events": path("/events")},
        })
    }
}
