//! A check that stated errors keep their word: random scenes over every view and option, each rendered once and compared with a truth by another
//! path.

mod page;
pub mod scene;
pub mod truth;

use std::ops::Range;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::bench::{Bench, Reads};
use super::machine;
use super::record::Machine;
use crate::error::{Error, Result};

/// The sides of pictures, pixels; a quick study has the first few.
const SIZES: [u32; 9] = [16, 24, 32, 48, 64, 96, 128, 256, 512];
/// The device time for a scene's truth, ms.
const TRUTH_MS: f64 = 20_000.0;

/// The outcome of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// The number of the scene.
    pub scene: u64,
    /// The view, or `auto`.
    pub technique: String,
    /// The request.
    pub request: Value,
    /// The request that gave the truth, without its size and budget.
    pub truth: Value,
    /// The samples of the picture.
    pub samples: u64,
    /// The reason for which it stopped.
    pub stopped_by: Option<String>,
    /// The error that the reply states; `None` if it says that the error is not known.
    pub stated: Option<f64>,
    /// The parts of the stated error.
    pub parts: Value,
    /// The codes of the reply's warnings.
    pub warnings: Vec<String>,
    /// The true error; `None` if the truth is not known well enough.
    pub is: Option<f64>,
    /// The error of the truth itself.
    pub known_to: Option<f64>,
}

/// The outcomes of all scenes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Honesty {
    /// The machine of the measurement.
    pub machine: Machine,
    /// The outcomes, scene by scene.
    pub scenes: Vec<Outcome>,
}

impl Outcome {
    /// The stated and the true error, if both are known. A picture that is exactly the truth, as one of nothing, says nothing of stated errors.
    pub fn pair(&self) -> Option<[f64; 2]> {
        Some([self.stated?, self.is.filter(|is| *is > 0.0)?])
    }

    /// The error asked for, if the render stopped because it had reached it.
    pub fn asked(&self) -> Option<f64> {
        let asked = self.request["budget"]["max_error"].as_f64();
        asked.filter(|_| self.stopped_by.as_deref() == Some("error"))
    }

    /// True if noise is the largest part of the stated error.
    pub fn is_noise(&self) -> bool {
        let part = |name: &str| self.parts[name].as_f64().unwrap_or(0.0);
        ["discretisation", "resolution", "truncation", "field"].iter().all(|other| part("noise") >= part(other))
    }

    /// The lesser side of the picture, pixels.
    pub fn side(&self) -> u64 {
        let side = |of: &str| self.request["image"][of].as_u64().unwrap_or(0);
        side("width").min(side("height"))
    }
}

/// Renders and judges the scenes; `told` hears of each. A quick study has small pictures.
///
/// # Errors
/// Those of the requests.
pub fn honesty(bench: &Bench, scenes: Range<u64>, quick: bool, told: &mut dyn FnMut(&str)) -> Result<Honesty> {
    let sizes = &SIZES[..if quick { 4 } else { SIZES.len() }];
    let mut outcomes = Vec::new();
    for number in scenes {
        let Some(scene) = scene::scene(bench, number, sizes)? else { continue };
        let found = outcome(bench, number, &scene);
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
        told(&format!(
            "honesty, scene {number}, {}: states {:.4?}, is {:.4?} (known to {:.1e}), {} samples, {}",
            found.technique,
            found.stated,
            found.is,
            found.known_to.unwrap_or(f64::NAN),
            found.samples,
            found.stopped_by.as_deref().unwrap_or_default(),
        ));
        outcomes.push(found);
    }
    Ok(Honesty { machine: machine(bench), scenes: outcomes })
}

fn outcome(bench: &Bench, number: u64, scene: &scene::Scene) -> Result<Outcome> {
    let run = bench.run(&scene.request, Reads::Luminance)?;
    let judged = truth::judge(bench, &scene.truth, &run.values, TRUTH_MS)?;
    Ok(Outcome {
        scene: number,
        technique: scene.technique.into(),
        request: scene.request.clone(),
        truth: scene.truth.clone(),
        samples: run.samples,
        stopped_by: run.reply["stopped_by"].as_str().map(str::to_owned),
        stated: run.reply["error"].as_f64(),
        parts: run.reply["error_parts"].clone(),
        warnings: run.codes(),
        is: judged.map(|j| j.error),
        known_to: judged.map(|j| j.known_to),
    })
}

/// Deletes the volume that was stored for a scene.
fn forget_volume(bench: &Bench, request: &Value) -> Result<()> {
    match request["volume"]["id"].as_str() {
        Some(id) => bench.assets().volumes().delete(id),
        None => Ok(()),
    }
}
