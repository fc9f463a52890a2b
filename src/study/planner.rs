//! Whether the planner keeps its word: random scenes, each planned, rendered as planned, and compared with every setting tried by force.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::bench::{Bench, Reads, Run};
use super::oracle::Random;
use super::record::Machine;
use super::{Scale, machine};
use crate::error::Result;

/// What a plan may cost over the cheapest setting that would have done, and a time over the predicted one or under it.
const COST_FACTOR: f64 = 1.3;
const TIME_FACTOR: f64 = 1.5;
/// The truth's noise, of the error asked for.
const TRUTH_NOISE: f64 = 0.25;
/// Samples that are tried by force, each this often over the one before.
const MORE: u64 = 4;
const MOST_SAMPLES: u64 = 4096;

/// What came of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// What was asked for.
    pub request: Value,
    /// The error asked for.
    pub asked: f64,
    /// What was rendered: technique, options, samples.
    pub planned: String,
    /// The error of that picture.
    pub true_error: f64,
    /// Device times.
    pub predicted_ms: f64,
    /// See `predicted_ms`.
    pub measured_ms: f64,
    /// The cheapest setting that would have done, and its time; none where none that was tried does.
    pub cheapest: Option<String>,
    /// See `cheapest`.
    pub cheapest_ms: Option<f64>,
}

/// What came of all scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// Whether it is the short form.
    pub quick: bool,
    /// Where it was measured.
    pub machine: Machine,
    /// Scene by scene.
    pub scenes: Vec<Outcome>,
}

impl Outcome {
    /// The true error is at most the one asked for.
    pub fn is_met(&self) -> bool {
        self.true_error <= self.asked
    }

    /// The device took about as long as predicted.
    pub fn is_in_time(&self) -> bool {
        let ratio = self.measured_ms / self.predicted_ms;
        (1.0 / TIME_FACTOR..=TIME_FACTOR).contains(&ratio)
    }

    /// It cost about as little as it could.
    pub fn is_cheap(&self) -> bool {
        // Where no setting that was tried by force is enough, a plan that is has found the cheapest.
        self.cheapest_ms.map_or(self.is_met(), |least| self.measured_ms <= COST_FACTOR * least)
    }
}

impl Planned {
    /// How many plans kept to the error, to the time, and to the cost.
    pub fn figures(&self) -> [usize; 3] {
        let count = |kept: fn(&Outcome) -> bool| self.scenes.iter().filter(|s| kept(s)).count();
        [count(Outcome::is_met), count(Outcome::is_in_time), count(Outcome::is_cheap)]
    }

    /// The page in Markdown.
    pub fn page(&self) -> String {
        let ([met, timed, cheap], n) = (self.figures(), self.scenes.len());
        let mut text = format!(
            "# Does the planner keep its word?\n\n{n} random scenes of fixed seeds, each planned for a `max_error`, rendered as planned, and \
            compared with a long run of another tracker or a finer step, and with every setting tried by force. Measured on {}, {} threads, \
            {}; version {} ({}). `./dev study --case planner` makes this page.\n\n| | plans | of |\n|---|---|---|\n\
            | the true error is at most the one asked for | {met} | {n} |\n\
            | the device time is within a factor of {TIME_FACTOR} of the predicted one | {timed} | {n} |\n\
            | the cost is at most {COST_FACTOR} times that of the cheapest setting that would have done | {cheap} | {n} |\n\n\
            | scene | asked | true error | predicted | measured | cheapest that does | planned |\n|---|---|---|---|---|---|---|\n",
            self.machine.processor,
            self.machine.threads,
            self.machine.platform,
            self.machine.version,
            self.machine.commit
        );
        for (i, s) in self.scenes.iter().enumerate() {
            let mark = |kept: bool| if kept { "" } else { " **!**" };
            text += &format!(
                "| {i} | {:.2} % | {:.2} %{} | {:.1} ms | {:.1} ms{} | {}{} | {} |\n",
                100.0 * s.asked,
                100.0 * s.true_error,
                mark(s.is_met()),
                s.predicted_ms,
                s.measured_ms,
                mark(s.is_in_time()),
                s.cheapest_ms
                    .map_or("–".into(), |ms| format!("{ms:.1} ms ({})", s.cheapest.as_deref().unwrap_or_default())),
                mark(s.is_cheap()),
                s.planned
            );
        }
        text
    }
}

/// Plans and measures the scenes; `told` hears of each.
///
/// # Errors
/// Those of the requests.
pub fn planner(bench: &Bench, scale: Scale, told: &mut dyn FnMut(&str)) -> Result<Planned> {
    let mut scenes = Vec::new();
    for seed in 0..scale.pick(10, 100) {
        let found = outcome(bench, &scene(seed))?;
        told(&format!(
            "planner, scene {seed}: asked {:.3}, is {:.4}; {:.1} ms for {:.1} predicted, cheapest {:.1?}; {}",
            found.asked, found.true_error, found.measured_ms, found.predicted_ms, found.cheapest_ms, found.planned
        ));
        scenes.push(found);
    }
    Ok(Planned { quick: scale == Scale::Quick, machine: machine(bench), scenes })
}

/// A random scene: three in five scatter light, the others are composites.
fn scene(seed: u64) -> Value {
    let mut random = Random::new(1000 + seed);
    let mut unit = || random.unit();
    let volumes = ["smoke", "gaussian", "sphere", "marschner_lobb", "smoke", "constant"];
    let resolution = [32, 64, 96][(unit() * 3.0) as usize];
    let volume = json!({"builtin": volumes[(unit() * 6.0) as usize], "resolution": resolution, "seed": seed});
    let (turn, height) = (std::f64::consts::TAU * unit(), unit() - 0.3);
    let far = 2.6 + 1.2 * unit();
    let eye = [far * turn.cos(), far * height, far * turn.sin()];
    let mut request = json!({"technique": "auto", "volume": volume, "camera": {"eye": eye, "fov_y_deg": 36.0 + 14.0 * unit()},
        "image": {"width": 256, "height": 192}, "seed": 5});
    let logarithmic = |u: f64, least: f64, most: f64| least * (most / least).powf(u);
    if seed % 5 < 3 {
        let albedo = [0.0, 0.3, 0.6, 0.9, 0.98][(unit() * 5.0) as usize];
        request["medium"] = json!({"sigma_t_per_unit": logarithmic(unit(), 0.05, 15.0), "albedo": albedo,
            "phase": {"type": "henyey_greenstein", "g": 0.9 * unit()}});
        let sun = json!({"type": "sun", "direction": [unit() - 0.5, 0.3 + unit(), unit() - 0.5], "irradiance": 1.0 + 3.0 * unit()});
        let sky = json!({"type": "sky", "radiance": 0.1 + 0.5 * unit()});
        let lamp = json!({"type": "sphere", "position": [1.5, 1.0 + unit(), -0.5], "radius": 0.3, "radiance": 10.0});
        request["lights"] = [json!([sun, sky]), json!([sky]), json!([lamp, sky])][(unit() * 3.0) as usize].clone();
        request["budget"] = json!({"max_error": logarithmic(unit(), 0.01, 0.1)});
    } else {
        let steep = 0.02 + 0.4 * unit();
        let middle = 0.2 + 0.5 * unit();
        let points = json!([{"value": middle - 0.5 * steep, "color": [0.2, 0.4, 0.9], "opacity_per_unit": 0},
            {"value": middle + 0.5 * steep, "color": [1, 0.8, 0.5], "opacity_per_unit": logarithmic(unit(), 0.5, 30.0)}]);
        request["emission_absorption"] = json!({"transfer_function": {"points": points}, "shading": unit() < 0.4});
        request["budget"] = json!({"max_error": logarithmic(unit(), 0.003, 0.03)});
    }
    request
}

/// A truth and how well it is known.
struct Known {
    values: Vec<f64>,
    mean: f64,
    noise: f64,
}

impl Known {
    /// The relative error of a run, less the truth's own.
    fn error(&self, run: &Run) -> f64 {
        let squares =
            run.values.iter().zip(&self.values).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / self.values.len() as f64;
        (squares / self.mean.powi(2) - self.noise.powi(2)).max(0.0).sqrt()
    }
}

fn with_samples(request: &Value, samples: u64) -> Value {
    let mut request = request.clone();
    request["budget"] = json!({"samples": samples});
    request
}

/// The reference setting with other random numbers: of paths with weighted tracking, until it is known well enough.
fn truth(bench: &Bench, reference: &Value, asked: f64) -> Result<Known> {
    let mut request = reference.clone();
    request["seed"] = json!(77);
    let random = request["technique"] == "volume_path";
    if random {
        request["volume_path"]["tracking"] = json!("weighted");
    }
    let first = bench.run(&with_samples(&request, 16), Reads::Luminance)?;
    let noise = first.reply.pointer("/error_parts/noise").and_then(Value::as_f64).unwrap_or(0.0);
    let samples =
        if random { (16.0 * (noise / (TRUTH_NOISE * asked)).powi(2)).clamp(64.0, 20_000.0) as u64 } else { 512 };
    let run = bench.run(&with_samples(&request, samples), Reads::Luminance)?;
    let noise = run.reply.pointer("/error_parts/noise").and_then(Value::as_f64).unwrap_or(0.0);
    let mean = run.values.iter().sum::<f64>() / run.values.len() as f64;
    // Steps along a ray have no noise but the places within a pixel, of which there are many.
    Ok(Known { values: run.values, mean, noise: if random { noise } else { 0.0 } })
}

fn outcome(bench: &Bench, request: &Value) -> Result<Outcome> {
    let asked = request["budget"]["max_error"].as_f64().unwrap_or(0.0);
    let settings = bench.settings(request)?;
    let known = truth(bench, &settings[0].1, asked)?;
    let plan = bench.plan(request)?;
    let first = bench.run(&plan.request, Reads::Luminance)?;
    let run = bench.run(&plan.request, Reads::Luminance)?;
    let measured_ms = first.device_ms.min(run.device_ms);
    let mut cheapest: Option<(f64, String)> = None;
    for (words, setting) in &settings {
        if let Some(ms) = least_ms(bench, setting, &known, asked)?
            && cheapest.as_ref().is_none_or(|(least, _)| ms < *least)
        {
            cheapest = Some((ms, words.clone()));
        }
    }
    Ok(Outcome {
        request: request.clone(),
        asked,
        planned: format!("{}, {} samples, {}", plan.technique, run.samples, plan.options),
        true_error: known.error(&run),
        predicted_ms: plan.device_ms.value,
        measured_ms,
        cheapest: cheapest.as_ref().map(|c| c.1.clone()),
        cheapest_ms: cheapest.map(|c| c.0),
    })
}

/// The least device time at which a setting is within the error: between the last number of samples that is not enough and the first that
/// is, as a power law says.
fn least_ms(bench: &Bench, setting: &Value, known: &Known, asked: f64) -> Result<Option<f64>> {
    let (mut samples, mut before): (u64, Option<(u64, f64, f64)>) = (1, None);
    while samples <= MOST_SAMPLES {
        let run = bench.run(&with_samples(setting, samples), Reads::Luminance)?;
        let error = known.error(&run);
        if error <= asked {
            // Between two numbers of samples the error of random paths is known; of places that are spread evenly it jumps.
            let random = setting["technique"] == "volume_path" || setting["technique"] == "single_scatter";
            return Ok(Some(before.filter(|_| random).map_or(run.device_ms, |(fewer, worse, ms)| {
                let [fewer, samples] = [fewer as f64, samples as f64];
                let power = (error / worse).ln() / (samples / fewer).ln();
                let needed = (fewer * (asked / worse).powf(1.0 / power)).ceil();
                ms + (run.device_ms - ms) * ((needed - fewer) / (samples - fewer)).clamp(0.0, 1.0)
            })));
        }
        // A bias that more samples do not take away.
        if samples > 16 && before.is_some_and(|(_, worse, _)| error > 0.8 * worse) {
            return Ok(None);
        }
        before = Some((samples, error, run.device_ms));
        samples *= MORE;
    }
    Ok(None)
}
