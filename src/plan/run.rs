//! A render for the planner: unseen, of some of the picture's pixels, with the rounds of each.

use std::sync::Arc;

use super::Planner;
use crate::error::{Error, Result};
use crate::film::{Film, Round};
use crate::job::{CancelOnDrop, Job, State};
use crate::render::Scene;
use crate::render::region::Region;
use crate::technique::Setting;

/// The alpha from which on a pixel counts as opaque.
const OPAQUE: f32 = 0.99;

/// The least samples of a picture that judges others.
const LEAST_JUDGES: u32 = 32;

/// A finished pilot render.
pub struct Run {
    /// The film that it gathered.
    pub film: Arc<Film>,
    /// The number of pixels.
    pub pixels: usize,
    /// The device time besides the samples, and that of a sample, ms.
    pub ms: [f64; 2],
    /// The device time after the last sample, ms: that of its probe.
    pub probe_ms: f64,
}

impl Run {
    /// The rounds of the picture.
    pub fn rounds(&self) -> &[Arc<Round>] {
        &self.film.rounds
    }

    /// The linear luminance of a pixel.
    pub fn luminance(&self, pixel: usize) -> f64 {
        self.film.main.luminance(pixel)
    }

    /// The part of the pixels that are opaque.
    pub fn opaque(&self) -> f64 {
        mean(self.film.main.mean.chunks_exact(4).map(|p| f64::from(u8::from(p[3] > OPAQUE))))
    }

    /// The mean luminance that errors are relative to; 1 if nothing is seen, since errors are absolute then.
    pub fn scale(&self) -> f64 {
        let mean = mean((0..self.pixels).map(|i| self.luminance(i))).abs();
        if mean > 0.0 { mean } else { 1.0 }
    }
}

/// The scene that is planned, for the runs of its pilots.
#[derive(Clone, Copy)]
pub struct Asked<'a> {
    /// The planner that runs them.
    pub planner: &'a Planner<'a>,
    /// The scene as it was asked for, looking at a volume that is there.
    pub scene: &'a Scene,
}

impl Asked<'_> {
    /// The picture's sides.
    pub fn image(&self) -> [u32; 2] {
        self.scene.image()
    }

    /// Runs a setting on some pixels.
    ///
    /// # Errors
    /// Those of the render.
    pub async fn run(&self, setting: &Setting, region: Region, samples: u32, seed: u64) -> Result<Run> {
        let samples = samples.min(self.planner.limits.max_samples);
        finish(self.planner, self.with(setting)?.with_seed(seed).into_pilot(region, samples)).await
    }

    /// Runs the whole picture with a setting, and its probe.
    ///
    /// # Errors
    /// Those of the render.
    pub async fn run_whole(&self, setting: &Setting, samples: u32, seed: u64) -> Result<Run> {
        let whole = Region::every(1, self.image());
        finish(self.planner, self.with(setting)?.with_seed(seed).into_pilot(whole, samples).with_probe()).await
    }

    fn with(&self, setting: &Setting) -> Result<Scene> {
        // A coarser level may have to be made first: the runtime's other work goes on meanwhile.
        tokio::task::block_in_place(|| self.scene.with_setting(setting))
    }

    /// True if the samples of a setting are spread evenly, and the pictures of [`Asked::run_judges`] can be had.
    pub fn is_judged(&self, setting: &Setting) -> bool {
        setting.view.as_ref().unwrap_or(self.scene.view()).random().is_none()
    }

    /// Two pictures of a setting with places of their own in each pixel, of half of `samples` or more.
    ///
    /// # Errors
    /// Those of the render.
    pub async fn run_judges(&self, setting: &Setting, region: Region, samples: u32) -> Result<[Arc<Round>; 2]> {
        let samples = (samples / 2).max(LEAST_JUDGES).min(self.planner.limits.max_samples);
        let run = async |seed: u64| {
            let scene = self.with(setting)?.with_seed(seed).into_pilot(region, samples).with_own_places();
            let last = finish(self.planner, scene).await?.rounds().last().cloned();
            last.ok_or_else(|| Error::internal("a pilot without rounds"))
        };
        Ok([run(3).await?, run(4).await?])
    }

    /// Runs it with two seeds.
    ///
    /// # Errors
    /// Those of the render.
    pub async fn run_two(&self, setting: &Setting, region: Region, samples: u32) -> Result<[Run; 2]> {
        Ok([self.run(setting, region, samples, 1).await?, self.run(setting, region, samples, 2).await?])
    }
}

/// Runs a pilot to its end, unseen.
///
/// # Errors
/// Those of the render.
pub async fn finish(planner: &Planner<'_>, pilot: Scene) -> Result<Run> {
    let job = to_its_end(planner, pilot).await?;
    let failed = || Error::internal("a pilot without a film");
    let film = planner.engine.film(&job).await?;
    let rounds = &film.rounds;
    let (Some(first), Some(last)) = (rounds.first(), rounds.last()) else { return Err(failed()) };
    let more = f64::from(last.samples - first.samples);
    let sample = if more > 0.0 { (last.device_ms - first.device_ms) / more } else { first.device_ms };
    let all = job.watch().borrow().frame.as_ref().map_or(0.0, |frame| frame.device_ms);
    let ms = [(first.device_ms - sample).max(0.0), sample];
    Ok(Run { pixels: film.main.pixels(), ms, probe_ms: (all - last.device_ms).max(0.0), film })
}

/// Runs a pilot to its end, unseen. If nobody waits for it any more, it is cancelled.
///
/// # Errors
/// [`Error::Kernel`] if its kernel does not build, [`Error::Internal`] if it fails otherwise.
pub async fn to_its_end(planner: &Planner<'_>, pilot: Scene) -> Result<Arc<Job>> {
    let guard = CancelOnDrop::new(planner.engine, planner.engine.submit_pilot(pilot));
    let job = guard.job();
    job.watch().wait_for(|u| u.state.is_terminal()).await.map(drop).map_err(Error::internal)?;
    match job.state() {
        State::Done => Ok(job.clone()),
        _ => match job.failure() {
            Some(unavailable @ Error::Kernel { .. }) => Err(unavailable),
            other => Err(Error::internal(format!("a pilot failed: {other:?}"))),
        },
    }
}

/// The mean of the values; 0 for none.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}
