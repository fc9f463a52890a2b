//! The device thread: goes round the live jobs, a slice each.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};

use tokio::sync::watch;

use super::Job;
use super::context::DeviceContext;
use super::engine::Readiness;
use super::kernels::Kernels;
use super::live::{Live, Turn};
use crate::device::{DeviceConfig, NO_DEVICE};
use crate::error::Error;

/// What the device thread is told.
pub(super) enum Command {
    /// A render to run.
    Run(Arc<Job>),
    /// A kernel has been compiled, or cannot be.
    Kernel,
    /// Nobody is left to ask for anything.
    Stop,
}

/// What the device thread starts with.
pub(super) struct DeviceThread {
    pub config: DeviceConfig,
    pub kernels: Kernels,
    /// To itself, for those who compile its kernels.
    pub commands: Sender<Command>,
    pub most_live: usize,
}

/// The renders on the device thread.
#[derive(Default)]
struct Renders {
    waiting: VecDeque<Arc<Job>>,
    live: VecDeque<Live>,
    /// Those that wait for a kernel.
    parked: VecDeque<Live>,
}

impl DeviceThread {
    /// Opens the device, then goes round the live jobs, a slice each, until it is told to stop.
    pub fn run(self, incoming: &Receiver<Command>, readiness: &watch::Sender<Readiness>) {
        let commands = self.commands.clone();
        // Who has gone does not need to be woken.
        let wake = move || drop(commands.send(Command::Kernel));
        let mut context = match DeviceContext::open(&self.config, self.kernels.clone(), wake) {
            Ok(context) => context,
            Err(error) => {
                tracing::error!(%error, "{NO_DEVICE}");
                readiness.send_replace(Readiness::Failed(error.to_string()));
                // Whoever got in before must not wait for ever.
                loop {
                    match incoming.recv() {
                        Ok(Command::Run(job)) => drop(job.fail(&Error::Unavailable(NO_DEVICE.into()))),
                        Ok(Command::Kernel) => {}
                        Ok(Command::Stop) | Err(_) => return,
                    }
                }
            }
        };
        readiness.send_replace(Readiness::Ready(Arc::new(context.device.info().clone())));
        let mut renders = Renders::default();
        loop {
            if renders.live.is_empty() && renders.waiting.is_empty() {
                context.tidy();
                if !context.build_ahead() {
                    match incoming.recv() {
                        Ok(Command::Stop) | Err(_) => return,
                        Ok(command) => renders.told(command),
                    }
                }
            }
            for command in incoming.try_iter() {
                if matches!(command, Command::Stop) {
                    return;
                }
                renders.told(command);
            }
            renders.turn(&mut context, self.most_live);
        }
    }
}

impl Renders {
    fn told(&mut self, command: Command) {
        match command {
            Command::Run(job) => self.waiting.push_back(job),
            Command::Kernel => self.live.append(&mut self.parked),
            Command::Stop => {}
        }
    }

    /// A turn of the next.
    fn turn(&mut self, context: &mut DeviceContext, most_live: usize) {
        self.waiting.retain(|job| !job.state().is_terminal());
        while self.live.len() < most_live {
            let Some(job) = self.waiting.pop_front() else { break };
            self.live.push_back(Live::new(job));
        }
        metrics::gauge!("cloudchamber_renders_live").set(self.live.len() as f64);
        metrics::gauge!("cloudchamber_renders_waiting").set((self.waiting.len() + self.parked.len()) as f64);
        let Some(mut current) = self.live.pop_front() else { return };
        // A panic in one job is that job's failure and nobody else's.
        match catch_unwind(AssertUnwindSafe(|| current.turn(context))) {
            Ok(Ok(Turn::Again)) => self.live.push_back(current),
            Ok(Ok(Turn::Waits)) => self.parked.push_back(current),
            Ok(Ok(Turn::Over)) => {}
            Ok(Err(error)) => current.fail(error),
            Err(_) => current.fail(Error::internal("a panic on the device thread")),
        }
    }
}
