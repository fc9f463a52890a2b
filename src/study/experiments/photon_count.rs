//! More photons. The error of P1's transmittance must go on falling as their root; with sums in single precision it would stand still.

use serde_json::json;

use super::{Experiment, photons, sample};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::verdict::{Findings, Sweep};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "photon_count",
    title: "More photons",
    codes: &[],
    expected: "the error falls as N^(−1/2) with no floor",
    run,
};

/// The total transmittance of P1 (van de Hulst).
const TRANSMITTANCE: f64 = 0.660_957_7;

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let layer = json!({"thickness_mm": 0.2, "mu_a_per_mm": 1, "mu_s_per_mm": 9, "index": 1,
        "phase": {"type": "henyey_greenstein", "g": 0.75}});
    let most = scale.pick(1e7, 1e9);
    let mut samples = Vec::new();
    for count in [1e4, 1e5, 1e6, 1e7, 1e8, 1e9].into_iter().filter(|n| *n <= most) {
        let runs = if count > 1e7 { 4 } else { 8 };
        let (mut squares, mut stated, mut last) = (0.0, 0.0, None);
        for seed in 0..runs {
            let run =
                photons(bench, &json!({"photons": count as u64, "seed": seed, "grid": [1, 1, 1], "layers": [layer]}))?;
            let [value, error] = run.fraction("exit_plus_z");
            squares += (value - TRANSMITTANCE).powi(2) / f64::from(runs);
            stated += error / f64::from(runs);
            last = Some(run);
        }
        if let Some(run) = last {
            // A root mean square of n normal errors has a relative deviation of 1 / √2n.
            let [rms, truth] = [squares.sqrt(), stated].map(|v| v / TRANSMITTANCE);
            let mut sample = sample(&run, count, [rms, truth / f64::from(2 * runs).sqrt()], truth);
            sample.predicted = Some(
                samples
                    .first()
                    .map_or(truth, |first: &crate::study::verdict::Sample| first.truth * (first.at / count).sqrt()),
            );
            samples.push(sample);
        }
    }
    let sweeps = vec![Sweep { method: "photon_transport".into(), tolerance: 0.1, samples }];
    Ok(Findings {
        of: "photons".into(),
        quantity: "RMS error of P1's transmittance, relative".into(),
        sweeps,
        heat_map: None,
    })
}
