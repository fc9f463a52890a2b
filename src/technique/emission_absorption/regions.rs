//! Two-dimensional transfer functions: regions of value and gradient magnitude (Kniss, Kindlmann, Hansen, IEEE TVCG 8(3), 2002).

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::scene::transfer::pack;
use crate::volume::Volume;

/// Entries along each axis of the device's table.
const SIDE: usize = 256;

/// A rectangle of value and gradient magnitude with a colour; where several overlap, their extinctions add.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Least and greatest value.
    value: [f64; 2],
    /// Least and greatest gradient magnitude, in values per world unit.
    gradient: [f64; 2],
    /// Linear red, green, blue.
    #[schemars(inner(range(min = 0, max = 1)))]
    color: [f64; 3],
    /// Extinction per world unit in its middle.
    #[schemars(range(min = 0, max = 1e18))]
    opacity_per_unit: f64,
    /// The part of its half width over which it fades: 0 is a box, 1 a tent.
    #[serde(default = "default_falloff")]
    #[schemars(range(min = 0, max = 1))]
    falloff: f64,
}

fn default_falloff() -> f64 {
    0.5
}

impl Region {
    /// The share of a value along one of its sides: 1 inside, falling to 0 at the ends.
    fn share(&self, [low, high]: [f64; 2], at: f64) -> f64 {
        let from_edge = (at - low).min(high - at) / (0.5 * (high - low));
        if from_edge < 0.0 {
            0.0
        } else if self.falloff <= 0.0 {
            1.0
        } else {
            (from_edge / self.falloff).min(1.0)
        }
    }

    fn weight(&self, value: f64, magnitude: f64) -> f64 {
        self.opacity_per_unit * self.share(self.value, value) * self.share(self.gradient, magnitude)
    }
}

/// Checks that the sides rise.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub fn check(regions: &[Region], at: &str) -> Result<()> {
    for (i, region) in regions.iter().enumerate() {
        for (name, [low, high]) in [("value", region.value), ("gradient", region.gradient)] {
            if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
                return Err(Error::invalid(
                    format!("{at}/{i}/{name}/1"),
                    "the range is empty",
                    format!("more than {low}"),
                ));
            }
        }
    }
    Ok(())
}

/// The regions' extent: an interval of values, and the greatest magnitude.
pub fn extent(regions: &[Region], volume: &Volume) -> ([f64; 2], f64) {
    let low = regions.iter().map(|r| r.value[0]).fold(f64::INFINITY, f64::min);
    let high = regions.iter().map(|r| r.value[1]).fold(f64::NEG_INFINITY, f64::max);
    let steep = regions.iter().map(|r| r.gradient[1]).fold(0.0, f64::max);
    // The margin makes the outermost entries empty, which stand for all values beyond.
    let margin = (high - low).max(f64::MIN_POSITIVE) / (SIDE - 4) as f64;
    let voxel = volume.smallest_side();
    let [least, most] = volume.range();
    // No gradient is steeper than the whole range from one voxel to the next, along all three axes.
    let possible = 1.75 * (most - least).max(f64::MIN_POSITIVE) / voxel;
    ([low - 2.0 * margin, high + 2.0 * margin], steep.min(possible) * (SIDE as f64 / (SIDE - 2) as f64))
}

/// The device's table for steps of `step` world units, gradient magnitudes row by row.
pub fn table(regions: &[Region], volume: &Volume, opacity_scale: f64, step: f64) -> Vec<u32> {
    let ([low, high], steep) = extent(regions, volume);
    let last = (SIDE - 1) as f64;
    let entry = |i: usize| {
        let value = low + (high - low) * (i % SIDE) as f64 / last;
        let magnitude = steep * (i / SIDE) as f64 / last;
        let weights: Vec<f64> = regions.iter().map(|r| r.weight(value, magnitude)).collect();
        let sigma: f64 = weights.iter().sum();
        let mixed =
            |c: usize| regions.iter().zip(&weights).map(|(r, w)| r.color[c] * w).sum::<f64>() / sigma.max(1e-300);
        pack([mixed(0), mixed(1), mixed(2)], -(-sigma * opacity_scale * step).exp_m1())
    };
    (0..SIDE * SIDE).flat_map(entry).collect()
}

/// The intervals of values that have an opacity in any region.
pub fn opaque(regions: &[Region]) -> Vec<[f64; 2]> {
    regions.iter().filter(|r| r.opacity_per_unit > 0.0).map(|r| r.value).collect()
}
