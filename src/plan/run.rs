//! A render of the planner's: unseen, of some of the picture's pixels, with what each had come to on the way.

use std::sync::Arc;

use serde_json::{Value, json};

use super::Planner;
use super::candidates::Candidate;
use crate::error::{Error, Result};
use crate::film::{Film, Round};
use crate::job::{Engine, Job, State};
use crate::scene::Scene;
use crate::scene::region::Region;
use crate::volume::Volume;

/// From this alpha on a pixel counts as opaque.
const OPAQUE: f32 = 0.99;

/// A finished pilot render.
pub struct Run {
    /// What it gathered.
    pub film: Arc<Film>,
    /// Pixels.
    pub pixels: usize,
    /// Device time besides the samples, and of a sample, ms.
    pub ms: [f64; 2],
}

impl Run {
    /// What the picture was on the way.
    pub fn rounds(&self) -> &[Arc<Round>] {
        &self.film.rounds
    }

    /// Of a pixel, linear.
    pub fn luminance(&self, pixel: usize) -> f64 {
        self.film.main.luminance(pixel)
    }

    /// The part of the pixels that are opaque.
    pub fn opaque(&self) -> f64 {
        mean(self.film.main.mean.chunks_exact(4).map(|p| f64::from(u8::from(p[3] > OPAQUE))))
    }

    /// The mean luminance.
    pub fn mean(&self) -> f64 {
        mean((0..self.pixels).map(|i| self.luminance(i))).abs().max(f64::MIN_POSITIVE)
    }
}

/// A pilot that is not waited for any more, as when a client goes away, is cancelled.
struct CancelOnDrop<'a> {
    engine: &'a Engine,
    job: Arc<Job>,
}

impl Drop for CancelOnDrop<'_> {
    fn drop(&mut self) {
        self.engine.cancel(&self.job);
    }
}

/// What is planned, for the runs of its pilots.
#[derive(Clone, Copy)]
pub struct Asked<'a> {
    /// Runs them.
    pub planner: &'a Planner<'a>,
    /// The request.
    pub body: &'a Value,
    /// The picture's sides.
    pub image: [u32; 2],
    /// What is looked at in place of a field that is yet to be computed.
    pub field: Option<&'a Arc<Volume>>,
}

impl Asked<'_> {
    /// Runs a candidate on some pixels.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn run(&self, candidate: &Candidate, region: Region, samples: u32, seed: u64) -> Result<Run> {
        let mut request = candidate.request(self.body);
        request["budget"] = json!({"samples": samples.min(self.planner.limits.max_samples)});
        request["seed"] = json!(seed);
        finish(self.planner, request, region, self.field).await
    }

    /// Runs it with two seeds.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn run_two(&self, candidate: &Candidate, region: Region, samples: u32) -> Result<[Run; 2]> {
        Ok([self.run(candidate, region, samples, 1).await?, self.run(candidate, region, samples, 2).await?])
    }
}

/// Runs a region of a request's picture to its end, unseen; of a field as it is there.
///
/// # Errors
/// Those of the request.
pub async fn finish(planner: &Planner<'_>, request: Value, region: Region, field: Option<&Arc<Volume>>) -> Result<Run> {
    let scene = planner.scene(&request)?.into_pilot(region);
    let scene = match field {
        Some(field) => scene.looking_at(field.clone()),
        None => scene,
    };
    let job = to_its_end(planner, request, scene).await?;
    let failed = || Error::internal("a pilot without a film");
    let film = planner.engine.film(&job).await?;
    let rounds = &film.rounds;
    let (Some(first), Some(last)) = (rounds.first(), rounds.last()) else { return Err(failed()) };
    let more = f64::from(last.samples - first.samples);
    let sample = if more > 0.0 { (last.device_ms - first.device_ms) / more } else { first.device_ms };
    Ok(Run { pixels: film.main.pixels(), ms: [(first.device_ms - sample).max(0.0), sample], film })
}

/// Runs a scene to its end, unseen; where that is not waited for any more, it is cancelled.
///
/// # Errors
/// [`Error::Kernel`] where its kernel does not build, [`Error::Internal`] where it fails otherwise.
pub async fn to_its_end(planner: &Planner<'_>, request: Value, scene: Scene) -> Result<Arc<Job>> {
    let job = CancelOnDrop { engine: planner.engine, job: planner.engine.submit_pilot(request, scene) };
    job.job.watch().wait_for(|u| u.state.is_terminal()).await.map(drop).map_err(Error::internal)?;
    match job.job.state() {
        State::Done => Ok(job.job.clone()),
        _ => match job.job.failure() {
            Some(unavailable @ Error::Kernel { .. }) => Err(unavailable),
            other => Err(Error::internal(format!("a pilot failed: {other:?}"))),
        },
    }
}

/// 0 of nothing.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}
