//! The real cost of a setting for an error, by a truth and by more and more samples until they are enough.

use serde_json::{Value, json};

use super::bench::{Bench, Reads, Run};
use super::measure::{measure, median};
use crate::error::Result;
use crate::technique;

/// The truth's noise as a part of the error asked for: of evenly spread samples, and of random ones.
const TRUTH_NOISE: [f64; 2] = [0.2, 0.5];
/// The most samples that are tried by force, and the most samples of a truth.
const MOST_SAMPLES: u64 = 4096;
const MOST_TRUTH: u64 = 8192;
/// A render that takes less than this, ms, is timed `REPEATS` times.
const SHORT: f64 = 100.0;
const REPEATS: usize = 5;
/// The number of turns in which the plan and the cheapest setting are timed, if a render takes longer.
const TURNS: usize = 3;

/// A truth and its noise.
pub(super) struct Known {
    values: Vec<f64>,
    noise: f64,
}

impl Known {
    /// The relative error of a run, less the random part of the truth's own error.
    ///
    /// # Errors
    /// Those of [`measure`].
    pub fn error(&self, run: &Run) -> Result<f64> {
        let rmse = measure(std::slice::from_ref(&run.values), &self.values)?.rmse;
        Ok((rmse.powi(2) - self.noise.powi(2)).max(0.0).sqrt())
    }
}

/// The request with a number of samples as its whole budget.
pub(super) fn with_samples(request: &Value, samples: u64) -> Value {
    let mut request = request.clone();
    request["budget"] = json!({"samples": samples});
    request
}

/// The truth: renders of the reference setting with other random numbers at other places, until their mean is known well enough. The values
/// are the means of 2 × 2 pixels of a picture twice as large each way, by two seeds. The difference of the two tells the random error of
/// their mean. The error of the places is common to both, and it is not taken off. A technique may have parameters of its own for a truth.
pub(super) fn truth(bench: &Bench, reference: &Value, asked: f64) -> Result<Known> {
    let mut request = reference.clone();
    for side in ["width", "height"] {
        request["image"][side] = json!(2 * reference["image"][side].as_u64().unwrap_or(0));
    }
    if let Some(technique) = request["technique"].as_str().and_then(technique::find) {
        let mut own = request[technique.name].as_object().cloned().unwrap_or_default();
        ((technique.cases)().truth)(&mut own);
        request[technique.name] = own.into();
    }
    let mut samples = 8;
    loop {
        let of = |seed: u64| {
            let mut request = with_samples(&request, samples);
            request["seed"] = json!(seed);
            bench.run(&request, Reads::Blocks(2))
        };
        let [a, b] = [of(77)?, of(78)?];
        let random = a.noise_is_random;
        let most = TRUTH_NOISE[usize::from(random)] * asked;
        let stated = a.reply.pointer("/error_parts/noise").and_then(Value::as_f64).unwrap_or(0.0);
        let noise = 0.5 * stated * if random { 0.5f64.sqrt() } else { 1.0 };
        if noise <= most || samples >= MOST_TRUTH {
            let values: Vec<f64> = a.values.iter().zip(&b.values).map(|(a, b)| 0.5 * (a + b)).collect();
            // Each is wrong by half of their difference.
            let noise = measure(&[a.values], &values)?.rmse;
            return Ok(Known { values, noise });
        }
        let needed = (samples as f64 * (noise / most).powi(2)).ceil() as u64;
        samples = needed.clamp(2 * samples, 8 * samples).next_power_of_two().min(MOST_TRUTH);
    }
}

/// A run and its device time. The time of a short run is the median of several.
pub(super) fn timed(bench: &Bench, request: &Value) -> Result<(Run, f64)> {
    let run = bench.run(request, Reads::Luminance)?;
    let mut times = vec![run.device_ms];
    while times.len() < REPEATS && run.device_ms < SHORT {
        times.push(bench.run(request, Reads::Luminance)?.device_ms);
    }
    Ok((run, median(&times)))
}

/// The device times of the plan and of the cheapest setting. They are medians of several runs in turns, since the machine has other work
/// too. A plan takes `about_ms`.
pub(super) fn in_turns(bench: &Bench, about_ms: f64, plan: &Value, cheapest: &Value) -> Result<(f64, f64)> {
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..if about_ms < SHORT { REPEATS } else { TURNS } {
        for (times, request) in times.iter_mut().zip([plan, cheapest]) {
            times.push(bench.run(request, Reads::Mean)?.device_ms);
        }
    }
    Ok((median(&times[0]), median(&times[1])))
}

/// The least device time at which a setting is within the error, if that is less than `dearest`, and the number of samples. For random
/// paths a power law gives the number between the last that is not enough and the first that is.
pub(super) fn least_ms(
    bench: &Bench,
    setting: &Value,
    known: &Known,
    asked: f64,
    dearest: f64,
) -> Result<Option<(f64, u64)>> {
    let (mut samples, mut before): (u64, Option<(u64, f64, f64)>) = (1, None);
    let mut errors: Vec<f64> = Vec::new();
    while samples <= MOST_SAMPLES {
        let (run, time) = timed(bench, &with_samples(setting, samples))?;
        let error = known.error(&run)?;
        if error <= asked {
            // Between two numbers of samples the error of random paths is known; the error of evenly spread places jumps.
            let random = bench.is_random(setting)?;
            return Ok(Some(before.filter(|_| random).map_or((time, samples), |(fewer, worse, ms)| {
                let [few, many] = [fewer as f64, samples as f64];
                let power = (error / worse).ln() / (many / few).ln();
                let needed = (few * (asked / worse).powf(1.0 / power)).ceil().clamp(few, many);
                (ms + (time - ms) * (needed - few) / (many - few), needed as u64)
            })));
        }
        // The setting has a bias that four times the samples do not take away, evenly spread as they may be, or it is too slow to be the
        // cheapest.
        let earlier = errors.len().checked_sub(2).map(|i| errors[i]);
        errors.push(error);
        if samples > 16 && earlier.is_some_and(|worse| error > 0.9 * worse) || time > dearest {
            return Ok(None);
        }
        before = Some((samples, error, time));
        samples *= 2;
    }
    Ok(None)
}
