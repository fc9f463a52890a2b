//! Optical depths up to 200. The transmittance is e^(−τ) or nothing, never NaN. Without absorption nothing goes dark.

use serde_json::{Value, json};

use super::{Experiment, absorbing_layer, mean, photons, sample};
use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::verdict::{Findings, Sample, Sweep};
use crate::study::{Scale, view};

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "optical_depth",
    title: "Optical depth up to 200",
    codes: &[],
    expected: "no NaN, no black pixel",
    run,
};

const DEPTHS: [f64; 6] = [1.0, 5.0, 20.0, 60.0, 100.0, 200.0];

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let mut sweeps = Vec::new();
    let count = scale.pick(100_000, 4_000_000);
    for tracking in ["exact", "delta", "weighted"] {
        let of = |depth: f64| -> Result<Sample> {
            let parameters =
                json!({"photons": count, "grid": [1, 1, 1], "layers": [absorbing_layer(depth)], "tracking": tracking});
            let run = photons(bench, &parameters)?;
            let truth = (-depth).exp();
            let [measured, error] = run.fraction("exit_plus_z");
            // With so few photons that none gets through, the measured spread is not known; it is a binomial's.
            Ok(sample(&run, depth, [measured, error.max((truth / f64::from(count)).sqrt())], truth))
        };
        sweeps.push(sweep(&format!("photon_transport, {tracking}: transmittance"), of)?);
    }
    let constant = json!({"builtin": "constant", "resolution": 16});
    let camera =
        json!({"eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 1, "projection": "orthographic"});
    sweeps.push(sweep("emission_absorption: transmittance", |depth| {
        let ends = [0, 1].map(|v| json!({"value": v, "color": [1, 1, 1], "opacity_per_unit": depth / 2.0}));
        let own = json!({"transfer_function": {"points": ends}, "jitter": false, "opacity_threshold": 1});
        let run = bench.run(&view("emission_absorption", &constant, &camera, 16, 1, &own), Reads::Transmittance)?;
        let mut sample = sample(&run, depth, [mean(&run.values)[0], 0.0], (-depth).exp());
        // The bound is for 1 − alpha: the device's exponentials are good to a few 1e-5, a hundredth of a grey level.
        sample.permitted = 5e-5;
        Ok(sample)
    })?);
    let path = |depth: f64, albedo: f64, tracking: &str, samples: u64| -> Value {
        let own = json!({"medium": {"sigma_t_per_unit": depth / 2.0, "albedo": albedo, "phase": {"type": "isotropic"}},
            "lights": [{"type": "sky", "radiance": 1}], "tracking": tracking});
        view("volume_path", &constant, &camera, 16, samples, &own)
    };
    for tracking in ["auto", "delta", "weighted"] {
        sweeps.push(sweep(&format!("volume_path, {tracking}: albedo 1 under an even sky"), |depth| {
            let run = bench.run(&path(depth, 1.0, tracking, scale.pick(16, 256)), Reads::Luminance)?;
            Ok(sample(&run, depth, mean(&run.values), 1.0))
        })?);
    }
    sweeps.push(sweep("volume_path: pixels that are black or not a number, at albedo 0.99", |depth| {
        let run = bench.run(&path(depth, 0.99, "auto", scale.pick(32, 256)), Reads::Luminance)?;
        let black = run.values.iter().filter(|v| !(v.is_finite() && **v > 0.0)).count();
        Ok(sample(&run, depth, [black as f64 / run.values.len() as f64, 0.0], 0.0))
    })?);
    Ok(Findings { of: "optical depth".into(), quantity: "the part that is left".into(), sweeps, heat_map: None })
}

fn sweep(method: &str, of: impl Fn(f64) -> Result<Sample>) -> Result<Sweep> {
    let samples = DEPTHS.into_iter().map(of).collect::<Result<Vec<_>>>()?;
    Ok(Sweep { method: method.into(), tolerance: 0.0, samples })
}
