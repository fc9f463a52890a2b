//! Who works on jobs: the device thread of this process (`run/`), or whatever else can do what [`Executor`] asks.

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
    /// The first picture can be rendered; other kernels may still be compiled, which [`Executor::kernels`] tells.
    Ready(Arc<DeviceInfo>),
    /// The device could not be opened, or builds no kernel.
    Failed(String),
}

/// How far the kernels are.
#[derive(Debug, Clone, Default, Serialize)]
pub struct KernelProgress {
    /// Variants that are compiled, of those
    pub built: usize,
    /// that are compiled ahead or were asked for.
    pub of: usize,
    /// Variants that do not build here: requests that need them are refused.
    pub failed: Vec<String>,
}

impl KernelProgress {
    /// True if nothing is left to compile.
    pub fn is_over(&self) -> bool {
        self.built + self.failed.len() == self.of
    }
}

/// Works on the jobs that it is given, until their budget is used up, and tells their record how far they are.
pub trait Executor: Send + Sync {
    /// Takes a job that is new, or that it has left and that has a new camera.
    fn take(&self, job: &Arc<Job>);
    /// Sends what a render has gathered by now, with its pixels; of one that has nothing yet once it has. Where it is not kept any more, `to` is
    /// dropped.
    fn send_film(&self, job: &Arc<Job>, to: oneshot::Sender<Result<Film>>);
    /// Its readiness, and each change of that.
    fn readiness(&self) -> watch::Receiver<Readiness>;
    /// How far its kernels are.
    fn kernels(&self) -> KernelProgress;
}
