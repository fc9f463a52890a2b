//! The truth of a scene: the picture by another path, with other random numbers at other places in the pixels.

use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::{Bench, Reads, block_means};
use crate::study::measure::measure;

/// The truth's error as a part of the picture's: it is as good as none, as it adds in squares.
const ENOUGH: f64 = 0.15;
/// The truth's error as a part of the picture's above which nothing can be said of the picture.
const TOO_MUCH: f64 = 0.4;
/// The sides of the blocks of pixels of the two pictures whose mean is the truth: their samples are at different places.
const BLOCKS: [usize; 2] = [2, 3];
/// An error below this, relative, is that of single precision.
const NOTHING: f64 = 1e-6;
/// The most samples of a pixel, in all its blocks together.
const MOST_SAMPLES: u64 = 1 << 15;

/// The error of a picture, relative to its mean luminance, and that of the truth itself.
#[derive(Debug, Clone, Copy)]
pub struct Judged {
    /// Root mean square over the pixels, less what the truth's own error adds.
    pub error: f64,
    /// The error of the truth.
    pub known_to: f64,
}

/// Judges the luminance of a picture of `request`'s size. `None` if the truth cannot be known well enough within `most_ms` of device time.
///
/// # Errors
/// Those of the request, and of measuring.
pub fn judge(bench: &Bench, truth: &Value, picture: &[f64], most_ms: f64) -> Result<Option<Judged>> {
    let mut samples = 64;
    let mut spent = 0.0;
    // What twice the step makes is at least what the step still costs the truth.
    let by_step = step_error(bench, truth)?;
    loop {
        let mut means = Vec::new();
        for (seed, side) in [(900_001, BLOCKS[0]), (900_002, BLOCKS[1])] {
            let run = bench.run(&request(truth, side, samples, seed), Reads::Luminance)?;
            spent += run.device_ms;
            let size = ["width", "height"].map(|s| truth["image"][s].as_u64().unwrap_or(1) as usize * side);
            means.push(block_means(&run.values, size, side));
        }
        let values: Vec<f64> = means[0].iter().zip(&means[1]).map(|(a, b)| 0.5 * (a + b)).collect();
        // Each of the two is wrong by half of their difference, as their mean is.
        let noise = measure(&means[..1], &values)?.rmse;
        let apart = measure(std::slice::from_ref(&picture.to_vec()), &values)?.rmse;
        let error = (apart.powi(2) - noise.powi(2)).max(0.0).sqrt();
        let judged = Judged { error, known_to: noise.hypot(by_step) };
        if by_step > TOO_MUCH * apart {
            return Ok(None);
        }
        if noise <= ENOUGH * apart || apart < NOTHING {
            return Ok(Some(judged));
        }
        if 4 * samples > MOST_SAMPLES || 5.0 * spent > most_ms {
            return Ok((judged.known_to <= TOO_MUCH * apart).then_some(judged));
        }
        samples *= 4;
    }
}

/// The difference that twice the truth's step makes, on the same places and random numbers, relative to the mean luminance; 0 without a step.
fn step_error(bench: &Bench, truth: &Value) -> Result<f64> {
    let name = truth["technique"].as_str().unwrap_or_default();
    let Some(step) = truth[name]["step_voxels"].as_f64() else { return Ok(0.0) };
    let run = |step: f64| -> Result<Vec<f64>> {
        let mut request = request(truth, 1, 16, 900_003);
        request[name]["step_voxels"] = json!(step);
        Ok(bench.run(&request, Reads::Luminance)?.values)
    };
    let (fine, twice) = (run(step)?, run(2.0 * step)?);
    Ok(measure(&[twice], &fine)?.rmse)
}

/// The truth's request with blocks of pixels in place of pixels, and about as many samples in all of them.
fn request(truth: &Value, side: usize, samples: u64, seed: u64) -> Value {
    let mut request = truth.clone();
    for of in ["width", "height"] {
        request["image"][of] = json!(truth["image"][of].as_u64().unwrap_or(1) * side as u64);
    }
    request["budget"] = json!({"samples": samples.div_ceil((side * side) as u64)});
    request["seed"] = json!(seed);
    request
}
