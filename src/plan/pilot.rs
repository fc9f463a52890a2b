//! A few thousand pixels of the picture itself with each candidate: what it costs on this device, and what it is wrong by.
//!
//! What is left out is the mean over the pixels of d₁ d₂, where d is the difference to the reference with seeds of their own: noise of the
//! two is independent and averages to nothing, and places in a pixel are the same for both. Of random paths the noise is the film's own
//! estimate, and a plan of many samples is confirmed by the first few of the whole picture. Where the samples are spread better than random
//! ones, as the places in a pixel and in a step are, it is looked up on the curve of the pilot: what its picture after n samples differs by
//! from that after N, with |I_n − I_N|² ≈ e_n² (1 − n/N), which is what random samples have.

use serde_json::{Value, json};

use super::Planner;
use super::candidates::Candidate;
use super::run::{Run, curve, finish, mean};
use crate::error::{Error, Result};

/// Pixels of a pilot, about.
const PIXELS: f64 = 4096.0;
/// Samples of a pilot.
const SAMPLES: u32 = 16;
/// Samples of a deeper one, of those that are likely to be planned, and of those of the one before.
const DEEPER: [u32; 2] = [4, 8];
/// Samples of the whole picture with the chosen setting that confirm it.
const CONFIRMED: u32 = 4;
/// A picture of which a sample takes less, ms, is timed so often.
const SHORT: f64 = 20.0;
const REPEATS: usize = 3;
/// Deviations that one in twenty is beyond, on one side.
const ONE_IN_TWENTY: f64 = 1.645;
/// Groups of pixels of which the spread tells how well a bias is known.
const GROUPS: usize = 16;

/// What a pilot found.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// Of what.
    pub candidate: Candidate,
    /// The noise after so many samples, relative; one entry where it is that of random samples.
    pub noise: Vec<(u32, f64)>,
    /// How much more than the noise a picture may be wrong by chance.
    pub chance: f64,
    /// What more samples do not take away, relative,
    pub bias: f64,
    /// and how much larger it might be.
    pub bias_within: f64,
    /// Device time of a sample of a pixel, ms.
    pub ms_per_sample: f64,
    /// What one sample differs by from the first few, relative.
    pub first_step: f64,
    /// Whether more samples than were looked at are taken to be as good as they could be: a pilot that might be the best is looked at.
    pub hopeful: bool,
    /// Once the whole picture was begun: what it costs besides its samples and what a sample of it costs, ms.
    pub whole: Option<[f64; 2]>,
}

/// What a picture may be wrong by over its noise, in 19 of 20: the square of the error has a relative variance of 2/ν, where ν are the
/// pixels that matter, and so has what `samples` of each know of it, over the samples.
fn chance(pixels: f64, samples: u32) -> f64 {
    let variance = 2.0 / pixels.max(1.0) * (1.0 + 1.0 / (f64::from(samples) - 1.0).max(1.0));
    (1.0 + ONE_IN_TWENTY * variance.sqrt()).sqrt()
}

/// How far apart the pixels of a pilot are in the picture.
fn apart(image: [u32; 2]) -> u32 {
    (f64::from(image[0]) * f64::from(image[1]) / PIXELS).sqrt().round().max(1.0) as u32
}

async fn run(
    planner: &Planner<'_>,
    body: &Value,
    candidate: &Candidate,
    apart: u32,
    samples: u32,
    seed: u64,
) -> Result<Run> {
    let mut request = candidate.request(body);
    request["budget"] = json!({"samples": samples.min(planner.limits.max_samples)});
    request["seed"] = json!(seed);
    finish(planner, request, apart).await
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
    let apart = apart(image);
    let mut references: Option<[Run; 2]> = None;
    let mut pilots = Vec::new();
    for candidate in candidates {
        let runs = [
            run(planner, body, candidate, apart, SAMPLES, 1).await?,
            run(planner, body, candidate, apart, SAMPLES, 2).await?,
        ];
        let scale = references.as_ref().unwrap_or(&runs)[0].mean();
        let (bias, bias_within) = match &references {
            Some([a, b]) if !candidate.unbiased => {
                let apart = |run: &Run, other: &Run, i: usize| (run.luminance(i) - other.luminance(i)) / scale;
                lasting((0..a.pixels).map(|i| apart(&runs[0], a, i) * apart(&runs[1], b, i)).collect())
            }
            _ => (0.0, 0.0),
        };
        pilots.push(Pilot {
            candidate: candidate.clone(),
            noise: runs[0].noise(scale),
            // There are more pixels in the picture, of the same kinds.
            chance: chance(runs[0].film.random_noise().1 * f64::from(apart * apart), SAMPLES),
            bias,
            bias_within,
            ms_per_sample: runs[0].ms[1].min(runs[1].ms[1]) / runs[0].pixels as f64,
            first_step: runs[0].apart(1, CONFIRMED) / scale,
            hopeful: true,
            whole: None,
        });
        references.get_or_insert(runs);
    }
    if pilots.is_empty() { Err(Error::internal("no candidate is possible")) } else { Ok(pilots) }
}

/// The root of the mean of the products d₁ d₂ of the pixels, and how much more it might be: two deviations, by the spread over groups of
/// pixels.
fn lasting(products: Vec<f64>) -> (f64, f64) {
    let count = GROUPS.min(products.len());
    let groups: Vec<f64> = (0..count).map(|g| mean(products.iter().skip(g).step_by(count).copied())).collect();
    let middle = mean(groups.iter().copied());
    let spread = match count {
        0 | 1 => middle.abs(),
        n => (mean(groups.iter().map(|g| (g - middle).powi(2))) / (n - 1) as f64).sqrt(),
    };
    let bias = middle.max(0.0).sqrt();
    (bias, (middle.max(0.0) + 2.0 * spread).sqrt() - bias)
}

/// The pilot with a longer curve, where `samples` of what is not random are likely to be planned and its curve is too short to know.
///
/// # Errors
/// Those of the request.
pub async fn deepen(
    planner: &Planner<'_>,
    body: &Value,
    image: [u32; 2],
    pilot: &Pilot,
    samples: u32,
) -> Result<Option<Pilot>> {
    let known = pilot.noise.last().map_or(u32::MAX, |n| n.0);
    let deep = (DEEPER[0] * samples).min(DEEPER[1] * 2 * known).min(planner.limits.max_samples);
    if pilot.is_random() || samples <= known || deep <= 2 * known {
        return Ok(None);
    }
    let run = run(planner, body, &pilot.candidate, apart(image), deep, 1).await?;
    let noise = curve(&run.film.rounds).into_iter().map(|(n, e)| (n, e / run.mean())).collect();
    Ok(Some(Pilot { noise, ms_per_sample: run.ms[1] / run.pixels as f64, ..pilot.clone() }))
}

/// The first samples of the whole picture, with the setting that is likely to be chosen: its time, and its noise, of which a pilot may have
/// seen more or less than there is, the others alike.
///
/// # Errors
/// Those of the request.
pub async fn confirm(planner: &Planner<'_>, body: &Value, pilots: &mut [Pilot], index: usize) -> Result<()> {
    let pilot = &pilots[index];
    let mut runs = vec![run(planner, body, &pilot.candidate, 1, CONFIRMED, 1).await?];
    while runs.len() < REPEATS && runs[0].ms[0] + runs[0].ms[1] < SHORT {
        runs.push(run(planner, body, &pilot.candidate, 1, CONFIRMED, 1).await?);
    }
    let median = |i: usize| {
        let mut all: Vec<f64> = runs.iter().map(|r| r.ms[i]).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (found, whole) = (&runs[0], [median(0), median(1)]);
    if pilot.is_random() {
        let ((noise, pixels), count) = (found.film.random_noise(), found.film.main.count);
        (pilots[index].noise, pilots[index].chance) = (vec![(count, noise / found.mean())], chance(pixels, count));
    } else {
        let seen = found.apart(1, CONFIRMED) / found.mean();
        let more = if seen > 0.0 && pilot.first_step > 0.0 { seen / pilot.first_step } else { 1.0 };
        for pilot in pilots.iter_mut().filter(|p| !p.is_random() && p.whole.is_none()) {
            pilot.noise.iter_mut().for_each(|(_, e)| *e *= more);
            pilot.first_step *= more;
        }
    }
    pilots[index].whole = Some(whole);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::run::tests::noise;
    use super::*;

    #[test]
    fn a_planted_loss_is_found_under_noise_ten_times_as_large() {
        let mut random = noise(7);
        let mut products = |missing: f64| -> Vec<f64> {
            let mut difference = || random() - random() - missing;
            (0..4096).map(|_| difference() * difference()).collect()
        };
        let (bias, within) = lasting(products(0.03));
        assert!((bias - 0.03).abs() < within + 0.03 && bias + within > 0.03, "{bias} + {within}");
        let (bias, within) = lasting(products(0.0));
        assert!(bias + within < 0.12, "{bias} + {within}: nothing is missing");
    }
}
