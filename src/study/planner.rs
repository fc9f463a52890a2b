//! A check that the planner keeps its word: random scenes, each planned, rendered as planned, and compared with every setting tried by
//! force.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::bench::Bench;
use super::by_force::{in_turns, least_ms, timed, truth, with_samples};
use super::machine;
use super::oracle::Random;
use super::record::Machine;
use crate::error::Result;
use crate::plan::Plan;

/// The greatest factor of a plan's cost over the cheapest setting that would have done, and of a time over the predicted one or under it.
const COST_FACTOR: f64 = 1.3;
const TIME_FACTOR: f64 = 1.5;

/// The outcome of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The number of the scene.
    pub scene: u64,
    /// The request as it was asked for.
    pub request: Value,
    /// The error asked for.
    pub asked: f64,
    /// The rendered setting: technique, options, samples.
    pub planned: String,
    /// The error of that picture; `None` if the plan itself says that nothing is within the error, since such a plan is not run.
    pub true_error: Option<f64>,
    /// The predicted device time, ms.
    pub predicted_ms: f64,
    /// The measured device time, ms; `None` as for `true_error`.
    pub measured_ms: Option<f64>,
    /// The cheapest setting that would have done; `None` if no setting that was tried does.
    pub cheapest: Option<String>,
    /// The device time of `cheapest`, ms.
    pub cheapest_ms: Option<f64>,
}

/// The outcomes of all scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// The machine of the measurement.
    pub machine: Machine,
    /// The outcomes, scene by scene.
    pub scenes: Vec<Outcome>,
}

impl Outcome {
    /// True if the true error is at most the one asked for.
    pub fn is_met(&self) -> bool {
        self.true_error.is_some_and(|error| error <= self.asked)
    }

    /// True if the device took about as long as predicted.
    pub fn is_in_time(&self) -> bool {
        let ratio = self.measured_ms.map(|ms| ms / self.predicted_ms);
        ratio.is_some_and(|ratio| (1.0 / TIME_FACTOR..=TIME_FACTOR).contains(&ratio))
    }

    /// True if it cost about as little as it could.
    pub fn is_cheap(&self) -> bool {
        // If no setting that was tried by force is enough, a plan that is enough has found the cheapest.
        let within = |(least, ms): (f64, f64)| ms <= COST_FACTOR * least;
        self.cheapest_ms.zip(self.measured_ms).map_or(self.is_met(), within)
    }
}

impl Planned {
    /// The number of plans that kept to the error, to the time, and to the cost.
    pub fn figures(&self) -> [usize; 3] {
        let count = |kept: fn(&Outcome) -> bool| self.scenes.iter().filter(|s| kept(s)).count();
        [count(Outcome::is_met), count(Outcome::is_in_time), count(Outcome::is_cheap)]
    }

    /// The page in Markdown.
    pub fn page(&self) -> String {
        let ([met, timed, cheap], n) = (self.figures(), self.scenes.len());
        let mut text = format!(
            "# Does the planner keep its word?\n\n{n} random scenes of fixed seeds, each planned for a `max_error`, rendered as planned, and \
            compared with a long run of another tracker or a finer step, and with every setting tried by force. From scene {FINE} on voxels are finer than \
            pixels. A plan that says itself that nothing which is permitted is within the error is not run, and counts as missed. Measured on {}, {} threads, \
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
        for s in &self.scenes {
            let mark = |kept: bool| if kept { "" } else { " **!**" };
            text += &format!(
                "| {} | {:.2} % | {}{} | {:.1} ms | {}{} | {}{} | {} |\n",
                s.scene,
                100.0 * s.asked,
                s.true_error.map_or("–".into(), |error| format!("{:.2} %", 100.0 * error)),
                mark(s.is_met()),
                s.predicted_ms,
                s.measured_ms.map_or("–".into(), |ms| format!("{ms:.1} ms")),
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

/// A range of scenes from text such as 20..40.
///
/// # Errors
/// The reason that the text is no range.
pub fn scenes(text: &str) -> std::result::Result<Range<u64>, String> {
    let ends = text.split_once("..").and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
    ends.filter(|r: &Range<u64>| !r.is_empty()).ok_or_else(|| format!("'{text}' is not a range such as 20..40"))
}

/// Plans and measures the scenes; `told` hears of each.
///
/// # Errors
/// Those of the requests.
pub fn planner(bench: &Bench, scenes: Range<u64>, told: &mut dyn FnMut(&str)) -> Result<Planned> {
    let mut outcomes = Vec::new();
    for seed in scenes {
        let found = outcome(bench, seed, &scene(seed))?;
        told(&format!(
            "planner, scene {seed}: asked {:.3}, is {:.4?}; {:.1?} ms for {:.1} predicted, cheapest {:.1?}; {}",
            found.asked, found.true_error, found.measured_ms, found.predicted_ms, found.cheapest_ms, found.planned
        ));
        outcomes.push(found);
    }
    Ok(Planned { machine: machine(bench), scenes: outcomes })
}

/// The first scene of those with voxels finer than the pixels.
const FINE: u64 = 100;

/// A random scene. Three in five scatter light; the others are composites, as are those of fine voxels.
fn scene(seed: u64) -> Value {
    let mut random = Random::new(1000 + seed);
    let mut unit = || random.unit();
    let volumes = ["smoke", "gaussian", "sphere", "marschner_lobb", "smoke", "constant"];
    let fine = seed >= FINE;
    let resolution = if fine { [160, 192, 256] } else { [32, 64, 96] }[(unit() * 3.0) as usize];
    let volume = json!({"builtin": volumes[(unit() * 6.0) as usize], "resolution": resolution, "seed": seed});
    let (turn, height) = (std::f64::consts::TAU * unit(), unit() - 0.3);
    let far = 2.6 + 1.2 * unit();
    let eye = [far * turn.cos(), far * height, far * turn.sin()];
    let mut request = json!({"technique": "auto", "volume": volume, "camera": {"eye": eye, "fov_y_deg": 36.0 + 14.0 * unit()},
        "image": if fine { json!({"width": 80, "height": 60}) } else { json!({"width": 256, "height": 192}) }, "seed": 5});
    let logarithmic = |u: f64, least: f64, most: f64| least * (most / least).powf(u);
    if seed % 5 < 3 && !fine {
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

/// The outcome of a plan that says itself that nothing permitted is within the error. It is not run, and counts as missed.
fn not_enough(scene: u64, request: &Value, asked: f64, plan: &Plan) -> Outcome {
    Outcome {
        scene,
        request: request.clone(),
        asked,
        planned: format!(
            "not run, as nothing that is permitted is enough: {}",
            words(request, plan, plan.samples.into())
        ),
        true_error: None,
        predicted_ms: plan.device_ms.value,
        measured_ms: None,
        cheapest: None,
        cheapest_ms: None,
    }
}

fn outcome(bench: &Bench, scene: u64, request: &Value) -> Result<Outcome> {
    let asked = request["budget"]["max_error"].as_f64().unwrap_or(0.0);
    let plan = bench.plan(request)?;
    if !plan.considered.iter().any(|c| c.enough) {
        return Ok(not_enough(scene, request, asked, &plan));
    }
    let settings = bench.settings(request)?;
    let known = truth(bench, &settings[0].1, asked)?;
    let (run, mut measured_ms) = timed(bench, &plan.request)?;
    let true_error = known.error(&run)?;
    // A setting that is dearer than the plan, or than the cheapest so far, need not be tried any further.
    let mut cheapest: Option<(f64, String, Value)> =
        (true_error <= asked).then(|| (measured_ms, "the plan".into(), plan.request.clone()));
    for (words, setting) in &settings {
        let dearest = cheapest.as_ref().map_or(f64::INFINITY, |c| c.0);
        if let Some((ms, samples)) = least_ms(bench, setting, &known, asked, dearest)?
            && ms < dearest
        {
            cheapest = Some((ms, words.clone(), with_samples(setting, samples)));
        }
    }
    if let Some((ms, _, setting)) = &mut cheapest {
        (measured_ms, *ms) = in_turns(bench, measured_ms, &plan.request, setting)?;
    }
    Ok(Outcome {
        scene,
        request: request.clone(),
        asked,
        planned: words(request, &plan, run.samples),
        true_error: Some(true_error),
        predicted_ms: plan.device_ms.value,
        measured_ms: Some(measured_ms),
        cheapest: cheapest.as_ref().map(|c| c.1.clone()),
        cheapest_ms: cheapest.map(|c| c.0),
    })
}

/// The options that a plan added to a request, and the number of lights that it left out.
fn words(request: &Value, plan: &Plan, samples: u64) -> String {
    let given = &request[plan.technique.as_str()];
    let options = plan.options.as_object().into_iter().flatten().filter(|(name, value)| given.get(name) != Some(value));
    let options: String = options.map(|(name, value)| format!(", {name} {value}")).collect();
    let lights = |request: &Value| request["lights"].as_array().map_or(0, Vec::len);
    let fewer = match lights(request) - lights(&plan.request) {
        0 => String::new(),
        1 => ", without the faintest light".into(),
        n => format!(", without the {n} faintest lights"),
    };
    let level = plan.request["volume"].get("level").map_or(String::new(), |l| format!(", level {l} of the volume"));
    format!("{}{options}{level}{fewer}; samples: {samples}", plan.technique)
}
