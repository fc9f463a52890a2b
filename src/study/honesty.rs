//! A check that stated errors keep their word: random scenes over every view and option, each rendered once and compared with a truth by another
//! path.

mod figures;
mod moment;
mod page;
pub mod scene;
mod subject;
pub mod truth;

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::bench::{Bench, Reads};
use super::machine;
use super::record::Machine;
use crate::error::{Error, Result};
pub use figures::Figures;
use moment::Seen;
use scene::Scene;
use truth::Judged;

/// The sides of pictures, pixels; a quick study has the first few.
const SIZES: [u32; 9] = [16, 24, 32, 48, 64, 96, 128, 256, 512];
const QUICK_SIZES: usize = 4;
/// The device time for a scene's truth, ms, in a quick study and else.
const TRUTH_MS: [f64; 2] = [3_000.0, 10_000.0];
/// The ratio of two numbers of samples that are tried.
const FEWER: f64 = 1.4;

/// The outcome of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The number of the scene.
    pub scene: u64,
    /// The view, or `auto`.
    pub technique: String,
    /// The moment at which it was judged.
    pub moment: String,
    /// The options that it was given, the kind of its subject, and its budget.
    pub options: Vec<String>,
    /// The lesser side of the picture, pixels.
    pub side: u64,
    /// The samples of the picture.
    pub samples: u64,
    /// The error asked for, if the render stopped because it had reached it.
    pub asked: Option<f64>,
    /// The samples over the fewest that are within that error.
    pub late: Option<f64>,
    /// The error that the reply states; `None` if it says that the error is not known.
    pub stated: Option<f64>,
    /// The parts of the stated error.
    pub parts: Value,
    /// The codes of the reply's warnings; of a frame that had to be in time, what was lowered.
    pub warnings: Vec<String>,
    /// The true error; `None` if the truth is not known well enough.
    pub is: Option<f64>,
    /// The error of the truth itself.
    pub known_to: Option<f64>,
}

/// The outcomes of all scenes, which several machines may have shared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Honesty {
    /// The parts, one a machine.
    pub parts: Vec<Part>,
}

/// The outcomes of one machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// The machine of the measurement.
    pub machine: Machine,
    /// The outcomes, scene by scene.
    pub scenes: Vec<Outcome>,
}

impl Honesty {
    /// All outcomes.
    pub fn scenes(&self) -> Vec<&Outcome> {
        self.parts.iter().flat_map(|part| &part.scenes).collect()
    }

    /// The figures of all scenes.
    pub fn figures(&self) -> Figures {
        Figures::of(&self.scenes())
    }

    /// Takes over the outcomes of earlier runs, but for scenes that were run again. Each part names its program and its machine.
    pub fn keep(&mut self, old: Self) {
        for mut earlier in old.parts {
            let again = |o: &Outcome| self.scenes().iter().any(|new| new.scene == o.scene);
            earlier.scenes.retain(|o| !again(o));
            match self.parts.iter_mut().find(|part| part.machine.is_same(&earlier.machine)) {
                Some(part) => part.scenes.extend(earlier.scenes),
                None => self.parts.push(earlier),
            }
        }
        self.parts.iter_mut().for_each(|part| part.scenes.sort_by_key(|o| o.scene));
        self.parts.retain(|part| !part.scenes.is_empty());
    }

    /// The outcomes as JSON, a line each.
    ///
    /// # Errors
    /// [`Error::Internal`] when a number is not one.
    pub fn lines(&self) -> Result<String> {
        let text = |scene: &Outcome| serde_json::to_string(scene).map_err(Error::internal);
        let part = |part: &Part| {
            let scenes = part.scenes.iter().map(text).collect::<Result<Vec<_>>>()?.join(",\n");
            let machine = serde_json::to_string(&part.machine).map_err(Error::internal)?;
            Ok(format!("{{\"machine\": {machine},\n\"scenes\": [\n{scenes}\n]}}"))
        };
        let parts = self.parts.iter().map(part).collect::<Result<Vec<_>>>()?;
        Ok(format!("{{\"parts\": [\n{}\n]}}\n", parts.join(",\n")))
    }
}

impl Outcome {
    fn new(number: u64, scene: &Scene, seen: Seen, judged: Option<&Judged>) -> Self {
        let image = &scene.request["image"];
        let side = |of: &str| image[of].as_u64().unwrap_or(0);
        let by_error = seen.stopped_by.as_deref() == Some("error");
        Self {
            scene: number,
            technique: scene.technique.into(),
            moment: scene.moment.name().into(),
            options: scene.options(),
            side: side("width").min(side("height")),
            samples: seen.samples,
            asked: scene.request["budget"]["max_error"].as_f64().filter(|_| by_error),
            late: None,
            stated: seen.stated,
            parts: seen.parts,
            warnings: seen.warnings,
            is: judged.map(|j| j.error),
            known_to: judged.map(|j| j.known_to),
        }
    }

    /// The stated and the true error, if both are known. A picture that is exactly the truth, as one of nothing, says nothing of stated errors.
    pub fn pair(&self) -> Option<[f64; 2]> {
        Some([self.stated?, self.is.filter(|is| *is > 0.0)?])
    }

    /// True if noise is the largest part of the stated error.
    pub fn is_noise(&self) -> bool {
        let part = |name: &str| self.parts[name].as_f64().unwrap_or(0.0);
        ["discretisation", "resolution", "truncation", "field"].iter().all(|other| part("noise") >= part(other))
    }

    /// A line for a log.
    fn words(&self) -> String {
        let number = |of: Option<f64>| of.map_or("unknown".into(), |v| format!("{v:.2e}"));
        format!(
            "honesty, scene {}, {}, {}, {}²: states {}, is {} (known to {}), {} samples",
            self.scene,
            self.technique,
            self.moment,
            self.side,
            number(self.stated),
            number(self.is),
            number(self.known_to),
            self.samples
        )
    }
}

/// Renders and judges the scenes; `told` hears of each. A quick study has small pictures.
///
/// # Errors
/// Those of the requests.
pub fn honesty(bench: &Bench, scenes: Range<u64>, quick: bool, told: &mut dyn FnMut(&str)) -> Result<Honesty> {
    let sizes = &SIZES[..if quick { QUICK_SIZES } else { SIZES.len() }];
    let mut outcomes = Vec::new();
    for number in scenes {
        let Some(scene) = scene::scene(bench, number, sizes)? else { continue };
        let found = judged(bench, number, &scene, TRUTH_MS[usize::from(!quick)]);
        forget_volume(bench, &scene.request)?;
        let found = match found {
            // The planner may refuse what each view takes by itself. No error is stated then.
            Err(Error::Invalid(why)) => {
                let why: Vec<String> = why.iter().map(|w| format!("{}: {}", w.pointer, w.detail)).collect();
                told(&format!("honesty, scene {number}, {}: refused, {}", scene.technique, why.join("; ")));
                continue;
            }
            found => found?,
        };
        told(&found.words());
        if found.pair().is_some_and(|[stated, is]| is > stated) {
            told(&format!("it states too little: {:?} {}", scene.moment, scene.request));
        }
        outcomes.push(found);
    }
    Ok(Honesty { parts: vec![Part { machine: machine(bench), scenes: outcomes }] })
}

fn judged(bench: &Bench, number: u64, scene: &Scene, truth_ms: f64) -> Result<Outcome> {
    let seen = scene.moment.of(bench, &scene.request)?;
    let judged = truth::judge(bench, &scene.truth, &seen.luminance, truth_ms)?;
    let mut outcome = Outcome::new(number, scene, seen, judged.as_ref());
    if let (Some(asked), Some(truth)) = (outcome.asked, judged) {
        outcome.late = Some(late(bench, &scene.request, outcome.samples, &truth, asked)?);
    }
    Ok(outcome)
}

/// The samples over the fewest that are within the error `asked`. Fewer and fewer are tried.
fn late(bench: &Bench, request: &Value, samples: u64, truth: &Judged, asked: f64) -> Result<f64> {
    let (mut request, mut fewest) = (request.clone(), samples);
    while fewest > 1 {
        let fewer = ((fewest as f64 / FEWER) as u64).max(1);
        request["budget"] = json!({ "samples": fewer });
        if truth.of(&bench.run(&request, Reads::Luminance)?.values)? > asked {
            break;
        }
        fewest = fewer;
    }
    Ok(samples as f64 / fewest as f64)
}

/// Deletes the volume that was stored for a scene.
fn forget_volume(bench: &Bench, request: &Value) -> Result<()> {
    match request["volume"]["id"].as_str() {
        Some(id) => bench.assets().volumes().delete(id),
        None => Ok(()),
    }
}
