//! The calibration of this device: the ratio of a sample's cost among its neighbours to its cost in a pilot, and the cost of a render
//! besides its samples. It is measured once, in less than three seconds, and kept in the data folder.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tokio::sync::OnceCell;

use super::{Planner, run};
use crate::error::Result;
use crate::render::region::Region;
use crate::technique::{self, Kind};

/// The side of the picture, the stride of its pilot, and the samples of both.
const LARGE: u32 = 256;
const STRIDE: u32 = 4;
const SAMPLES: u32 = 12;
/// The pixels of the pilot and of the whole picture. Between them the factor is interpolated.
const PIXELS: [f64; 2] = [((LARGE / STRIDE) * (LARGE / STRIDE)) as f64, (LARGE * LARGE) as f64];

/// Factors of a device.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The device with its driver, and this program's version. Another one is calibrated anew.
    of: String,
    /// The factors by technique.
    factors: BTreeMap<String, Factors>,
}

/// The factors of one technique.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Factors {
    /// The time of a sample in the whole picture over that in the pilot.
    large_over_pilot: f64,
    /// The cost of a render besides its samples, in samples: previews, and slices that are short until the kernel's speed is known.
    besides: f64,
}

impl Calibration {
    fn of(&self, technique: &str) -> Factors {
        let known = |name: &str| self.factors.get(name).copied();
        known(technique)
            .or_else(|| known(technique::ALL[0].name))
            .unwrap_or(Factors { large_over_pilot: 1.0, besides: 0.0 })
    }

    /// The ratio of a sample's time in a picture of `pixels` pixels to its time in a pilot.
    pub fn factor(&self, technique: &str, pixels: f64) -> f64 {
        let part = (pixels / PIXELS[0]).ln() / (PIXELS[1] / PIXELS[0]).ln();
        self.of(technique).large_over_pilot.powf(part.clamp(0.0, 1.0))
    }

    /// The cost of a render besides its samples, in samples.
    pub fn besides(&self, technique: &str) -> f64 {
        self.of(technique).besides
    }
}

/// The calibration, made once it is needed or asked for.
#[derive(Debug)]
pub struct Calibrations {
    file: PathBuf,
    known: OnceCell<Calibration>,
}

impl Calibrations {
    /// A calibration that is kept in this folder.
    pub fn kept_in(folder: &std::path::Path) -> Self {
        Self { file: folder.join("calibration.json"), known: OnceCell::new() }
    }

    /// The device's calibration, from the file or measured now.
    ///
    /// # Errors
    /// The error of a render that fails.
    pub(super) async fn of(&self, planner: &Planner<'_>) -> Result<Calibration> {
        self.known.get_or_try_init(|| self.read_or_measure(planner)).await.cloned()
    }

    async fn read_or_measure(&self, planner: &Planner<'_>) -> Result<Calibration> {
        let info = planner.engine.ready().await?;
        let of = format!("{}, {}, {} lanes, {}", info.device, info.driver, info.lanes, env!("CARGO_PKG_VERSION"));
        let kept = std::fs::read(&self.file).ok().and_then(|bytes| serde_json::from_slice::<Calibration>(&bytes).ok());
        if let Some(kept) = kept.filter(|k| k.of == of) {
            return Ok(kept);
        }
        let started = std::time::Instant::now();
        let mut factors = BTreeMap::new();
        for technique in technique::views() {
            if let Kind::View { calibration: Some(scene), .. } = technique.kind {
                factors.insert(technique.name.to_owned(), measure(planner, technique.name, scene()).await?);
            }
        }
        tracing::info!(ms = started.elapsed().as_millis() as u64, "the device is calibrated");
        let found = Calibration { of, factors };
        // A calibration that cannot be kept is measured again next time.
        if let Err(error) =
            serde_json::to_vec_pretty(&found).map_err(std::io::Error::from).and_then(|t| std::fs::write(&self.file, t))
        {
            tracing::warn!(%error, "the calibration is not kept");
        }
        Ok(found)
    }
}

/// The factors of a technique, on the scene of its own choice.
async fn measure(planner: &Planner<'_>, technique: &str, mut request: Value) -> Result<Factors> {
    request["technique"] = json!(technique);
    request["image"] = json!({"width": LARGE, "height": LARGE});
    let scene = planner.scene(&request)?;
    let time = async |stride: u32| -> Result<[f64; 2]> {
        let mut least = [f64::INFINITY; 2];
        for seed in 0..4 {
            let pilot = scene.clone().with_seed(seed).into_pilot(Region::every(stride, [LARGE, LARGE]), SAMPLES);
            let run = run::finish(planner, pilot).await?;
            least = [least[0].min(run.ms[0]), least[1].min(run.ms[1] / run.pixels as f64)];
        }
        Ok(least)
    };
    let ([_, sparse], [besides, dense]) = (time(STRIDE).await?, time(1).await?);
    let known = sparse > 0.0 && dense > 0.0;
    Ok(Factors {
        large_over_pilot: if known { (dense / sparse).clamp(0.1, 10.0) } else { 1.0 },
        besides: if known { (besides / (dense * f64::from(LARGE * LARGE))).clamp(0.0, 10.0) } else { 0.0 },
    })
}
