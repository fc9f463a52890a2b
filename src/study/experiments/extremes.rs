//! Media and sources at the ends of the permitted ranges. The energy ledger must close in every case.

use serde_json::{Value, json};

use super::{Experiment, photons, sample};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::verdict::{Findings, Sweep};
use crate::technique::photon_transport::FRACTIONS;

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "extremes",
    title: "The ends of what is permitted: 1 no absorption, 2 no scattering, 3 nothing at all, 4 g = 0.999, 5 g = −0.999, 6 g = 0, \
        7 albedo 1 at depth 200, 8 index 3, 9 a start on a face, 10 on an edge, 11 in a corner, 12 along an axis on a wall between voxels",
    codes: &[],
    expected: "finite, the energy ledger closes to 1e-6",
    run,
};

fn scenes() -> Vec<Value> {
    let scene = |medium: [f64; 2], g: f64, index: f64, at: [f64; 3], source: &str| {
        json!({"size_mm": [2, 2, 2], "grid": [8, 8, 8], "boundary": if index > 1.0 { json!({"fresnel": true}) } else { json!({}) },
            "medium": {"mu_a_per_mm": medium[0], "mu_s_per_mm": medium[1], "index": index, "phase": {"type": "henyey_greenstein", "g": g}},
            "source": {"type": source, "position_mm": at}})
    };
    let middle = [1.0, 1.0, 0.9];
    let isotropic = |medium: [f64; 2], g: f64| scene(medium, g, 1.0, middle, "isotropic");
    vec![
        isotropic([0.0, 1.0], 0.5),
        isotropic([1.0, 0.0], 0.5),
        isotropic([0.0, 0.0], 0.0),
        isotropic([0.1, 5.0], 0.999),
        isotropic([0.1, 5.0], -0.999),
        isotropic([0.1, 5.0], 0.0),
        isotropic([0.0, 100.0], 0.0),
        scene([0.1, 2.0], 0.0, 3.0, middle, "isotropic"),
        scene([0.1, 2.0], 0.5, 1.0, [1.0, 1.0, 0.0], "isotropic"),
        scene([0.1, 2.0], 0.5, 1.0, [0.0, 1.0, 0.0], "isotropic"),
        scene([0.1, 2.0], 0.5, 1.0, [0.0, 0.0, 0.0], "isotropic"),
        scene([0.1, 2.0], 0.5, 1.0, [1.0, 1.0, 0.0], "pencil"),
    ]
}

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let count = scale.pick(20_000, 500_000);
    let mut sweeps = Vec::new();
    for tracking in ["auto", "exact", "delta", "weighted"] {
        let mut samples = Vec::new();
        for (i, scene) in scenes().into_iter().enumerate() {
            let mut scene = scene;
            scene["photons"] = json!(count);
            scene["tracking"] = json!(tracking);
            let run = photons(bench, &scene)?;
            let sum: f64 = FRACTIONS[..10].iter().map(|name| run.fraction(name)[0]).sum();
            let mut sample = sample(&run, (i + 1) as f64, [1e6 * (sum - 1.0).abs(), 0.0], 0.0);
            sample.permitted = 1.0;
            samples.push(sample);
        }
        sweeps.push(Sweep { method: tracking.into(), tolerance: 0.0, samples });
    }
    Ok(Findings { of: "scene".into(), quantity: "what the ledger lacks, millionths".into(), sweeps, heat_map: None })
}
