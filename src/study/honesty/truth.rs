//! The truth of a scene: the picture by another path, with other random numbers at other places in the pixels.

use serde_json::{Value, json};

use crate::error::Result;
use crate::film::{by_chance, freedom};
use crate::study::bench::{Bench, Reads, block_means};
use crate::study::field_of;
use crate::study::measure::measure;

/// The truth's error as a part of the picture's: it is as good as none, as it adds in squares.
const ENOUGH: f64 = 0.15;
/// The truth's error as a part of the picture's above which nothing can be said of the picture.
const TOO_MUCH: f64 = 0.4;
/// The sides of the blocks of pixels of the two pictures whose mean is the truth: their samples are at different places.
const BLOCKS: [usize; 2] = [2, 3];
/// An error below this, relative, is that of single precision.
const NOTHING: f64 = 1e-6;
/// The samples of a pixel at first and at most, in all its blocks together, and the work of a field as a multiple of the picture's.
const SAMPLES: [u64; 2] = [64, 1 << 15];
const WORK: [u64; 2] = [4, 256];
/// The first step as a multiple of the shortest, which is the truth's own.
const STEP: f64 = 8.0;
/// The most pixels a side of the pictures that tell what the step costs.
const SIDE: f64 = 64.0;

/// The error of a picture, relative to its mean luminance, and the truth with its own error.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Root mean square over the pixels, less what the truth's own error adds.
    pub error: f64,
    /// The error that the truth has at most, in 19 of 20 cases.
    pub known_to: f64,
    /// The truth, and the expected noise of it.
    values: Vec<f64>,
    noise: f64,
}

impl Judged {
    /// The error of another picture.
    ///
    /// # Errors
    /// Those of measuring.
    pub fn of(&self, picture: &[f64]) -> Result<f64> {
        let apart = measure(std::slice::from_ref(&picture.to_vec()), &self.values)?.rmse;
        Ok((apart.powi(2) - self.noise.powi(2)).max(0.0).sqrt())
    }
}

/// The work on a truth. It grows where it is not enough.
#[derive(Clone, Copy)]
struct Effort {
    samples: u64,
    /// The work of a field.
    work: u64,
    /// The step as a multiple of the truth's own.
    step: f64,
}

/// Judges the luminance of a picture of `request`'s size. `None` if the truth cannot be known well enough within `most_ms` of device time.
///
/// # Errors
/// Those of the request, and of measuring.
pub fn judge(bench: &Bench, truth: &Value, picture: &[f64], most_ms: f64) -> Result<Option<Judged>> {
    let has_steps = step_voxels(truth).is_some();
    let mut effort = Effort { samples: SAMPLES[0], work: WORK[0], step: if has_steps { STEP } else { 1.0 } };
    let mut spent = 0.0;
    loop {
        // What twice the step makes is at least what the step still costs the truth.
        let (by_step, ms) = step_error(bench, truth, effort)?;
        spent += ms;
        let mut means = Vec::new();
        for (seed, side) in [(900_001, BLOCKS[0]), (900_002, BLOCKS[1])] {
            let run = bench.run(&request(truth, side, effort, seed), Reads::Luminance)?;
            spent += run.device_ms;
            let size = ["width", "height"].map(|s| truth["image"][s].as_u64().unwrap_or(1) as usize * side);
            means.push(block_means(&run.values, size, side));
        }
        let values: Vec<f64> = means[0].iter().zip(&means[1]).map(|(a, b)| 0.5 * (a + b)).collect();
        // Each of the two is wrong by half of their difference, as their mean is. If few pixels have most of it, these may agree by chance.
        let noise = measure(&means[..1], &values)?.rmse;
        let differences: Vec<f64> = means[0].iter().zip(&means[1]).map(|(a, b)| a - b).collect();
        let likely =
            noise * by_chance(freedom(&differences, truth["image"]["width"].as_u64().unwrap_or(1) as usize), 1.0);
        let apart = measure(std::slice::from_ref(&picture.to_vec()), &values)?.rmse;
        let error = (apart.powi(2) - noise.powi(2)).max(0.0).sqrt();
        let judged = Judged { error, known_to: likely.hypot(by_step), values, noise };
        let (is_smooth, is_fine) = (likely <= ENOUGH * apart, by_step <= ENOUGH * apart);
        if (is_smooth && is_fine) || apart < NOTHING {
            return Ok(Some(judged));
        }
        let before = effort;
        if !is_fine && effort.step > 1.0 {
            effort.step *= 0.5;
        }
        if !is_smooth && 4 * effort.samples <= SAMPLES[1] {
            effort.samples *= 4;
            effort.work = (4 * effort.work).min(WORK[1]);
        }
        let factor = before.step / effort.step * effort.samples as f64 / before.samples as f64;
        if factor <= 1.0 || (1.0 + factor) * spent > most_ms {
            return Ok((judged.known_to <= TOO_MUCH * apart).then_some(judged));
        }
    }
}

/// The truth's own step, if it has one.
fn step_voxels(truth: &Value) -> Option<f64> {
    truth[truth["technique"].as_str()?]["step_voxels"].as_f64()
}

/// The difference that twice the truth's step makes in a picture of fewer pixels, on the same places and random numbers, relative to the mean luminance,
/// and its device time, ms; 0 without a step.
fn step_error(bench: &Bench, truth: &Value, effort: Effort) -> Result<(f64, f64)> {
    if step_voxels(truth).is_none() {
        return Ok((0.0, 0.0));
    }
    let mut small = truth.clone();
    let sides = ["width", "height"].map(|of| small["image"][of].as_f64().unwrap_or(1.0));
    let part = (SIDE / sides[0].max(sides[1])).min(1.0);
    small["image"] = json!({"width": (part * sides[0]).ceil() as u64, "height": (part * sides[1]).ceil() as u64});
    let run = |step: f64| {
        let few = Effort { samples: 16, work: 1, step: step * effort.step };
        bench.run(&request(&small, 1, few, 900_003), Reads::Luminance)
    };
    let (fine, twice) = (run(1.0)?, run(2.0)?);
    Ok((measure(&[twice.values], &fine.values)?.rmse, fine.device_ms + twice.device_ms))
}

/// The truth's request with blocks of pixels in place of pixels, and about as many samples in all of them. A field has a seed of its own.
fn request(truth: &Value, side: usize, effort: Effort, seed: u64) -> Value {
    let mut request = truth.clone();
    for of in ["width", "height"] {
        request["image"][of] = json!(truth["image"][of].as_u64().unwrap_or(1) * side as u64);
    }
    if let (Some(step), Some(name)) = (step_voxels(truth), truth["technique"].as_str()) {
        request[name]["step_voxels"] = json!(effort.step * step);
    }
    if let Some((work, field)) = field_of(&mut request) {
        field[work.of] = json!(effort.work * field[work.of].as_u64().unwrap_or(work.first));
        field["seed"] = json!(seed);
    }
    request["budget"] = json!({"samples": effort.samples.div_ceil((side * side) as u64)});
    request["seed"] = json!(seed);
    request
}
