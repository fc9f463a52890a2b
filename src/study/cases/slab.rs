//! The slab P1 by every tracker.

use serde_json::json;

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::{Case, Scale, Setting, Trial, Truth, simulation};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "slab",
    title: "Photons through a slab that scatters forward, by every tracker",
    when: "layers that scatter forward",
    choose: "`photon_transport` as it is; never `march`: half its error costs twice its time",
    trial,
};

const READS: Reads = Reads::Ledger(&["exit_minus_z", "exit_plus_z", "unscattered_plus_z"]);

fn trial(_: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let layer = json!({"thickness_mm": 0.2, "mu_a_per_mm": 1, "mu_s_per_mm": 9, "index": 1,
        "phase": {"type": "henyey_greenstein", "g": 0.75}});
    let of = |photons: f64, tracking: &str, step: f64| {
        simulation(&json!({"photons": photons as u64, "grid": [1, 1, 1], "layers": [layer], "tracking": tracking,
            "march_step_mm": step}))
    };
    let most = scale.pick(1e6, 1e7);
    let mut settings = Vec::new();
    for tracking in ["exact", "delta", "weighted"] {
        for photons in [1e3, 1e4, 1e5, 1e6, 1e7].into_iter().filter(|n| *n <= most) {
            let request = of(photons, tracking, 0.01);
            settings.push(Setting::random(tracking, "photons", photons, request).reading(READS));
        }
    }
    for step in [0.1, 0.05, 0.025, 0.0125, 0.00625] {
        let line = Setting::random("march", "step / mm", step, of(most, "march", step)).reading(READS);
        settings.push(Setting { expected_slope: Some(1.0), ..line });
    }
    let truth = Truth {
        words: "van de Hulst (1980): diffuse reflectance 0.0973946, transmittance 0.6609577, unscattered 0.135335"
            .into(),
        values: vec![0.097_394_6, 0.660_957_7, (-2f64).exp()],
        centres: None,
        size: None,
        known_to: 1e-7,
    };
    Ok(Ok(Trial { truth, settings }))
}
