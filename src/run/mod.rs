//! The execution of jobs. The device thread goes round the live jobs and gives each of them a slice, while processes compile kernels beside it.
//!
//! A live job has a stage (`live.rs`): its field fills (`field_run.rs`), its view makes a picture of the incomplete field, or its view refines the
//! picture (`view_run.rs`) until its budget is used up (`stopping.rs`).

mod begin;
mod compile;
mod context;
mod counts;
mod device_thread;
mod device_volume;
mod distances;
mod export_run;
mod field_run;
mod first;
mod gathered;
mod kernels;
mod layer;
mod live;
mod motion;
mod places;
mod probe;
mod rounds;
mod sources;
mod stopping;
mod tiling;
mod view_run;
mod view_turn;
mod volumes;
mod warm;
mod warnings;

use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};

use tokio::sync::{oneshot, watch};

pub use compile::compile_kernels;
use device_thread::{Command, DeviceThread};
use kernels::Kernels;
pub use sources::sources;

use crate::config::Limits;
use crate::device::DeviceConfig;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::job::{Executor, Job, KernelProgress, Readiness};

/// The device thread of this process, as an executor of jobs. It ends when this is dropped.
pub struct DeviceExecutor {
    commands: Sender<Command>,
    kernels: Kernels,
    readiness: watch::Receiver<Readiness>,
}

impl DeviceExecutor {
    /// Starts the device thread.
    ///
    /// # Errors
    /// [`Error::Internal`] when no thread can be started.
    pub fn start(config: DeviceConfig, limits: &Limits) -> Result<Self> {
        let (commands, incoming) = channel();
        let (ready, readiness) = watch::channel(Readiness::Starting);
        let kernels = Kernels::default();
        let thread = DeviceThread {
            config,
            kernels: kernels.clone(),
            commands: commands.clone(),
            most_live: limits.live_renders.max(1),
            keep_film_bytes: limits.keep_film_bytes,
        };
        std::thread::Builder::new()
            .name("device".into())
            .spawn(move || thread.run(&incoming, &ready))
            .map_err(Error::internal)?;
        Ok(Self { commands, kernels, readiness })
    }
}

impl Drop for DeviceExecutor {
    fn drop(&mut self) {
        // A device thread that has ended by itself need not be told.
        drop(self.commands.send(Command::Stop));
    }
}

impl Executor for DeviceExecutor {
    fn take(&self, job: &Arc<Job>) {
        if self.commands.send(Command::Run(job.clone())).is_err() {
            job.fail(&Error::internal("the device thread ended"));
        }
    }

    fn send_film(&self, job: &Arc<Job>, to: oneshot::Sender<Result<Film>>) {
        // A device thread that has ended drops the sender, which tells the receiver.
        drop(self.commands.send(Command::Film(job.clone(), to)));
    }

    fn readiness(&self) -> watch::Receiver<Readiness> {
        self.readiness.clone()
    }

    fn kernels(&self) -> KernelProgress {
        self.kernels.progress()
    }
}
