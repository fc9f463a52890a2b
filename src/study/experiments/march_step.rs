//! The step of a ray march of photons. Its free paths are whole steps, so the mean free path is h / (1 − e^(−h)) for a step of the optical
//! depth h. The error of a slab's transmittance (P1) is about linear in the step.

use serde_json::json;

use super::{Experiment, absorbing_layer, photons, sample};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::verdict::{Findings, Sweep};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "march_step",
    title: "The step of a photon march",
    codes: &["march_bias"],
    expected: "error about linear in the step; exact, delta and weighted tracking flat",
    run,
};

/// The total transmittance of P1 (van de Hulst), at 10 per mm.
const TRANSMITTANCE: f64 = 0.660_957_7;
const EXTINCTION_PER_MM: f64 = 10.0;

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let count = scale.pick(100_000, 2_000_000);
    let steps = [0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0f64];
    let mut free_paths = Vec::new();
    for h in steps {
        let parameters = json!({"photons": count, "grid": [1, 1, 1], "layers": [absorbing_layer(60.0)], "tracking": "march",
            "march_step_mm": h});
        let run = photons(bench, &parameters)?;
        let measured = run.reply["result"]["mean_path_mm"].as_f64().unwrap_or(f64::NAN);
        // Free paths are exponential: their deviation is about their mean.
        let mut sample = sample(&run, h, [measured, measured / f64::from(count).sqrt()], 1.0);
        sample.predicted = Some(h / -(-h).exp_m1());
        free_paths.push(sample);
    }
    let mut sweeps = vec![Sweep { method: "march: the mean free path".into(), tolerance: 1e-4, samples: free_paths }];
    let layer = json!({"thickness_mm": 0.2, "mu_a_per_mm": 1, "mu_s_per_mm": 9, "index": 1,
        "phase": {"type": "henyey_greenstein", "g": 0.75}});
    for tracking in ["march", "exact", "delta", "weighted"] {
        let mut samples = Vec::new();
        for h in steps {
            let parameters = json!({"photons": count, "grid": [1, 1, 1], "layers": [layer], "tracking": tracking,
                "march_step_mm": h / EXTINCTION_PER_MM});
            let run = photons(bench, &parameters)?;
            samples.push(sample(&run, h, run.fraction("exit_plus_z").map(|v| v / TRANSMITTANCE), 1.0));
        }
        let method = format!("{tracking}: transmittance of P1");
        sweeps.push(Sweep { method, tolerance: 0.0, samples });
    }
    Ok(Findings { of: "step / mean free path".into(), quantity: "measured over true".into(), sweeps, heat_map: None })
}
