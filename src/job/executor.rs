//! The interface of an executor of jobs: the device thread of this process (`run/`), or anything else that implements [`Executor`].

use std::sync::Arc;

use serde::Serialize;
use tokio::sync::{oneshot, watch};

use super::Job;
use crate::device::DeviceInfo;
use crate::error::Result;
use crate::film::Film;

/// The readiness of a device.
#[derive(Debug, Clone)]
pub enum Readiness {
    /// The device is opened, and the first kernels are built.
    Starting,
    /// The first picture can be rendered. Other kernels may still be compiled, as [`Executor::kernels`] tells.
    Ready(Arc<DeviceInfo>),
    /// The device could not be opened, or builds no kernel.
    Failed(String),
}

/// The progress of the kernels.
#[derive(Debug, Clone, Default, Serialize)]
pub struct KernelProgress {
    /// The number of variants that are compiled.
    pub built: usize,
    /// The number of variants that are compiled ahead or were asked for.
    pub of: usize,
    /// The variants that do not build here. Requests that need them are refused.
    pub failed: Vec<String>,
}

impl KernelProgress {
    /// True if nothing is left to compile.
    pub fn is_over(&self) -> bool {
        self.built + self.failed.len() == self.of
    }
}

/// Works on its jobs until their budget is used up, and records their progress.
pub trait Executor: Send + Sync {
    /// Takes a job that is new, or a job that it has left and that has a new camera.
    fn take(&self, job: &Arc<Job>);
    /// Sends the film of a render so far, with its pixels. If the render has no samples yet, the film is sent once it has some. If the film is not
    /// kept any more, `to` is dropped.
    fn send_film(&self, job: &Arc<Job>, to: oneshot::Sender<Result<Film>>);
    /// The readiness of the device, and each change of it.
    fn readiness(&self) -> watch::Receiver<Readiness>;
    /// The progress of its kernels.
    fn kernels(&self) -> KernelProgress;
}
