//! A label volume as the places of its values in their sorted list. Labels may be any whole numbers; places are few.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use super::{NewVolume, Volume, Voxels};
use crate::error::Result;

/// The most values that have places of their own: the entries of a transfer function's table. Further values share the places of others but the first.
pub const MOST_VALUES: usize = 4096;

/// The places of a volume's values.
#[derive(Debug, Clone)]
pub struct Indexed {
    /// The volume whose voxels are places in [`Indexed::values`].
    pub volume: Arc<Volume>,
    /// The values, in rising order.
    pub values: Arc<[f64]>,
    /// The values that share a place with another.
    pub sharing: usize,
}

/// The volume once it was asked for.
pub(super) type Index = OnceLock<Indexed>;

impl Volume {
    /// The volume by the places of its values. It is made when it is first asked for and kept as long as the volume.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn indexed(&self) -> Result<&Indexed> {
        let voxels = self.voxels()?;
        Ok(self.index.get_or_init(|| self.by_places(voxels)))
    }

    fn by_places(&self, voxels: &Voxels) -> Indexed {
        // A voxel without a value has no label.
        let raw = |i: usize| Some(voxels.get_f32(i)).filter(|value| value.is_finite()).unwrap_or(0.0);
        let mut sorted: Vec<f32> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        let mut last = None;
        for value in (0..voxels.len()).map(raw) {
            // Labels come in runs.
            if last != Some(value) && seen.insert(value.to_bits()) {
                sorted.push(value);
            }
            last = Some(value);
        }
        sorted.sort_by(f32::total_cmp);
        let place = |rank: usize| if rank < MOST_VALUES { rank } else { 1 + (rank - 1) % (MOST_VALUES - 1) };
        let places: HashMap<u32, u16> =
            sorted.iter().enumerate().map(|(rank, value)| (value.to_bits(), place(rank) as u16)).collect();
        let mut run = (f32::NAN, 0);
        let of = |i: usize| {
            let value = raw(i);
            if run.0 != value {
                run = (value, places.get(&value.to_bits()).copied().unwrap_or(0));
            }
            run.1
        };
        let words = Voxels::U16((0..voxels.len()).map(of).collect());
        let values: Vec<f64> =
            sorted.iter().take(MOST_VALUES).map(|value| f64::from(*value) * self.slope() + self.inter()).collect();
        let parts = NewVolume { slope: 1.0, inter: 0.0, ..self.parts_with(words) };
        let range = [0.0, values.len().saturating_sub(1) as f64];
        let volume = Self::of_parts(parts, self.world_from_index, range, 0);
        Indexed { volume: Arc::new(volume), values: values.into(), sharing: sorted.len().saturating_sub(MOST_VALUES) }
    }
}
