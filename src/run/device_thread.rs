//! The device thread. It goes round the live jobs and gives each of them a slice.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};

use tokio::sync::{oneshot, watch};

use super::context::DeviceContext;
use super::export_run::ExportRun;
use super::kernels::Kernels;
use super::live::{Live, Rested, Turn};
use crate::device::{DeviceConfig, NO_DEVICE};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::job::{Job, Readiness};

/// A message to the device thread.
pub(super) enum Command {
    /// A job to run.
    Run(Arc<Job>),
    /// A request for a render's film.
    Film(Arc<Job>, oneshot::Sender<Result<Film>>),
    /// A kernel has been compiled, or does not compile.
    Kernel,
    /// Nobody can ask for anything any more.
    Stop,
}

/// The settings and channels of a device thread.
pub(super) struct DeviceThread {
    pub config: DeviceConfig,
    pub kernels: Kernels,
    /// The sender to itself, for the threads that compile its kernels.
    pub commands: Sender<Command>,
    pub most_live: usize,
    /// The bytes of films of ended renders that are kept.
    pub keep_film_bytes: usize,
}

/// A job that takes turns on the device.
enum Work {
    Picture(Box<Live>),
    File(Box<ExportRun>),
}

impl Work {
    fn turn(&mut self, context: &mut DeviceContext) -> Result<Turn> {
        match self {
            Self::Picture(live) => live.turn(context),
            Self::File(run) => run.turn(context),
        }
    }

    fn job(&self) -> &Arc<Job> {
        match self {
            Self::Picture(live) => live.job(),
            Self::File(run) => run.job(),
        }
    }

    /// The film of a render so far; `None` if it has none.
    fn film(&mut self, context: &DeviceContext) -> Result<Option<Film>> {
        match self {
            Self::Picture(live) => live.film(context),
            Self::File(_) => Ok(None),
        }
    }

    /// Ends the work. A render leaves the samples that it has gathered.
    fn rest(self) -> Option<Rested> {
        match self {
            Self::Picture(live) => live.rest(),
            Self::File(_) => None,
        }
    }
}

/// The jobs on the device thread.
#[derive(Default)]
struct Renders {
    waiting: VecDeque<Arc<Job>>,
    live: VecDeque<Work>,
    /// The jobs that wait for a kernel.
    parked: VecDeque<Work>,
    /// The samples of ended renders, the newest last.
    rested: Vec<Rested>,
    /// The requests for films that are not answered yet.
    asked: Vec<(Arc<Job>, oneshot::Sender<Result<Film>>)>,
}

impl DeviceThread {
    /// Opens the device, then goes round the live jobs, a slice each, until it is told to stop.
    pub fn run(self, incoming: &Receiver<Command>, readiness: &watch::Sender<Readiness>) {
        let commands = self.commands.clone();
        // A device thread that has gone need not be woken.
        let wake = move || drop(commands.send(Command::Kernel));
        let mut context = match DeviceContext::open(&self.config, self.kernels.clone(), wake) {
            Ok(context) => context,
            Err(error) => {
                tracing::error!(%error, "{NO_DEVICE}");
                readiness.send_replace(Readiness::Failed(error.to_string()));
                // Jobs that were taken before must not wait for ever.
                loop {
                    match incoming.recv() {
                        Ok(Command::Run(job)) => drop(job.fail(&Error::Unavailable(NO_DEVICE.into()))),
                        Ok(Command::Kernel | Command::Film(..)) => {}
                        Ok(Command::Stop) | Err(_) => return,
                    }
                }
            }
        };
        readiness.send_replace(Readiness::Ready(Arc::new(context.device.info().clone())));
        let mut renders = Renders::default();
        loop {
            if renders.live.is_empty() && renders.waiting.is_empty() {
                renders.forget();
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
            renders.turn(&mut context, self.most_live, self.keep_film_bytes);
            renders.show(&context);
        }
    }
}

impl Renders {
    fn told(&mut self, command: Command) {
        match command {
            Command::Run(job) => self.waiting.push_back(job),
            Command::Film(job, to) => self.asked.push((job, to)),
            Command::Kernel => self.live.append(&mut self.parked),
            Command::Stop => {}
        }
    }

    /// Admits waiting jobs, then gives the next live job a turn.
    fn turn(&mut self, context: &mut DeviceContext, most_live: usize, keep_film_bytes: usize) {
        self.waiting.retain(|job| !job.state().is_terminal());
        while self.live.len() < most_live {
            let Some(job) = self.waiting.pop_front() else { break };
            let work = match job.export() {
                Some(task) => Work::File(Box::new(ExportRun::new(job, task))),
                None => {
                    let rested = self.memory_for(&job, keep_film_bytes);
                    Work::Picture(Box::new(Live::new(job, rested)))
                }
            };
            self.live.push_back(work);
        }
        metrics::gauge!("cloudchamber_renders_live").set(self.live.len() as f64);
        metrics::gauge!("cloudchamber_renders_waiting").set((self.waiting.len() + self.parked.len()) as f64);
        let Some(mut current) = self.live.pop_front() else { return };
        // A panic in one job fails that job and no other.
        match catch_unwind(AssertUnwindSafe(|| current.turn(context))) {
            Ok(Ok(Turn::Again)) => self.live.push_back(current),
            Ok(Ok(Turn::Waits)) => self.parked.push_back(current),
            Ok(Ok(Turn::Over)) => self.rest(current, keep_film_bytes),
            Ok(Err(error)) => drop(current.job().fail(&error)),
            Err(_) => drop(current.job().fail(&Error::internal("a panic on the device thread"))),
        }
    }

    /// The memory for a render's samples: its own from before, or that of the oldest ended render, if that would be dropped for the new one.
    fn memory_for(&mut self, job: &Arc<Job>, keep_film_bytes: usize) -> Option<Rested> {
        let own = self.rested.iter().position(|r| r.is_of(job));
        let newest = self.rested.last().map_or(0, |r| r.gathered.bytes());
        let oldest = || self.oldest(keep_film_bytes.saturating_sub(newest));
        own.or_else(oldest).map(|at| self.rested.remove(at))
    }

    /// Keeps the samples of an ended render, and drops the oldest ones past the limit.
    fn rest(&mut self, ended: Work, keep_film_bytes: usize) {
        self.forget();
        self.rested.extend(ended.rest());
        while let Some(oldest) = self.oldest(keep_film_bytes) {
            self.rested.remove(oldest);
        }
    }

    /// The oldest ended render that may be dropped, if all of them take more than `keep_film_bytes`. The newest is kept, however large it is, and
    /// so is a render whose film somebody waits for.
    fn oldest(&self, keep_film_bytes: usize) -> Option<usize> {
        let bytes: usize = self.rested.iter().map(|r| r.gathered.bytes()).sum();
        let (_, others) = self.rested.split_last().filter(|_| bytes > keep_film_bytes)?;
        others.iter().position(|r| !r.job.upgrade().is_some_and(|job| job.is_film_wanted()))
    }

    /// Drops the samples of renders that nobody can ask for any more.
    fn forget(&mut self) {
        self.rested.retain(|rested| rested.job.strong_count() > 0);
    }

    /// Sends films to those who asked. A render with samples is answered at once, and one without samples as soon as it has some. A request for a
    /// render that has left nothing is dropped.
    fn show(&mut self, context: &DeviceContext) {
        for (job, to) in std::mem::take(&mut self.asked) {
            let mut live = self.live.iter_mut().chain(&mut self.parked).filter(|live| Arc::ptr_eq(live.job(), &job));
            let rested = self.rested.iter_mut().find(|rested| rested.is_of(&job));
            let waits = self.waiting.iter().any(|waiting| Arc::ptr_eq(waiting, &job));
            let film = match (live.next(), rested) {
                (Some(live), _) => live.film(context),
                (None, Some(rested)) => rested.gathered.film(context).map(Some),
                (None, None) if waits => Ok(None),
                (None, None) => continue,
            };
            match film.transpose() {
                // A receiver that has gone need not be told.
                Some(film) => drop(to.send(film)),
                None => self.asked.push((job, to)),
            }
        }
    }
}
