//! Runs requests on an engine of this process, and reads numbers from the results.

use std::sync::Arc;

use serde_json::{Value, json};
use tokio::runtime::Handle;

use crate::asset::Assets;
use crate::config::{DeviceArgs, Limits};
use crate::device::DeviceInfo;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::job::Job;
use crate::plan::Plan;
use crate::service::Service;
use crate::tomography::{Sinogram, SinogramParts};
use crate::volume::RawQuery;

/// The numbers of a finished render that are compared with a truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reads {
    /// The linear luminance of every pixel.
    Luminance,
    /// The mean luminance of each block of this many pixels a side.
    Blocks(usize),
    /// The transmittance of every pixel: 1 − alpha.
    Transmittance,
    /// Fractions of the launched weight, by their names in the ledger.
    Ledger(&'static [&'static str]),
    /// The mean luminance of the picture.
    Mean,
    /// The values of the field, voxel by voxel.
    Field,
    /// The line integrals of a projection, which is an export.
    Sinogram,
}

/// A finished render as the study sees it.
#[derive(Debug, Clone)]
pub struct Run {
    /// The numbers that were read.
    pub values: Vec<f64>,
    /// The time on the device.
    pub device_ms: f64,
    /// The time from asking to the final frame.
    pub wall_ms: f64,
    /// Samples per pixel.
    pub samples: u64,
    /// The bytes of the film and, if there is one, of the field.
    pub bytes: u64,
    /// The error that the reply states.
    pub stated_error: Option<f64>,
    /// True if its noise is that of random samples. That noise is known; the noise of evenly spread samples is only bounded.
    pub noise_is_random: bool,
    /// The whole reply.
    pub reply: Value,
}

impl Run {
    /// The codes of the reply's warnings.
    pub fn codes(&self) -> Vec<String> {
        let warnings = self.reply["warnings"].as_array();
        warnings.into_iter().flatten().filter_map(|w| Some(w["code"].as_str()?.to_owned())).collect()
    }

    /// A fraction of the ledger, and its standard error.
    pub fn fraction(&self, name: &str) -> [f64; 2] {
        let entry = &self.reply["result"]["ledger"][name];
        ["value", "standard_error"].map(|part| entry[part].as_f64().unwrap_or(f64::NAN))
    }
}

/// A service of this process.
pub struct Bench {
    service: Service,
    handle: Handle,
    device: Arc<DeviceInfo>,
}

impl Bench {
    /// Starts the service. It must be called on a thread of a tokio runtime that may block.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device or the folder cannot be used.
    pub fn new(args: &DeviceArgs, limits: Limits) -> Result<Self> {
        Self::of(Service::start(args.device_config(), &args.data_dir(), limits)?)
    }

    /// A bench on a service that runs already. It must be called as [`Bench::new`].
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when its device failed.
    pub fn of(service: Service) -> Result<Self> {
        let handle = Handle::current();
        let device = handle.block_on(service.engine().ready())?;
        Ok(Self { service, handle, device })
    }

    /// The device's description of itself.
    pub fn device(&self) -> &DeviceInfo {
        &self.device
    }

    /// The stored assets.
    pub fn assets(&self) -> &Assets {
        self.service.assets()
    }

    /// Runs a request to its end.
    ///
    /// # Errors
    /// Those of the request, or [`crate::error::Error::Internal`] when it fails.
    pub fn finish(&self, request: &Value) -> Result<Arc<Job>> {
        self.handle.block_on(self.service.submit_and_wait(request.clone()))
    }

    /// The film of a finished request.
    ///
    /// # Errors
    /// [`crate::error::Error::NotFound`] if it is not kept any more.
    pub fn film(&self, job: &Arc<Job>) -> Result<Arc<Film>> {
        self.handle.block_on(self.service.engine().film(job))
    }

    /// The first film of a request that somebody watches, before the render has ended; or the first film of another camera after its end. The
    /// render is cancelled then.
    ///
    /// # Errors
    /// As [`Bench::finish`].
    pub fn glimpse(&self, request: &Value, moved: Option<&Value>) -> Result<Arc<Film>> {
        let engine = self.service.engine();
        self.handle.block_on(async {
            let job = self.service.submit(request.clone()).await?;
            job.set_followed(true);
            if let Some(camera) = moved {
                job.watch().wait_for(|u| u.state.is_terminal()).await.map_err(Error::internal)?;
                engine.set_camera(&job, job.camera_from_json(camera)?)?;
            }
            let film = engine.film(&job).await;
            engine.cancel(&job);
            film
        })
    }

    /// Plans a request.
    ///
    /// # Errors
    /// Those of the planner.
    pub fn plan(&self, request: &Value) -> Result<Plan> {
        self.handle.block_on(self.service.planner().plan(request))
    }

    /// Every setting that the planner could have chosen for a request, in words and as a request. The first is the reference.
    ///
    /// # Errors
    /// Those of the request.
    pub fn settings(&self, request: &Value) -> Result<Vec<(String, Value)>> {
        self.handle.block_on(self.service.planner().settings(request))
    }

    /// True if a request is valid.
    pub fn is_valid(&self, request: &Value) -> bool {
        self.service.scene(request).is_ok()
    }

    /// True if the view of a request takes random samples.
    ///
    /// # Errors
    /// Those of the request.
    pub fn is_random(&self, request: &Value) -> Result<bool> {
        Ok(self.service.scene(request)?.view().random().is_some())
    }

    /// Runs a request and reads numbers from it.
    ///
    /// # Errors
    /// As [`Bench::finish`].
    pub fn run(&self, request: &Value, reads: Reads) -> Result<Run> {
        if reads == Reads::Sinogram {
            return self.project(request);
        }
        let job = self.finish(request)?;
        let reply = job.resource();
        let film = self.film(&job)?;
        let number = |at: &str| reply.pointer(at).and_then(Value::as_f64).unwrap_or(0.0);
        Ok(Run {
            values: match (reads, job.field()) {
                (Reads::Field, Some(field)) => {
                    let values = field.values()?;
                    (0..field.voxel_count()).map(|i| values.of(i)).collect()
                }
                _ => read(&film, &reply, reads),
            },
            device_ms: number("/timings/device_ms"),
            wall_ms: number("/timings/elapsed_ms"),
            samples: u64::from(film.main.count),
            bytes: film.bytes() as u64 + job.field().map_or(0, |f| f.bytes()),
            stated_error: film.error().total,
            noise_is_random: !film.is_well_spread(),
            reply,
        })
    }

    /// Runs a projection. It has neither a seed nor a size.
    fn project(&self, request: &Value) -> Result<Run> {
        let own = ["technique", "volume", "project"].into_iter().map(|name| (name.to_owned(), request[name].clone()));
        let job = self.handle.block_on(self.service.export_and_wait(own.collect()))?;
        let file = job.file().ok_or_else(|| Error::internal("a projection without a file"))?;
        let parts = SinogramParts { meta: None, lengths: [file.bytes.len(), 0, 0] };
        let sinogram = Sinogram::read(&file.bytes, "study", &parts, file.bytes.len())?;
        let reply = job.resource();
        let number = |at: &str| reply.pointer(at).and_then(Value::as_f64).unwrap_or(0.0);
        Ok(Run {
            values: sinogram.values().iter().map(|p| f64::from(*p)).collect(),
            device_ms: number("/timings/device_ms"),
            wall_ms: number("/timings/elapsed_ms"),
            samples: 1,
            bytes: file.bytes.len() as u64,
            stated_error: None,
            noise_is_random: false,
            reply,
        })
    }

    /// Puts a volume of floats in the store, `value` at the voxels' centres in the box [−½, ½] · `size`, and returns the value of a
    /// request's `volume`.
    ///
    /// # Errors
    /// Those of the store.
    pub fn floats(&self, dims: [usize; 3], size: [f64; 3], value: impl Fn([f64; 3]) -> f64) -> Result<Value> {
        let centre = |i: usize, a: usize| ((i as f64 + 0.5) / dims[a] as f64 - 0.5) * size[a];
        let mut bytes = Vec::with_capacity(4 * dims.iter().product::<usize>());
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    let v = value([centre(x, 0), centre(y, 1), centre(z, 2)]) as f32;
                    bytes.extend_from_slice(&v.to_le_bytes());
                }
            }
        }
        let spacing: [f64; 3] = std::array::from_fn(|a| size[a] / dims[a] as f64);
        let query = RawQuery {
            dims: Some(dims.map(|n| n.to_string()).join(",")),
            r#type: Some("f32".into()),
            spacing: Some(spacing.map(|s| s.to_string()).join(",")),
            endian: None,
        };
        Ok(json!({"id": self.service.assets().volumes().insert(bytes, "study", query.parse()?)?.1}))
    }
}

fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

fn read(film: &Film, reply: &Value, reads: Reads) -> Vec<f64> {
    let pixels = || film.main.mean.chunks_exact(4);
    match reads {
        Reads::Luminance => pixels().map(luminance).collect(),
        Reads::Blocks(side) => {
            let values: Vec<f64> = pixels().map(luminance).collect();
            block_means(&values, film.size, side)
        }
        Reads::Transmittance => pixels().map(|p| 1.0 - f64::from(p[3])).collect(),
        Reads::Ledger(names) => {
            let value = |n: &&str| reply["result"]["ledger"][*n]["value"].as_f64().unwrap_or(f64::NAN);
            names.iter().map(value).collect()
        }
        // Without a field there are no values, nor in a picture of a projection.
        Reads::Field | Reads::Sinogram => Vec::new(),
        Reads::Mean => {
            let n = pixels().len().max(1) as f64;
            vec![pixels().map(luminance).sum::<f64>() / n]
        }
    }
}

/// The means of blocks of `side` pixels a side, row by row.
pub fn block_means(values: &[f64], [width, height]: [usize; 2], side: usize) -> Vec<f64> {
    let (wide, high) = (width / side, height / side);
    let mut sums = vec![0.0; wide * high];
    for y in 0..high * side {
        for x in 0..wide * side {
            sums[y / side * wide + x / side] += values[y * width + x] / (side * side) as f64;
        }
    }
    sums
}
