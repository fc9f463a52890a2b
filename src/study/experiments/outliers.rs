//! Density in hardly any of the room: one voxel, or a thin shell. Every tracker must find it; majorants of the whole cost the most.

use glam::DVec3;
use serde_json::json;

use super::{Experiment, photons, sample, with};
use crate::error::Result;
use crate::study::Scale;
use crate::study::bench::Bench;
use crate::study::oracle::{Grid, Medium, means};
use crate::study::verdict::{Findings, Sweep};

/// One voxel's entry in the list.
pub const VOXEL: Experiment = Experiment {
    name: "outlier_voxel",
    title: "One voxel of great density",
    codes: &[],
    expected: "means equal for all trackers; a majorant of the whole is slow, local ones are not",
    run: |b, s| run(b, s, |p, value| if p.abs().max_element() < 0.08 { value } else { 0.3 }),
};
/// The shell's entry in the list.
pub const SHELL: Experiment = Experiment {
    name: "thin_shell",
    title: "A thin shell of great density in a vacuum",
    codes: &[],
    expected: "means equal for all trackers; a majorant of the whole is slow, local ones are not",
    run: |b, s| run(b, s, |p, value| if (0.6..0.68).contains(&p.length()) { value } else { 0.0 }),
};

const SIDE: usize = 25;
const ALBEDO: f64 = 0.7;

fn run(bench: &Bench, scale: Scale, density: fn(DVec3, f64) -> f64) -> Result<Findings> {
    let count = scale.pick(100_000, 2_000_000);
    let values = scale.pick(vec![1.0, 30.0, 300.0], vec![1.0, 10.0, 100.0, 1000.0]);
    let methods = [
        ("exact", json!({"tracking": "exact"})),
        ("delta, local majorants", json!({"tracking": "delta"})),
        ("delta, one majorant", json!({"tracking": "delta", "majorant": {"grid": "global"}})),
        ("weighted", json!({"tracking": "weighted"})),
    ];
    let mut sweeps =
        methods.each_ref().map(|(name, _)| Sweep { method: (*name).into(), tolerance: 0.0, samples: Vec::new() });
    for value in values {
        let extinction = Grid::of([SIDE; 3], DVec3::ONE, |p| density(p, value));
        let medium = Medium { extinction, albedo: ALBEDO, g: 0.5 };
        let found = means(5 * count as usize, 11, |random| medium.photon(random, DVec3::new(0.0, 0.0, -0.1)));
        let volume = bench.floats([SIDE; 3], [2.0; 3], |p| density(DVec3::from(p), value))?;
        let scene = json!({"photons": count, "density": volume, "size_mm": [2, 2, 2],
            "medium": {"mu_a_per_mm": 1.0 - ALBEDO, "mu_s_per_mm": ALBEDO, "index": 1, "phase": {"type": "henyey_greenstein", "g": 0.5}},
            "source": {"type": "isotropic", "position_mm": [1, 1, 0.9]}});
        for (sweep, (_, more)) in sweeps.iter_mut().zip(&methods) {
            let run = photons(bench, &with(&scene, more))?;
            let [measured, error] = run.fraction("absorbed");
            let mut sample = sample(&run, value, [measured, error.hypot(found[6][1])], found[6][0]);
            sample.predicted = Some(found[6][0]);
            sweep.samples.push(sample);
        }
    }
    Ok(Findings {
        of: "extinction of what is dense, per mm".into(),
        quantity: "absorbed".into(),
        sweeps: sweeps.into(),
        heat_map: None,
    })
}
