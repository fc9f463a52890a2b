//! A box of one medium, and the same box as a grid of equal densities or of equal labels.

use glam::DVec3;
use serde_json::json;

use super::{Experiment, photons, sample, with};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::oracle::{Grid, Medium, means};
use crate::study::verdict::{Findings, Sweep};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "constant_grid",
    title: "A box of one medium against a constant grid",
    codes: &[],
    expected: "equal within noise",
    run,
};

const ALBEDO: f64 = 0.8;

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let count = scale.pick(100_000, 2_000_000);
    let medium = |sigma: f64| {
        json!({"mu_a_per_mm": (1.0 - ALBEDO) * sigma, "mu_s_per_mm": ALBEDO * sigma, "index": 1,
            "phase": {"type": "henyey_greenstein", "g": 0.3}})
    };
    let constant = json!({"builtin": "constant", "resolution": 16});
    let zeros = bench.floats([12, 10, 8], [2.0; 3], |_| 0.0)?;
    let methods = ["one medium", "a grid, delta", "a grid, exact", "labels, delta", "labels, exact"];
    let mut sweeps = methods.map(|name| Sweep { method: name.into(), tolerance: 0.0, samples: Vec::new() });
    for sigma in [0.25, 1.0, 4.0, 16.0] {
        let extinction = Grid::of([1; 3], DVec3::ONE, |_| sigma);
        let host = Medium { extinction, albedo: ALBEDO, g: 0.3 };
        let found = means(5 * count as usize, 12, |random| host.photon(random, DVec3::new(0.2, 0.1, -0.4)));
        let common = json!({"photons": count, "size_mm": [2, 2, 2], "source": {"type": "isotropic", "position_mm": [1.2, 1.1, 0.6]}});
        let said = [
            json!({"medium": medium(sigma), "grid": [16, 16, 16]}),
            json!({"medium": medium(sigma), "density": constant, "tracking": "delta"}),
            json!({"medium": medium(sigma), "density": constant, "tracking": "exact"}),
            json!({"media": [medium(sigma)], "labels": zeros, "tracking": "delta"}),
            json!({"media": [medium(sigma)], "labels": zeros, "tracking": "exact"}),
        ];
        for (sweep, more) in sweeps.iter_mut().zip(&said) {
            let run = photons(bench, &with(&common, more))?;
            let [measured, error] = run.fraction("absorbed");
            let mut sample = sample(&run, sigma, [measured, error.hypot(found[6][1])], found[6][0]);
            sample.predicted = Some(found[6][0]);
            sweep.samples.push(sample);
        }
    }
    Ok(Findings {
        of: "extinction / mm⁻¹".into(), quantity: "absorbed".into(), sweeps: sweeps.into(), heat_map: None
    })
}
