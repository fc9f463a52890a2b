//! The engine in this process, for tests of the film itself in linear floats.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use clap::Parser;
use cloudchamber::asset::Assets;
use cloudchamber::config::Limits;
use cloudchamber::device::program::Variant;
use cloudchamber::device::{DeviceConfig, DeviceInfo};
use cloudchamber::error::Error;
use cloudchamber::film::{ErrorEstimate, Film};
use cloudchamber::job::Job;
use cloudchamber::render::{ExportTask, Scene};
use cloudchamber::service::Service;
use cloudchamber::study::bench::Bench;
use cloudchamber::technique;
use serde_json::{Value, json};

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    limits: Limits,
}

/// The kernels of a scene's field that are the technique's own, or else the kernel of its view.
pub fn kernels_of(scene: &Scene) -> Vec<Variant> {
    match scene.subject().field() {
        Some(asked) => {
            let own = (technique::find(asked.technique).unwrap().source)().kernel;
            asked.field.kernels().unwrap().into_iter().filter(|variant| variant.kernel == own).collect()
        }
        None => vec![scene.view().prepare(scene.subject()).unwrap().plan().variant],
    }
}

/// A service with a store of its own.
pub struct House {
    pub service: Service,
    runtime: tokio::runtime::Runtime,
    _data: tempfile::TempDir,
}

impl House {
    /// A house on a device.
    pub fn on(config: DeviceConfig) -> Self {
        let _opening = super::opening();
        let data = tempfile::tempdir().unwrap();
        let limits = Flags::parse_from(["test", "--keep-film-bytes", "1000000000"]).limits;
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
        let config = DeviceConfig { kernels: config.kernels.clone().or_else(super::kernels), ..config };
        let service = runtime.block_on(async { Service::start(config, data.path(), limits) }).unwrap();
        runtime.block_on(service.engine().ready()).unwrap();
        Self { service, runtime, _data: data }
    }

    /// The stored assets.
    pub fn assets(&self) -> &Assets {
        self.service.assets()
    }

    /// The scene of a request, or the error by which it is refused.
    pub fn scene(&self, request: &Value) -> Result<Scene, Error> {
        self.service.scene(request)
    }

    /// A shared house, with the device's own number of lanes: the same for all of a test. There are a few, since a house does its work on the host, such
    /// as reading a film, while its device waits.
    pub fn shared() -> &'static Self {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        thread_local!(static OWN: usize = NEXT.fetch_add(1, Ordering::Relaxed) % House::SHARED);
        Self::shared_at(OWN.with(|own| *own))
    }

    /// The number of shared houses.
    pub const SHARED: usize = 2;

    /// One of the shared houses.
    pub fn shared_at(index: usize) -> &'static Self {
        static HOUSES: [OnceLock<House>; House::SHARED] = [const { OnceLock::new() }; House::SHARED];
        HOUSES[index].get_or_init(|| {
            // Its kernels are compiled by processes beside it, on all cores; a part of a test compiles its own.
            let beside = (!super::processes::is_part()).then(|| env!("CARGO_BIN_EXE_cloudchamber").into());
            Self::on(DeviceConfig { compiler: beside, ..DeviceConfig::pocl() })
        })
    }

    /// A shared house with `lanes` lanes.
    pub fn of_lanes(lanes: u32) -> &'static Self {
        static HOUSES: [OnceLock<House>; 5] = [const { OnceLock::new() }; 5];
        HOUSES[lanes.ilog2() as usize]
            .get_or_init(|| Self::on(DeviceConfig { lanes: Some(lanes), ..DeviceConfig::pocl() }))
    }

    /// A study's bench on its service.
    pub fn bench(&self) -> Bench {
        let _entered = self.runtime.enter();
        Bench::of(self.service.clone()).unwrap()
    }

    /// The description of its device.
    pub fn info(&self) -> Arc<DeviceInfo> {
        self.runtime.block_on(self.service.engine().ready()).unwrap()
    }

    /// Runs a request to its end.
    pub fn finish(&self, request: &Value) -> Arc<Job> {
        let done = self.runtime.block_on(self.service.submit_and_wait(request.clone()));
        done.unwrap_or_else(|e| panic!("{request}: {e}"))
    }

    /// The valid request of an export.
    pub fn export_task(&self, request: &Value) -> ExportTask {
        ExportTask::from_json(request, self.assets(), self.service.limits())
            .unwrap_or_else(|e| panic!("{request}: {e}"))
    }

    /// Runs an export to its end.
    pub fn export(&self, request: &Value) -> Arc<Job> {
        let done = self.runtime.block_on(self.service.export_and_wait(request.clone()));
        done.unwrap_or_else(|e| panic!("{request}: {e}"))
    }

    /// The film of a finished request.
    pub fn film(&self, request: &Value) -> (Arc<Film>, ErrorEstimate) {
        let film = self.film_of(&self.finish(request));
        (film.clone(), film.error())
    }

    /// The film of a job.
    pub fn film_of(&self, job: &Arc<Job>) -> Arc<Film> {
        self.runtime.block_on(self.service.engine().film(job)).unwrap()
    }

    /// The final frame of a request.
    pub fn png(&self, request: &Value) -> Vec<u8> {
        self.finish(request).watch().borrow().frame.as_ref().unwrap().png.to_vec()
    }

    /// The bytes of its pixels.
    pub fn picture(&self, request: &Value) -> Vec<u8> {
        image::load_from_memory(&self.png(request)).unwrap().into_bytes()
    }

    /// Puts a raw volume of floats in the store and returns the request's value for `volume`.
    pub fn floats(&self, dims: [usize; 3], value: impl Fn(f64, f64, f64) -> f64) -> Value {
        let mut bytes = Vec::new();
        let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    let v = value(centre(x, dims[0]), centre(y, dims[1]), centre(z, dims[2])) as f32;
                    bytes.extend_from_slice(&v.to_le_bytes());
                }
            }
        }
        let query = cloudchamber::volume::RawQuery {
            dims: Some(dims.map(|n| n.to_string()).join(",")),
            r#type: Some("f32".into()),
            spacing: Some(dims.map(|n| (2.0 / n as f64).to_string()).join(",")),
            endian: None,
        };
        let (_, id, _) = self.assets().volumes().insert(bytes, "test", query.parse().unwrap()).unwrap();
        json!({"id": id})
    }

    /// Puts a volume file in the store and returns the request's value for `volume`.
    pub fn file(&self, bytes: Vec<u8>) -> Value {
        json!({"id": self.assets().volumes().insert(bytes, "file", None).unwrap().1})
    }
}
