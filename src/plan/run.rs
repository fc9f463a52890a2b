//! A render of the planner's: unseen, of some of the picture's pixels, with what each had come to on the way.

use std::sync::Arc;

use serde_json::Value;

use super::Planner;
use crate::error::{Error, Result};
use crate::film::{Film, Round};
use crate::job::{Engine, Job, State};

/// Deviations by which halves must agree better than random ones would before the curve is looked at: it is right of random ones too.
const BY_CHANCE: f64 = 0.0;

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
    /// Of a pixel, linear.
    pub fn luminance(&self, pixel: usize) -> f64 {
        self.film.main.luminance(pixel)
    }

    /// What the picture after `few` samples differs by from that after `more`, of luminance; 0 where they are not both known.
    pub fn apart(&self, few: u32, more: u32) -> f64 {
        let after = |samples: u32| self.film.rounds.iter().find(|r| r.samples == samples);
        after(few).zip(after(more)).map_or(0.0, |(few, more)| few.apart(more))
    }

    /// The mean luminance.
    pub fn mean(&self) -> f64 {
        mean((0..self.pixels).map(|i| self.luminance(i))).abs().max(f64::MIN_POSITIVE)
    }

    /// The noise as a pilot has it, relative to `scale`.
    pub fn noise(&self, scale: f64) -> Vec<(u32, f64)> {
        let (noise, is_spread) = self.film.known_noise(BY_CHANCE);
        if !is_spread {
            return vec![(self.film.main.count, noise / scale)];
        }
        curve(&self.film.rounds).into_iter().map(|(n, e)| (n, e / scale)).collect()
    }
}

/// What the first half of the rounds were wrong by, of luminance.
pub fn curve(rounds: &[Arc<Round>]) -> Vec<(u32, f64)> {
    let Some(last) = rounds.last() else { return Vec::new() };
    let part = |r: &Round| 1.0 - f64::from(r.samples) / f64::from(last.samples);
    let first = rounds.iter().filter(|r| 2 * r.samples <= last.samples);
    first.map(|r| (r.samples, (r.apart(last) / part(r).sqrt()).max(1e-9))).collect()
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

/// Runs every `apart`-th pixel of a request to its end, unseen.
///
/// # Errors
/// Those of the request.
pub async fn finish(planner: &Planner<'_>, request: Value, apart: u32) -> Result<Run> {
    let scene = planner.scene(&request)?.into_pilot(apart);
    let job = CancelOnDrop { engine: planner.engine, job: planner.engine.submit_pilot(request, scene) };
    let job = &job.job;
    let ended = job.watch().wait_for(|u| u.state.is_terminal()).await.map(drop).map_err(Error::internal);
    let (state, film) = (job.state(), job.film());
    ended?;
    let failed = || Error::internal(format!("a pilot failed: {}", job.resource()["failure"]));
    let (State::Done, Some((film, _))) = (state, film) else { return Err(failed()) };
    let rounds = &film.rounds;
    let (Some(first), Some(last)) = (rounds.first(), rounds.last()) else { return Err(failed()) };
    let more = f64::from(last.samples - first.samples);
    let sample = if more > 0.0 { (last.device_ms - first.device_ms) / more } else { first.device_ms };
    Ok(Run { pixels: film.main.pixels(), ms: [(first.device_ms - sample).max(0.0), sample], film })
}

/// 0 of nothing.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    #[test]
    fn the_curve_of_random_samples_falls_as_their_root() {
        let (mut random, mut sums) = (noise(3), vec![0.0f64; 4096]);
        let mut rounds = Vec::new();
        for samples in 1..=16u32 {
            sums.iter_mut().for_each(|s| *s += random());
            let luminance = sums.iter().map(|s| (s / f64::from(samples)) as f32).collect();
            rounds.push(Arc::new(Round { samples, device_ms: 0.0, luminance }));
        }
        for (samples, error) in curve(&rounds) {
            let expected = 0.3 / f64::from(samples).sqrt();
            assert!((error / expected - 1.0).abs() < 0.04, "{samples}: {error} of {expected}");
        }
    }

    /// Noise of deviation 0.3.
    pub fn noise(seed: u32) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            let mut next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1u32 << 24)
            };
            0.3 * ((0..12).map(|_| next()).sum::<f64>() - 6.0)
        }
    }
}
