//! Floats of any magnitude. Kernels square gradients and multiply values in single precision, where 1e-25 squared is 0 and 1e25 squared is infinite.

use super::{NewVolume, Voxels};

/// Floats of this magnitude are kept as they are: their squares and cubes are normal floats.
const KEPT: [f64; 2] = [1e-6, 1e6];
/// The voxels that are looked at, evenly in memory.
const LOOKED_AT: usize = 1 << 12;

impl NewVolume {
    /// The same values with raw floats of about 1, if most are far from it. A power of two takes no digit from any; only what is 2¹⁰⁰ times smaller
    /// than the others may lose some. What is far larger than they are, as a number that stands for no data, decides nothing.
    pub(super) fn of_usual_magnitude(mut self) -> Self {
        let Voxels::F32(values) = &mut self.voxels else { return self };
        let step = values.len().div_ceil(LOOKED_AT).max(1);
        let looked_at = values.iter().step_by(step).map(|value| f64::from(value.abs()));
        let mut looked_at: Vec<f64> = looked_at.filter(|value| *value > 0.0).collect();
        looked_at.sort_by(f64::total_cmp);
        let usual = looked_at.get(looked_at.len() / 2).copied().unwrap_or(1.0);
        let most = values.iter().fold(0.0f32, |most, value| most.max(value.abs()));
        // A few rare voxels may be all there is.
        let usual = if looked_at.is_empty() && most > 0.0 { f64::from(most) } else { usual };
        let factor = 2f64.powi(-usual.log2().floor() as i32);
        // A slope or a voxel that floats cannot hold would be a worse loss.
        let is_held = ((self.slope / factor) as f32).is_normal() && ((f64::from(most) * factor) as f32).is_finite();
        if (KEPT[0]..=KEPT[1]).contains(&usual) || !is_held {
            return self;
        }
        values.iter_mut().for_each(|value| *value = (f64::from(*value) * factor) as f32);
        self.slope /= factor;
        self
    }
}
