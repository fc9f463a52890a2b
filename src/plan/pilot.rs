//! A few thousand pixels of each candidate: what it costs on this device, and what it is wrong by.
//!
//! What is left out is the mean over the pixels of d₁ d₂, where d is the difference to the reference with seeds of their own: noise of the
//! two is independent and averages to nothing. Of random paths the noise is the film's own estimate, and a plan of many samples is confirmed
//! by the first few of the picture itself. Of steps along a ray, whose places are far better spread than the random ones that the film takes
//! them for, it is the difference to the shortest step, for one sample a pixel and for more.

use std::sync::Arc;

use serde_json::{Value, json};

use super::Planner;
use super::candidates::Candidate;
use crate::error::{Error, Result};
use crate::film::{ErrorEstimate, Film};
use crate::job::{Engine, Job, State};

/// Pixels of a pilot.
const PIXELS: f64 = 4096.0;
/// Samples of a pilot.
const SAMPLES: u32 = 16;
/// Samples of a stepping view: where its curve is looked at.
const CURVE: [u32; 3] = [1, 4, 16];
/// Samples of the view that the curve is compared with.
const REFERENCE: u32 = 64;
/// The most samples of the whole picture with the chosen setting that confirm it.
pub const CONFIRMED: u32 = 4;
/// Groups of pixels of which the spread tells how well a bias is known.
const GROUPS: usize = 16;

/// What a pilot found.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// Of what.
    pub candidate: Candidate,
    /// The noise after so many samples, relative.
    pub noise: Vec<(u32, f64)>,
    /// What more samples do not take away, relative,
    pub bias: f64,
    /// and how much larger it might be.
    pub bias_within: f64,
    /// Device time of a sample of a pixel, ms.
    pub ms_per_sample: f64,
}

/// A finished pilot render.
struct Run {
    luminance: Vec<f64>,
    noise: f64,
    ms_per_sample: f64,
}

/// The size of a pilot of a picture, of the same proportions.
pub fn size(image: [u32; 2]) -> [u32; 2] {
    let scale = (PIXELS / (f64::from(image[0]) * f64::from(image[1]))).sqrt().min(1.0);
    image.map(|side| ((f64::from(side) * scale).round() as u32).max(1))
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

/// Runs a request to its end, unseen.
pub async fn finish(planner: &Planner<'_>, request: Value) -> Result<(Arc<Film>, ErrorEstimate, f64)> {
    let place = planner.engine.reserve()?;
    let scene = planner.scene(&request)?;
    let job = CancelOnDrop { engine: planner.engine, job: planner.engine.submit_pilot(place, request, scene) };
    let job = &job.job;
    let ended = job.watch().wait_for(|u| u.state.is_terminal()).await.map(drop).map_err(Error::internal);
    let (state, film, resource) = (job.state(), job.film(), job.resource());
    ended?;
    match (state, film) {
        (State::Done, Some((film, error))) => {
            Ok((film, error, resource.pointer("/timings/device_ms").and_then(Value::as_f64).unwrap_or(0.0)))
        }
        _ => Err(Error::internal(format!("a pilot failed: {}", resource["failure"]))),
    }
}

async fn run(
    planner: &Planner<'_>,
    body: &Value,
    candidate: &Candidate,
    [width, height]: [u32; 2],
    samples: u32,
    seed: u64,
) -> Result<Run> {
    let mut request = candidate.request(body);
    request["image"] = json!({"width": width, "height": height});
    request["budget"] = json!({"samples": samples.min(planner.limits.max_samples)});
    request["seed"] = json!(seed);
    let (film, error, device_ms) = finish(planner, request).await?;
    let luminance: Vec<f64> = (0..film.main.pixels()).map(|i| film.main.luminance(i)).collect();
    let mean = mean(luminance.iter().copied());
    let ms_per_sample = device_ms / (f64::from(samples) * luminance.len() as f64);
    Ok(Run { noise: error.noise.unwrap_or(0.0) * if mean > 0.0 { mean } else { 1.0 }, luminance, ms_per_sample })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

/// Runs the pilots; the first candidate is the reference.
///
/// # Errors
/// Those of the requests.
pub async fn run_all(
    planner: &Planner<'_>,
    body: &Value,
    image: [u32; 2],
    candidates: &[Candidate],
) -> Result<Vec<Pilot>> {
    let Some(first) = candidates.first() else { return Err(Error::internal("no candidate is possible")) };
    if matches!(first.technique.as_str(), "volume_path" | "single_scatter") {
        paths(planner, body, image, candidates).await
    } else {
        steps(planner, body, image, candidates).await
    }
}

async fn paths(planner: &Planner<'_>, body: &Value, image: [u32; 2], candidates: &[Candidate]) -> Result<Vec<Pilot>> {
    let image = size(image);
    let mut references: Vec<Run> = Vec::new();
    let mut pilots = Vec::new();
    for candidate in candidates {
        let runs = [
            run(planner, body, candidate, image, SAMPLES, 1).await?,
            run(planner, body, candidate, image, SAMPLES, 2).await?,
        ];
        let scale = references.first().unwrap_or(&runs[0]);
        let scale = mean(scale.luminance.iter().copied()).abs().max(f64::MIN_POSITIVE);
        let noise = (0.5 * (runs[0].noise.powi(2) + runs[1].noise.powi(2))).sqrt() / scale;
        let (bias, bias_within) = match references.as_slice() {
            [a, b] if !candidate.unbiased => lasting(&runs, [a, b], scale),
            _ => (0.0, 0.0),
        };
        pilots.push(Pilot {
            candidate: candidate.clone(),
            noise: vec![(SAMPLES, noise)],
            bias,
            bias_within,
            ms_per_sample: runs[0].ms_per_sample.min(runs[1].ms_per_sample),
        });
        if references.is_empty() {
            references.extend(runs);
        }
    }
    Ok(pilots)
}

/// The root of the mean of d₁ d₂ over the pixels, and how much more it might be: two deviations, by the spread over groups of pixels.
fn lasting(runs: &[Run; 2], references: [&Run; 2], scale: f64) -> (f64, f64) {
    let difference = |k: usize, i: usize| (runs[k].luminance[i] - references[k].luminance[i]) / scale;
    let pixels = runs[0].luminance.len();
    let products: Vec<f64> = (0..pixels).map(|i| difference(0, i) * difference(1, i)).collect();
    let count = GROUPS.min(pixels);
    let groups: Vec<f64> = (0..count).map(|g| mean(products.iter().skip(g).step_by(count).copied())).collect();
    let middle = mean(groups.iter().copied());
    let spread = match count {
        0 | 1 => middle.abs(),
        n => (mean(groups.iter().map(|g| (g - middle).powi(2))) / (n - 1) as f64).sqrt(),
    };
    let bias = middle.max(0.0).sqrt();
    (bias, (middle.max(0.0) + 2.0 * spread).sqrt() - bias)
}

async fn steps(planner: &Planner<'_>, body: &Value, image: [u32; 2], candidates: &[Candidate]) -> Result<Vec<Pilot>> {
    let small = size(image);
    let finest = &candidates[0];
    let truth = run(planner, body, finest, small, REFERENCE, 3).await?;
    let scale = mean(truth.luminance.iter().copied()).abs().max(f64::MIN_POSITIVE);
    let references =
        [run(planner, body, finest, small, SAMPLES, 1).await?, run(planner, body, finest, small, SAMPLES, 2).await?];
    let finer = finer(planner, body, finest, image).await?;
    let mut own: Vec<(u32, f64)> = Vec::new();
    let mut pilots = Vec::new();
    for candidate in candidates {
        let mut runs = Vec::new();
        for samples in CURVE {
            runs.push(run(planner, body, candidate, small, samples, 1).await?);
        }
        let squares: Vec<(u32, f64)> =
            CURVE.into_iter().zip(&runs).map(|(n, r)| (n, (apart(r, &truth) / scale).powi(2))).collect();
        let fastest = runs[1..].iter().map(|r| r.ms_per_sample).fold(f64::INFINITY, f64::min);
        let (mut bias, mut bias_within) = (0.0, 0.0);
        if own.is_empty() {
            own.clone_from(&squares);
        } else if let Some(last) = runs.pop() {
            let other = run(planner, body, candidate, small, SAMPLES, 2).await?;
            (bias, bias_within) = lasting(&[last, other], [&references[0], &references[1]], scale);
        }
        // What the places within a pixel add is less in finer pixels; what the places within a step add is not.
        let noise = squares.iter().zip(&own).map(|((n, all), (_, pixel))| {
            (*n, (finer * finer * pixel + (all - pixel - bias * bias).max(0.0)).max(1e-12).sqrt())
        });
        pilots.push(Pilot {
            candidate: candidate.clone(),
            noise: noise.collect(),
            bias,
            bias_within,
            ms_per_sample: fastest,
        });
    }
    Ok(pilots)
}

/// The root mean square of the difference of two pictures.
fn apart(a: &Run, b: &Run) -> f64 {
    mean(a.luminance.iter().zip(&b.luminance).map(|(a, b)| (a - b).powi(2))).sqrt()
}

/// By how much the noise of the picture's own pixels is less than that of a pilot's, which see more each: what one sample misses of a
/// pixel falls as a power of its side, between edges (½) and smooth slopes (1). The power is that from half the pilot to the pilot.
async fn finer(planner: &Planner<'_>, body: &Value, candidate: &Candidate, image: [u32; 2]) -> Result<f64> {
    let (small, mut errors) = (size(image), Vec::new());
    let half = small.map(|side| (side / 2).max(1));
    for size in [half, small] {
        let one = run(planner, body, candidate, size, 1, 1).await?;
        errors.push(apart(&one, &run(planner, body, candidate, size, REFERENCE, 3).await?));
    }
    let power = if errors[1] > 0.0 { (errors[0] / errors[1]).log2().clamp(0.3, 1.2) } else { 0.5 };
    Ok((f64::from(small[1]) / f64::from(image[1])).powf(power))
}

/// The first samples of the picture itself, with the setting that is likely to be chosen: of random paths their noise, and their time
/// without what a render costs besides its samples.
///
/// # Errors
/// Those of the request.
pub async fn confirm(
    planner: &Planner<'_>,
    body: &Value,
    image: [u32; 2],
    pilot: &Pilot,
    first: u32,
    besides: f64,
) -> Result<Pilot> {
    let run = run(planner, body, &pilot.candidate, image, first, 1).await?;
    let scale = mean(run.luminance.iter().copied()).abs().max(f64::MIN_POSITIVE);
    let samples = f64::from(first);
    // Of fewer samples the film knows its noise less well than the pilot.
    let better = pilot.is_random() && first == CONFIRMED;
    let noise = if better { vec![(first, run.noise / scale)] } else { pilot.noise.clone() };
    Ok(Pilot { noise, ms_per_sample: run.ms_per_sample * samples / (samples + besides), ..pilot.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_loss_is_found_under_noise_ten_times_as_large() {
        let mut random = noise(7);
        let mut run = |level: f64| Run {
            luminance: (0..4096).map(|_| level + random()).collect(),
            noise: 0.3,
            ms_per_sample: 1.0,
        };
        let references = [run(1.0), run(1.0)];
        let runs = [run(0.97), run(0.97)];
        let (bias, within) = lasting(&runs, [&references[0], &references[1]], 1.0);
        assert!((bias - 0.03).abs() < within + 0.03 && bias + within > 0.03, "{bias} + {within}");
        let honest = [run(1.0), run(1.0)];
        let (bias, within) = lasting(&honest, [&references[0], &references[1]], 1.0);
        assert!(bias + within < 0.12, "{bias} + {within}: nothing is missing");
    }

    /// Noise of deviation 0.3.
    fn noise(seed: u32) -> impl FnMut() -> f64 {
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
