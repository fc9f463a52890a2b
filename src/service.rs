//! The service in one object: the engine, the stored volumes, the limits and the planner, with one way to submit a render. HTTP, the
//! command line, the study and the tests all use it.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use crate::asset::Assets;
use crate::config::Limits;
use crate::device::DeviceConfig;
use crate::error::{Error, Result};
use crate::job::{CancelOnDrop, Engine, Job, Place, State, Task};
use crate::plan::{Calibrations, Planner};
use crate::render::{ExportTask, Scene};
use crate::run::DeviceExecutor;

/// A handle on the service; clones share it.
#[derive(Clone)]
pub struct Service {
    shared: Arc<Shared>,
}

struct Shared {
    engine: Engine,
    assets: Assets,
    limits: Limits,
    calibrations: Calibrations,
}

/// A valid request that holds a place in the queue.
pub struct Prepared {
    place: Place,
    request: Value,
    task: Task,
    planned: Option<Value>,
}

impl Service {
    /// Opens the stores in `data_dir` and starts the engine. It must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`Error::Internal`] when the folder cannot be used or no thread can be started.
    pub fn start(device: DeviceConfig, data_dir: &Path, limits: Limits) -> Result<Self> {
        let assets = Assets::open(data_dir, limits.assets())?;
        let engine = Engine::new(DeviceExecutor::start(device, &limits)?, limits.clone());
        let calibrations = Calibrations::kept_in(data_dir);
        Ok(Self { shared: Arc::new(Shared { engine, assets, limits, calibrations }) })
    }

    /// The engine.
    pub fn engine(&self) -> &Engine {
        &self.shared.engine
    }

    /// The stored things.
    pub fn assets(&self) -> &Assets {
        &self.shared.assets
    }

    /// The limits.
    pub fn limits(&self) -> &Limits {
        &self.shared.limits
    }

    /// The planner.
    pub fn planner(&self) -> Planner<'_> {
        let Shared { engine, assets, limits, calibrations } = &*self.shared;
        Planner { engine, assets, limits, calibrations }
    }

    /// The scene of a request whose technique is a view's. It loads the volume, so it may block for a while.
    ///
    /// # Errors
    /// [`Error::Invalid`] with JSON pointers and permitted ranges.
    pub fn scene(&self, request: &Value) -> Result<Scene> {
        Scene::from_json(request, self.assets(), self.limits())
    }

    /// Plans a request if its technique is `auto`, takes a place in the queue, checks the request and loads its volume.
    ///
    /// # Errors
    /// Those of the planner, of [`Engine::reserve`] and of [`Service::scene`].
    pub async fn prepare(&self, request: Value) -> Result<Prepared> {
        let (request, planned) = self.planner().resolve(request).await?;
        let (words, known) = planned.unzip();
        self.load(request, words, move |service, request| {
            service.scene(request).map(|scene| Task::Picture(Box::new(scene.as_planned(known))))
        })
        .await
    }

    /// Takes a place in the queue, checks the request of an export and loads its volume.
    ///
    /// # Errors
    /// Those of [`Engine::reserve`] and of [`ExportTask::from_json`].
    pub async fn prepare_export(&self, request: Value) -> Result<Prepared> {
        let task = |service: &Self, request: &Value| {
            ExportTask::from_json(request, service.assets(), service.limits()).map(|task| Task::File(Box::new(task)))
        };
        self.load(request, None, task).await
    }

    /// Queues a projection, whose file becomes a sinogram with an id. `request` is that of the export.
    ///
    /// # Errors
    /// As [`Service::prepare_export`].
    pub async fn project(&self, request: Value) -> Result<Arc<Job>> {
        let task = |service: &Self, request: &Value| {
            let task = ExportTask::from_json(request, service.assets(), service.limits());
            task.map(|task| Task::File(Box::new(task.kept())))
        };
        let job = self.queue(self.load(request, None, task).await?);
        tokio::spawn(keep(self.clone(), job.clone()));
        Ok(job)
    }

    async fn load(
        &self,
        request: Value,
        planned: Option<Value>,
        task: impl FnOnce(&Self, &Value) -> Result<Task> + Send + 'static,
    ) -> Result<Prepared> {
        // A place in the queue is taken before anything is loaded for the request.
        let place = self.engine().reserve()?;
        // The runtime's own threads must not wait until a volume is decoded or a built-in is made.
        let service = self.clone();
        let loaded = tokio::task::spawn_blocking(move || task(&service, &request).map(|task| (request, task))).await;
        let (request, task) = loaded.map_err(Error::internal)??;
        Ok(Prepared { place, request, task, planned })
    }

    /// Queues a prepared request.
    pub fn queue(&self, prepared: Prepared) -> Arc<Job> {
        let Prepared { place, request, task, planned } = prepared;
        self.engine().submit(place, request, task, planned)
    }

    /// Prepares a request and queues it.
    ///
    /// # Errors
    /// As [`Service::prepare`].
    pub async fn submit(&self, request: Value) -> Result<Arc<Job>> {
        Ok(self.queue(self.prepare(request).await?))
    }

    /// Submits a request and waits for its end. It is cancelled when this future is dropped.
    ///
    /// # Errors
    /// As [`Service::prepare`], and the error by which the render failed.
    pub async fn submit_and_wait(&self, request: Value) -> Result<Arc<Job>> {
        let job = self.submit(request).await?;
        self.wait(job).await
    }

    /// Submits the request of an export and waits for its end. It is cancelled when this future is dropped.
    ///
    /// # Errors
    /// As [`Service::prepare_export`], and the error by which the export failed.
    pub async fn export_and_wait(&self, request: Value) -> Result<Arc<Job>> {
        let job = self.queue(self.prepare_export(request).await?);
        self.wait(job).await
    }

    async fn wait(&self, job: Arc<Job>) -> Result<Arc<Job>> {
        let guard = CancelOnDrop::new(self.engine(), job);
        let job = guard.job();
        job.watch().wait_for(|u| u.state.is_terminal()).await.map(drop).map_err(Error::internal)?;
        match job.state() {
            State::Done => Ok(job.clone()),
            _ => Err(job.failure().unwrap_or_else(|| Error::Conflict("it was cancelled".into()))),
        }
    }
}

/// Waits for the file of a projection, and ends the export once that is a sinogram of the store.
async fn keep(service: Service, job: Arc<Job>) {
    let asked = job.clone();
    let mut updates = job.watch();
    let ended = updates.wait_for(|update| update.is_handed_over || update.state.is_terminal()).await.map(drop);
    let Some(mut file) = ended.ok().and_then(|()| job.handed_over()) else { return };
    if job.state().is_terminal() {
        return;
    }
    let named = ["/project/phantom/name", "/volume/builtin"];
    let name = named.into_iter().find_map(|at| job.request().pointer(at)?.as_str()).unwrap_or("projection").to_owned();
    let stored = tokio::task::spawn_blocking(move || {
        let sinograms = service.assets().sinograms();
        let (_, id, is_new) = sinograms.insert(file.bytes.to_vec(), &name, None)?;
        file.result["sinogram"] = json!({"id": id});
        // A cancelled measurement leaves nothing behind.
        if !job.finish_file(file) && is_new { sinograms.delete(&id) } else { Ok(()) }
    });
    if let Err(error) = stored.await.map_err(Error::internal).and_then(|stored| stored) {
        asked.fail(&error);
    }
}
