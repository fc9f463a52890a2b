//! The lecture's chamber: the places where the photons of a lamp in a foggy room end, by every tracker.

use glam::{DVec3, dvec3};
use serde_json::json;

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::{Grid, Medium, means};
use crate::study::{Case, Scale, Setting, Trial, Truth, simulation};
use crate::technique::photon_transport::FRACTIONS;
use crate::volume::builtin::chamber_value;

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "chamber",
    title: "Where the photons of the chamber end, by every tracker",
    when: "a room with fog, and want to know where light ends",
    choose: "`photon_transport` as it is (`exact` in voxels); a march is wrong by a third even at short steps",
    trial,
};

/// The fractions at the six faces, and the absorbed fraction.
const NAMES: &[&str] = FRACTIONS.split_at(7).0;
const ALBEDO: f64 = 0.9;
const GRID: usize = 32;

fn trial(_: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let most = scale.pick(1e6, 1e7);
    let mut settings = Vec::new();
    let of = |photons: f64, tracking: &str, step: f64| {
        simulation(
            &json!({"photons": photons as u64, "grid": [GRID, GRID, GRID], "albedo": ALBEDO, "tracking": tracking,
            "march_step_mm": step}),
        )
    };
    for tracking in ["auto", "exact", "delta", "weighted"] {
        for photons in [1e3, 1e4, 1e5, 1e6, 1e7].into_iter().filter(|n| *n <= most) {
            let request = of(photons, tracking, 0.1);
            settings.push(Setting::random(tracking, "photons", photons, request).reading(Reads::Ledger(NAMES)));
        }
    }
    for step in [0.1, 0.05, 0.025, 0.0125] {
        let line = Setting::random("march", "step / mm", step, of(1e6, "march", step));
        settings.push(Setting { expected_slope: Some(1.0), ..line.reading(Reads::Ledger(NAMES)) });
    }
    let photons = scale.pick(1_000_000, 20_000_000);
    let extinction = Grid::of([GRID; 3], DVec3::splat(0.5), |p| chamber_value(p.x + 0.5, p.y + 0.5, p.z + 0.5));
    let medium = Medium { extinction, albedo: ALBEDO, g: 0.0 };
    let found = means(photons, 1, |random| medium.photon(random, dvec3(0.0, 0.4, 0.0)));
    let truth = Truth {
        words: format!(
            "{photons} photons of the host in double precision, from cell to cell, with other random numbers"
        ),
        values: found.map(|f| f[0]).to_vec(),
        centres: None,
        size: None,
        known_to: 7.0 * found.iter().map(|f| f[1].powi(2) / 7.0).sum::<f64>().sqrt(),
    };
    Ok(Ok(Trial { truth, settings }))
}
