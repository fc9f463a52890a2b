//! Light scattered once in a medium that scatters often. The light that a slab sends back lacks all that was scattered again.

use serde_json::{Value, json};

use super::{Experiment, mean, sample};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::{Bench, Reads};
use crate::study::cases::scattering::{request, slab};
use crate::study::verdict::{Findings, HeatMap, Sample, Sweep};
use crate::technique::slab::reflected;

/// The experiment's entry in the list.
pub const EXPERIMENT: Experiment = Experiment {
    name: "single_scattering",
    title: "Light scattered once, in slabs of rising depth",
    codes: &["multiple_scattering_missing"],
    expected: "short of the whole by what was scattered again, and says so; the whole path is not short of anything",
    run,
};

/// The number of cells of the host's integral equation.
const CELLS: usize = 300;
/// The part of the light that a picture may lack without a warning.
const PERMITTED: f64 = 0.01;

/// The light of a slab that a technique sees with `followed` scatterings, over all of its light.
fn seen(bench: &Bench, volume: &Value, slab: [f64; 2], followed: Option<u32>, samples: u64) -> Result<Sample> {
    let [depth, albedo] = slab;
    let (technique, more) = match followed {
        Some(1) => ("single_scatter", json!({})),
        followed => ("volume_path", json!({"max_scatterings": followed})),
    };
    // Thin slabs need more samples, since few of them meet anything.
    let samples = (samples as f64 * (0.3 / depth).clamp(1.0, 16.0)) as u64;
    let run = bench.run(&request(technique, volume, slab, samples, &more), Reads::Luminance)?;
    let whole = reflected(depth, albedo, None, CELLS).radiance;
    let mut sample = sample(&run, depth, mean(&run.values).map(|v| v / whole), 1.0);
    sample.predicted = Some(reflected(depth, albedo, followed, CELLS).radiance / whole);
    sample.permitted = PERMITTED;
    Ok(sample)
}

fn run(bench: &Bench, scale: Scale) -> Result<Findings> {
    let volume = slab(bench)?;
    let samples = scale.pick(64, 1024);
    let mut sweeps = Vec::new();
    for (method, followed) in [
        ("single_scatter", Some(1)),
        ("volume_path, at most 2 scatterings", Some(2)),
        ("volume_path, at most 8 scatterings", Some(8)),
        ("volume_path", None),
    ] {
        let depths = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
        let found = depths.into_iter().map(|depth| seen(bench, &volume, [depth, 0.9], followed, samples));
        sweeps.push(Sweep { method: method.into(), tolerance: 2e-3, samples: found.collect::<Result<_>>()? });
    }
    let (depths, albedos) = (vec![0.01, 0.1, 0.5, 1.0, 4.0], vec![0.1, 0.5, 0.8, 0.95, 1.0]);
    let row = |albedo: &f64| -> Result<Vec<Sample>> {
        depths.iter().map(|depth| seen(bench, &volume, [*depth, *albedo], Some(1), samples)).collect()
    };
    let heat_map = HeatMap {
        title: "What single scattering lacks".into(),
        tolerance: 2e-3,
        axes: ["optical depth".into(), "albedo".into()],
        samples: albedos.iter().map(row).collect::<Result<_>>()?,
        across: depths,
        up: albedos,
    };
    Ok(Findings {
        of: "optical depth".into(),
        quantity: "radiance back along the beam, over the whole".into(),
        sweeps,
        heat_map: Some(heat_map),
    })
}
