//! The result of a simulation: the ledger as fractions of the launched weight, and the counts.

use serde_json::{Map, Value, json};

use super::device::LedgerEntry;
use super::{FIXED_ONE, Simulation};
use crate::device::enums::DeviceEnum;
use crate::device::grid::NEAR_OVERFLOW;
use crate::technique::majorant::march_bias;

/// The ledger's fractions, in the order of `LedgerEntry`: the first ten add up to 1, the last two are parts of exits.
pub const FRACTIONS: [&str; 12] = [
    "exit_minus_x",
    "exit_plus_x",
    "exit_minus_y",
    "exit_plus_y",
    "exit_minus_z",
    "exit_plus_z",
    "absorbed",
    "lost",
    "specular",
    "gated",
    "unscattered_minus_z",
    "unscattered_plus_z",
];
/// The sums of the batches.
pub(super) struct Ledgers<'a> {
    batches: &'a [Vec<u64>],
    histories: u64,
}

impl<'a> Ledgers<'a> {
    pub fn new(batches: &'a [Vec<u64>], histories: u64) -> Self {
        Self { batches, histories }
    }

    fn sum(&self, entry: usize) -> i64 {
        self.batches.iter().fold(0i64, |sum, l| sum.wrapping_add(l[entry] as i64))
    }

    /// A fraction of the launched weight with the standard error of its batches.
    fn fraction(&self, entry: usize) -> Value {
        let (n, batches) = (self.histories as f64, self.batches.len() as f64);
        let mean = self.sum(entry) as f64 / FIXED_ONE / n;
        let deviation = |l: &Vec<u64>| (l[entry] as i64 as f64 / FIXED_ONE / (n / batches) - mean).powi(2);
        let variance = self.batches.iter().map(deviation).sum::<f64>() / (batches - 1.0) / batches;
        let error = if self.batches.len() > 1 { json!(variance.sqrt()) } else { Value::Null };
        json!({"value": mean, "standard_error": error})
    }
}

impl Simulation {
    pub(super) fn report(&self, ledgers: &Ledgers<'_>, grid_near_overflow: bool) -> Value {
        let n = ledgers.histories as f64;
        let fractions: Map<String, Value> =
            FRACTIONS.iter().enumerate().map(|(entry, name)| ((*name).into(), ledgers.fraction(entry))).collect();
        let overflow =
            grid_near_overflow || (0..LedgerEntry::LENGTH).any(|e| ledgers.sum(e).unsigned_abs() > NEAR_OVERFLOW);
        let mut warnings = Vec::new();
        let mut warn = |code: &str, measured: f64, message: &str| {
            if measured > 0.0 {
                warnings.push(json!({"code": code, "message": message, "measured": measured, "bound": 0}));
            }
        };
        warn("broken_majorant", ledgers.sum(LedgerEntry::Broken as usize) as f64, self.broken_words());
        warn(
            "photon_faults",
            ledgers.sum(LedgerEntry::Faults as usize) as f64,
            "photons took too many steps, as where nothing lets them out, or their weight was not finite: their weight is in lost",
        );
        warn("sums_overflow", f64::from(overflow), "the 64-bit sums are about to overflow: ask for fewer photons");
        warn(
            "beam_misses",
            ledgers.sum(LedgerEntry::Missed as usize) as f64,
            "photons flew past the box: their weight is in lost",
        );
        warn(
            "march_bias",
            self.march_bias(),
            "the march's free paths are whole steps: where the medium is densest they are too long by this part",
        );
        let mut result = json!({
            "photons": ledgers.histories,
            "ledger": fractions,
            "mean_scatterings": ledgers.sum(LedgerEntry::Scatterings as usize) as f64 / n,
            "mean_path_mm": ledgers.sum(LedgerEntry::Path as usize) as f64 * self.path_unit_mm() / n,
            "faults": ledgers.sum(LedgerEntry::Faults as usize),
            "broken_majorants": ledgers.sum(LedgerEntry::Broken as usize),
            "missed": ledgers.sum(LedgerEntry::Missed as usize),
            "overflow": overflow,
            "tracking": self.tracking.name(),
            "tracking_reason": self.tracking_reason,
            "tally": self.parameters.tally,
            "estimator": if self.track { "track_length" } else { "collision" },
            "warnings": warnings,
        });
        if let Some(histogram) = &self.parameters.exit_histogram {
            let (rings, cones) = (histogram.radius_edges_mm.len() - 1, histogram.angle_edges_deg.len() - 1);
            let side = |side: usize| -> Vec<Vec<Value>> {
                let bin = |ring: usize, cone: usize| {
                    ledgers.fraction(LedgerEntry::LENGTH + (side * rings + ring) * cones + cone)
                };
                (0..rings).map(|ring| (0..cones).map(|cone| bin(ring, cone)).collect()).collect()
            };
            result["exit_histogram"] = json!({"radius_edges_mm": histogram.radius_edges_mm, "angle_edges_deg": histogram.angle_edges_deg,
                "minus_z": side(0), "plus_z": side(1)});
        }
        result
    }

    /// The relative excess of the march's mean free path where the medium is densest.
    fn march_bias(&self) -> f64 {
        let depth = self.march_step_mm() * self.extinction_range_per_mm[1];
        if self.tracking == super::tracking::Tracking::March { march_bias(depth) } else { 0.0 }
    }

    fn broken_words(&self) -> &'static str {
        if self.tracking == super::tracking::Tracking::Weighted {
            "collisions at which the majorant was below the extinction; weights make up for it, at a cost in noise"
        } else {
            "collisions at which the majorant was below the extinction: the result is biased"
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::simulation;
    use super::*;
    use crate::asset::{AssetLimits, Assets};
    use crate::volume::VolumeLimits;

    #[test]
    fn sums_near_the_end_of_their_range_are_flagged() -> crate::error::Result<()> {
        let folder = std::env::temp_dir().join(format!("cloudchamber-report-{}", std::process::id()));
        let assets = Assets::open(
            &folder,
            AssetLimits { volume: VolumeLimits::default(), max_store_bytes: 0, max_resident_bytes: 0 },
        )?;
        let of = simulation(&json!({"photons": 1000, "grid": [4, 4, 4]}), "/volume/photon_transport", &assets)?;
        let plan = of.device_plan()?;
        let flags = |of_grid: bool, ledger_sum: u64| {
            let mut ledger = vec![0; plan.ledger];
            ledger[6] = ledger_sum;
            let result = of.report(&Ledgers::new(&[ledger.clone(), ledger], 1000), of_grid);
            let warned =
                result["warnings"].as_array().is_some_and(|all| all.iter().any(|w| w["code"] == "sums_overflow"));
            assert_eq!(result["overflow"], warned);
            warned
        };
        assert!(!flags(false, 1 << 59), "sums with room to spare");
        assert!(flags(true, 0), "a voxel's sum");
        assert!(flags(false, (1 << 60) + 1), "the ledger's sum of two batches");
        drop(std::fs::remove_dir_all(folder));
        Ok(())
    }

    #[test]
    fn fractions_are_the_first_entries_of_the_ledger() {
        let names: Vec<String> = FRACTIONS.iter().map(|name| name.to_uppercase()).collect();
        let text = LedgerEntry::opencl_text();
        for (name, number) in names.iter().zip(0..) {
            assert!(text.contains(&format!("#define LEDGER_{name} {number}\n")), "{name} in {text}");
        }
    }
}
