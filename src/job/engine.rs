//! The engine: admits jobs, keeps them readable, and hands them to its executor.

use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::oneshot;

use super::executor::{Executor, KernelProgress, Readiness};
use super::{Job, State, Task, encode};
use crate::config::Limits;
use crate::device::{DeviceInfo, NO_DEVICE};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::render::Scene;
use crate::scene::camera::Camera;

struct Inner {
    executor: Box<dyn Executor>,
    limits: Limits,
    draining: AtomicBool,
    unfinished: AtomicUsize,
    jobs: Mutex<Jobs>,
    runtime: tokio::runtime::Handle,
}

#[derive(Default)]
struct Jobs {
    by_id: HashMap<String, Arc<Job>>,
    /// The ended jobs, oldest first. They may be forgotten.
    ended: VecDeque<String>,
}

/// A place in the queue. It is given back when dropped unless a render has taken it.
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
    /// An engine that has `executor` work on its jobs. It must be called within a tokio runtime, on which frames are then encoded.
    pub fn new(executor: impl Executor + 'static, limits: Limits) -> Self {
        let inner = Inner {
            executor: Box::new(executor),
            limits,
            draining: AtomicBool::new(false),
            unfinished: AtomicUsize::new(0),
            jobs: Mutex::default(),
            runtime: tokio::runtime::Handle::current(),
        };
        Self { inner: Arc::new(inner) }
    }

    /// The readiness of the device.
    pub fn readiness(&self) -> Readiness {
        self.inner.executor.readiness().borrow().clone()
    }

    /// The progress of the kernels.
    pub fn kernels(&self) -> KernelProgress {
        self.inner.executor.kernels()
    }

    /// Waits until nothing is left to compile. Before that, times are not those of the device alone.
    pub async fn compiled(&self) {
        while !self.kernels().is_over() {
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Waits until the device is ready.
    ///
    /// # Errors
    /// [`Error::Internal`] when the device cannot be used.
    pub async fn ready(&self) -> Result<Arc<DeviceInfo>> {
        let mut readiness = self.inner.executor.readiness();
        loop {
            match &*readiness.borrow_and_update() {
                Readiness::Ready(info) => return Ok(info.clone()),
                Readiness::Failed(cause) => return Err(Error::Internal(cause.clone())),
                Readiness::Starting => {}
            }
            readiness.changed().await.map_err(|_| Error::internal("the device thread ended"))?;
        }
    }

    /// The number of unfinished renders.
    pub fn unfinished(&self) -> usize {
        self.inner.unfinished.load(Ordering::Acquire)
    }

    /// True if there is room for another render.
    pub fn has_room(&self) -> bool {
        self.unfinished() < self.inner.limits.queue
    }

    fn jobs(&self) -> MutexGuard<'_, Jobs> {
        self.inner.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a place in the queue, or fails with the number of renders in it.
    fn admit(&self) -> Result<()> {
        if self.inner.draining.load(Ordering::Acquire) {
            return Err(Error::Unavailable("the server is shutting down".into()));
        }
        if let Readiness::Failed(_) = self.readiness() {
            return Err(Error::Unavailable(NO_DEVICE.into()));
        }
        let limit = self.inner.limits.queue;
        let took =
            self.inner.unfinished.fetch_update(Ordering::AcqRel, Ordering::Acquire, |n| (n < limit).then_some(n + 1));
        took.map(drop).map_err(|waiting| Error::QueueFull { waiting, retry_after_s: 1 + waiting as u64 / 16 })
    }

    /// A place in the queue. It is taken before anything is loaded for a render.
    ///
    /// # Errors
    /// [`Error::QueueFull`], or [`Error::Unavailable`] while draining or without a device.
    pub fn reserve(&self) -> Result<Place> {
        self.admit()?;
        Ok(Place { engine: self.clone(), taken: false })
    }

    /// Queues a render or an export. `request` is kept to be shown again, and so is the planner's answer `planned`.
    pub fn submit(&self, mut place: Place, request: Value, task: Task, planned: Option<Value>) -> Arc<Job> {
        place.taken = true;
        self.start_job(Job::new(request, task, planned, false))
    }

    /// Queues a render that only the caller sees: it is not listed, and it is forgotten when it ends. It takes no place of its own, since the plan
    /// that it is for holds one.
    pub fn submit_pilot(&self, scene: Scene) -> Arc<Job> {
        self.start_job(Job::new(Value::Null, Task::Picture(Box::new(scene)), None, true))
    }

    fn start_job(&self, job: Arc<Job>) -> Arc<Job> {
        self.jobs().by_id.insert(job.id().to_owned(), job.clone());
        let engine = self.clone();
        self.inner.runtime.spawn(encode::frames(Arc::downgrade(&job), move |job| engine.ended(job)));
        self.inner.executor.take(&job);
        job
    }

    /// Gives a render a new camera. A finished render goes through the queue again.
    ///
    /// # Errors
    /// [`Error::Conflict`] for a cancelled or failed render, [`Error::QueueFull`] when there is no place for a finished one.
    pub fn set_camera(&self, job: &Arc<Job>, camera: Camera) -> Result<()> {
        // A place is taken first and given back if the job still holds one.
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
            self.inner.executor.take(job);
        }
        Ok(())
    }

    /// Cancels a render. Its resource stays readable.
    pub fn cancel(&self, job: &Arc<Job>) {
        job.cancel();
    }

    /// The render or export with an id.
    pub fn job(&self, id: &str) -> Option<Arc<Job>> {
        self.jobs().by_id.get(id).filter(|j| !j.is_pilot()).cloned()
    }

    /// The film of a render so far, with its pixels. If the render has no samples yet, the film is awaited.
    ///
    /// # Errors
    /// [`Error::NotFound`] when the film is not kept any more.
    pub async fn film(&self, job: &Arc<Job>) -> Result<Arc<Film>> {
        let gone = || Error::NotFound { what: "film any more of render", id: job.id().into() };
        let (to, film) = oneshot::channel();
        self.inner.executor.send_film(job, to);
        film.await.map_err(|_| gone())?.map(Arc::new)
    }

    /// Every render and export that is kept, newest first.
    pub fn list(&self) -> Vec<Arc<Job>> {
        let mut all: Vec<_> = self.jobs().by_id.values().filter(|j| !j.is_pilot()).cloned().collect();
        all.sort_by_key(|j| std::cmp::Reverse((j.created_unix_s, j.lock().asked)));
        all
    }

    /// Notes that a job ended, and forgets the oldest ended jobs past the limits.
    fn ended(&self, job: &Arc<Job>) {
        if job.is_pilot() {
            self.jobs().by_id.remove(job.id());
            return;
        }
        self.inner.unfinished.fetch_sub(1, Ordering::AcqRel);
        metrics::counter!("cloudchamber_renders_ended_total", "state" => format!("{:?}", job.state()).to_lowercase())
            .increment(1);
        let mut jobs = self.jobs();
        // The job may run again by now, or may have ended twice.
        if job.state().is_terminal() && !jobs.ended.iter().any(|id| id == job.id()) {
            jobs.ended.push_back(job.id().to_owned());
        }
        let mut bytes: usize = jobs.ended.iter().filter_map(|id| jobs.by_id.get(id)).map(|j| j.bytes()).sum();
        while jobs.ended.len() > 1
            && (jobs.ended.len() > self.inner.limits.keep_renders || bytes > self.inner.limits.keep_bytes)
        {
            let Some(oldest) = jobs.ended.pop_front().and_then(|id| jobs.by_id.remove(&id)) else { continue };
            bytes = bytes.saturating_sub(oldest.bytes());
        }
    }

    /// Takes no new work from now on. It returns when all renders have ended, or cancels the others after `patience`.
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

    /// True if the engine is draining.
    pub fn is_draining(&self) -> bool {
        self.inner.draining.load(Ordering::Acquire)
    }
}
