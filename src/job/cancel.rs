//! A guard that cancels a job that nobody waits for any more, as when a client goes away.

use std::sync::Arc;

use super::{Engine, Job};

/// Cancels its job if it is dropped before the job's end.
pub struct CancelOnDrop {
    engine: Engine,
    job: Arc<Job>,
}

impl CancelOnDrop {
    /// A guard of `job`.
    pub fn new(engine: &Engine, job: Arc<Job>) -> Self {
        Self { engine: engine.clone(), job }
    }

    /// The job.
    pub fn job(&self) -> &Arc<Job> {
        &self.job
    }
}

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.engine.cancel(&self.job);
    }
}
