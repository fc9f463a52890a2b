//! The engine: admits jobs, keeps them readable, and runs the device thread, which goes round the live ones in slices.

use std::collections::{HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::watch;

use super::context::DeviceContext;
use super::live::{Live, Turn};
use super::{Job, State, develop};
use crate::config::Limits;
use crate::device::{Device, DeviceConfig, DeviceInfo};
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::camera::Camera;

/// Whether the device is ready to work.
#[derive(Debug, Clone)]
pub enum Readiness {
    /// Kernels are being built and warmed.
    Starting,
    /// Everything is built.
    Ready(Arc<DeviceInfo>),
    /// The device could not be opened or a kernel not be built.
    Failed(String),
}

struct Inner {
    commands: Sender<Arc<Job>>,
    limits: Limits,
    readiness: watch::Receiver<Readiness>,
    draining: AtomicBool,
    unfinished: AtomicUsize,
    jobs: Mutex<Jobs>,
    runtime: tokio::runtime::Handle,
}

#[derive(Default)]
struct Jobs {
    by_id: HashMap<String, Arc<Job>>,
    /// Ended jobs, oldest first: the ones that may be forgotten.
    ended: VecDeque<String>,
}

/// A place in the queue; given back when dropped unless a render has taken it.
pub struct Place {
    engine: Engine,
    taken: bool,
}

impl Drop for Place {
    fn drop(&mut self) {
        if !self.taken {
            self.engine.inner.unfinished.fetch_sub(1, Ordering::AcqRel);
        }
    }
}

/// A handle on the engine; clones share it.
#[derive(Clone)]
pub struct Engine {
    inner: Arc<Inner>,
}

impl Engine {
    /// Starts the device thread. Must be called within a tokio runtime, on which frames are then developed.
    ///
    /// # Errors
    /// [`Error::Internal`] when no thread can be started.
    pub fn start(config: DeviceConfig, limits: Limits) -> Result<Self> {
        let (commands, incoming) = channel();
        let (readiness, ready) = watch::channel(Readiness::Starting);
        let live = limits.live_renders.max(1);
        std::thread::Builder::new()
            .name("device".into())
            .spawn(move || device_thread(&config, &incoming, &readiness, live))
            .map_err(Error::internal)?;
        let inner = Inner {
            commands,
            limits,
            readiness: ready,
            draining: AtomicBool::new(false),
            unfinished: AtomicUsize::new(0),
            jobs: Mutex::default(),
            runtime: tokio::runtime::Handle::current(),
        };
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Whether the device is ready.
    pub fn readiness(&self) -> Readiness {
        self.inner.readiness.borrow().clone()
    }

    /// Waits until the device is ready.
    ///
    /// # Errors
    /// [`Error::Internal`] when it failed to become so.
    pub async fn ready(&self) -> Result<Arc<DeviceInfo>> {
        let mut readiness = self.inner.readiness.clone();
        loop {
            match &*readiness.borrow_and_update() {
                Readiness::Ready(info) => return Ok(info.clone()),
                Readiness::Failed(cause) => return Err(Error::Internal(cause.clone())),
                Readiness::Starting => {}
            }
            readiness.changed().await.map_err(|_| Error::internal("the device thread ended"))?;
        }
    }

    /// Unfinished renders.
    pub fn unfinished(&self) -> usize {
        self.inner.unfinished.load(Ordering::Acquire)
    }

    /// Whether there is room for another render.
    pub fn has_room(&self) -> bool {
        self.unfinished() < self.inner.limits.queue
    }

    fn jobs(&self) -> MutexGuard<'_, Jobs> {
        self.inner.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a place in the queue, or says how full it is.
    fn admit(&self) -> Result<()> {
        if self.inner.draining.load(Ordering::Acquire) {
            return Err(Error::Unavailable("the server is shutting down".into()));
        }
        if let Readiness::Failed(_) = self.readiness() {
            return Err(Error::Unavailable("the device cannot be used; the server's log says why".into()));
        }
        let limit = self.inner.limits.queue;
        let took =
            self.inner.unfinished.fetch_update(Ordering::AcqRel, Ordering::Acquire, |n| (n < limit).then_some(n + 1));
        took.map(drop).map_err(|waiting| Error::QueueFull { waiting, retry_after_s: 1 + waiting as u64 / 16 })
    }

    /// A place in the queue, to be taken before anything is loaded for a render.
    ///
    /// # Errors
    /// [`Error::QueueFull`], or [`Error::Unavailable`] while draining or without a device.
    pub fn reserve(&self) -> Result<Place> {
        self.admit()?;
        Ok(Place { engine: self.clone(), taken: false })
    }

    /// Queues a render. `request` is kept to be shown again.
    pub fn submit(&self, place: Place, request: Value, scene: Scene) -> Arc<Job> {
        self.submit_planned(place, request, scene, None)
    }

    /// The same with what the planner said of it.
    pub fn submit_planned(&self, mut place: Place, request: Value, scene: Scene, planned: Option<Value>) -> Arc<Job> {
        place.taken = true;
        self.start_job(Job::new(request, scene, planned, false))
    }

    /// Queues a render that nobody sees but the caller: it is not listed, and forgotten when it ends. It takes no place of its own: the
    /// plan that it is for holds one.
    pub fn submit_pilot(&self, request: Value, scene: Scene) -> Arc<Job> {
        self.start_job(Job::new(request, scene, None, true))
    }

    fn start_job(&self, job: Arc<Job>) -> Arc<Job> {
        self.jobs().by_id.insert(job.id().to_owned(), job.clone());
        self.inner.runtime.spawn(develop::frames(Arc::downgrade(&job), self.clone()));
        self.run(&job);
        job
    }

    fn run(&self, job: &Arc<Job>) {
        if self.inner.commands.send(job.clone()).is_err() {
            job.fail(&Error::internal("the device thread ended"));
        }
    }

    /// Gives a render a new camera; a finished one goes through the queue again.
    ///
    /// # Errors
    /// [`Error::Conflict`] for a cancelled or failed render, [`Error::QueueFull`] when a finished one finds no place.
    pub fn set_camera(&self, job: &Arc<Job>, camera: Camera) -> Result<()> {
        // A place is taken first and given back if the job turns out to hold one still.
        let admitted = (job.state() == State::Done).then(|| self.admit()).transpose()?.is_some();
        let release = || {
            self.inner.unfinished.fetch_sub(1, Ordering::AcqRel);
        };
        let restart = job.restart(camera).inspect_err(|_| {
            if admitted {
                release()
            }
        })?;
        match (restart.was_done, admitted) {
            (true, false) => {
                self.inner.unfinished.fetch_add(1, Ordering::AcqRel);
            }
            (false, true) => release(),
            _ => {}
        }
        if restart.was_done || restart.again {
            self.jobs().ended.retain(|id| id != job.id());
        }
        if restart.again {
            self.run(job);
        }
        Ok(())
    }

    /// Cancels a render; its resource stays readable.
    pub fn cancel(&self, job: &Arc<Job>) {
        job.cancel();
    }

    /// The render of an id.
    pub fn job(&self, id: &str) -> Option<Arc<Job>> {
        self.jobs().by_id.get(id).filter(|j| !j.is_pilot()).cloned()
    }

    /// Every render that is kept, newest first.
    pub fn list(&self) -> Vec<Arc<Job>> {
        let mut all: Vec<_> = self.jobs().by_id.values().filter(|j| !j.is_pilot()).cloned().collect();
        all.sort_by_key(|j| std::cmp::Reverse((j.created_unix_s, j.lock().asked)));
        all
    }

    /// Notes that a job ended, and forgets the oldest ended ones past the limits of what is kept.
    pub(super) fn ended(&self, job: &Arc<Job>) {
        if job.is_pilot() {
            self.jobs().by_id.remove(job.id());
            return;
        }
        self.inner.unfinished.fetch_sub(1, Ordering::AcqRel);
        metrics::counter!("cloudchamber_renders_ended_total", "state" => format!("{:?}", job.state()).to_lowercase())
            .increment(1);
        let mut jobs = self.jobs();
        // It may run again by now, or have ended twice.
        if job.state().is_terminal() && !jobs.ended.iter().any(|id| id == job.id()) {
            jobs.ended.push_back(job.id().to_owned());
        }
        // The newest keeps its film however large, for whoever waits for it.
        let kept: Vec<Arc<Job>> =
            jobs.ended.iter().rev().skip(1).filter_map(|id| jobs.by_id.get(id).cloned()).collect();
        let mut films = 0;
        for older in kept {
            films += older.film_bytes();
            if films > self.inner.limits.keep_film_bytes {
                older.drop_film();
            }
        }
        let mut bytes: usize = jobs.ended.iter().filter_map(|id| jobs.by_id.get(id)).map(|j| j.bytes()).sum();
        while jobs.ended.len() > 1
            && (jobs.ended.len() > self.inner.limits.keep_renders || bytes > self.inner.limits.keep_bytes)
        {
            let Some(oldest) = jobs.ended.pop_front().and_then(|id| jobs.by_id.remove(&id)) else { continue };
            bytes = bytes.saturating_sub(oldest.bytes());
        }
    }

    /// Takes no new work from now on; returns when all renders have ended, or cancels what is left after `patience`.
    pub async fn drain(&self, patience: Duration) {
        self.inner.draining.store(true, Ordering::Release);
        let deadline = tokio::time::Instant::now() + patience;
        while self.unfinished() > 0 && tokio::time::Instant::now() < deadline {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        let all: Vec<_> = self.jobs().by_id.values().cloned().collect();
        for job in all {
            self.cancel(&job);
        }
    }

    /// Whether the engine is draining.
    pub fn is_draining(&self) -> bool {
        self.inner.draining.load(Ordering::Acquire)
    }
}

/// The device thread: opens the device, warms it, then goes round the live jobs, a slice each, until every handle is gone.
fn device_thread(
    config: &DeviceConfig,
    incoming: &Receiver<Arc<Job>>,
    readiness: &watch::Sender<Readiness>,
    most_live: usize,
) {
    let mut context = match Device::open(config).and_then(DeviceContext::warm) {
        Ok(context) => context,
        Err(error) => {
            tracing::error!(%error, "the device is not usable");
            readiness.send_replace(Readiness::Failed(error.to_string()));
            // Whoever got in before must not wait for ever.
            while let Ok(job) = incoming.recv() {
                job.fail(&error);
            }
            return;
        }
    };
    readiness.send_replace(Readiness::Ready(Arc::new(context.device.info().clone())));
    let mut waiting: VecDeque<Arc<Job>> = VecDeque::new();
    let mut live: VecDeque<Live> = VecDeque::new();
    loop {
        if live.is_empty() && waiting.is_empty() {
            context.tidy();
            match incoming.recv() {
                Ok(job) => waiting.push_back(job),
                Err(_) => return,
            }
        }
        waiting.extend(incoming.try_iter());
        waiting.retain(|job| !job.state().is_terminal());
        while live.len() < most_live {
            let Some(job) = waiting.pop_front() else { break };
            live.push_back(Live::new(job));
        }
        metrics::gauge!("cloudchamber_renders_live").set(live.len() as f64);
        metrics::gauge!("cloudchamber_renders_waiting").set(waiting.len() as f64);
        let Some(mut current) = live.pop_front() else { continue };
        // A panic in one job is that job's failure and nobody else's.
        match catch_unwind(AssertUnwindSafe(|| current.turn(&mut context))) {
            Ok(Ok(Turn::Again)) => live.push_back(current),
            Ok(Ok(Turn::Over)) => {}
            Ok(Err(error)) => current.fail(error),
            Err(_) => current.fail(Error::internal("a panic on the device thread")),
        }
    }
}
