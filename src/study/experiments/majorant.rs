//! A majorant that is not one. Delta tracking with M < σ lets e^(−Md) through in place of e^(−σd); weights make up for it.

use serde_json::json;

use super::{Experiment, absorbing_layer, photons, sample};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::verdict::{Findings, HeatMap, Sweep};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "majorant",
    title: "A majorant below or above the extinction",
    codes: &["broken_majorant"],
    expected: "below 1 biased and flagged; above 1 unbiased, at a rising cost",
    run,
};

/// The optical depth.
const DEPTH: f64 = 2.0;

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let count = scale.pick(100_000, 4_000_000);
    let mut sweeps = Vec::new();
    for (tracking, name) in [("delta", "unscattered_plus_z"), ("weighted", "exit_plus_z")] {
        let mut samples = Vec::new();
        for ratio in [0.25, 0.5, 0.75, 1.0, 2.0, 4.0, 16.0f64] {
            let parameters = json!({"photons": count, "grid": [1, 1, 1], "layers": [absorbing_layer(DEPTH)], "tracking": tracking,
                "majorant": {"scale": ratio}});
            let run = photons(bench, &parameters)?;
            let mut sample = sample(&run, ratio, run.fraction(name), (-DEPTH).exp());
            let met = if tracking == "delta" { ratio.min(1.0) } else { 1.0 };
            sample.predicted = Some((-DEPTH * met).exp());
            samples.push(sample);
        }
        sweeps.push(Sweep { method: format!("{tracking} tracking"), tolerance: 1e-5, samples });
    }
    Ok(Findings {
        of: "majorant / extinction".into(),
        quantity: "transmittance".into(),
        sweeps,
        heat_map: Some(contrast(bench, count)?),
    })
}

/// Two halves of densities 1 and c, together of [`DEPTH`], under one majorant for both.
fn contrast(bench: &Bench, count: u32) -> Result<HeatMap> {
    let ratios = vec![0.1, 0.25, 0.5, 0.75, 1.0, 2.0];
    let contrasts = vec![1.0, 2.0, 4.0, 16.0, 64.0];
    let mut rows = Vec::new();
    for contrast in &contrasts {
        let thin = 2.0 * DEPTH / (1.0 + contrast) / 2.0;
        let density = bench.floats([1, 1, 2], [2.0; 3], |p| if p[2] < 0.0 { 1.0 } else { *contrast })?;
        let medium = json!({"mu_a_per_mm": thin, "mu_s_per_mm": 0, "index": 1});
        let mut row = Vec::new();
        for ratio in &ratios {
            let parameters = json!({"photons": count, "density": density, "size_mm": [2, 2, 2], "medium": medium, "tracking": "delta",
                "majorant": {"scale": ratio, "grid": "global"}, "source": {"type": "pencil", "position_mm": [1, 1, 0]}});
            let run = photons(bench, &parameters)?;
            let mut sample = sample(&run, *ratio, run.fraction("unscattered_plus_z"), (-DEPTH).exp());
            let most = ratio * contrast;
            sample.predicted = Some((-thin * (most.min(1.0) + most.min(*contrast))).exp());
            row.push(sample);
        }
        rows.push(row);
    }
    Ok(HeatMap {
        title: "Delta tracking's transmittance".into(),
        tolerance: 1e-5,
        axes: ["majorant / greatest extinction".into(), "density contrast".into()],
        across: ratios,
        up: contrasts,
        samples: rows,
    })
}
