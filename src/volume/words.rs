//! A volume of floats in whole numbers of 16 bits. It takes half the memory, and kernels weigh the words twice as fast.
//!
//! Word w stands for low + w (high − low) / 65535, so that a value is off by half a step, (high − low) / 131070, at most, and so are values
//! between voxels. Statistics are the volume's own.

use std::sync::{Arc, OnceLock};

use super::parallel::over_slices;
use super::{NewVolume, Volume, VoxelType, Voxels};

/// The number of steps of the words over the range.
const STEPS: f64 = 65535.0;
/// Voxels that a thread converts at a time.
const PART: usize = 1 << 16;

/// The volume in words once it was asked for; `None` in it if the volume has no words.
pub(super) type Words = OnceLock<Option<Arc<Volume>>>;

impl Volume {
    /// The volume in words, if it has floats, all of them finite, and words whose steps are at most `resolution`, a difference of values.
    /// It is made when it is first asked for and kept as long as the volume.
    pub fn words(&self, resolution: f64) -> Option<Arc<Self>> {
        let [low, high] = self.range;
        let are_floats = self.voxel_type() == VoxelType::F32;
        let fine = are_floats && self.non_finite == 0 && high > low && self.word_step() <= resolution;
        fine.then(|| self.words.get_or_init(|| self.in_words()).clone()).flatten()
    }

    /// The difference of the values of two neighbouring words.
    pub fn word_step(&self) -> f64 {
        (self.range[1] - self.range[0]) / STEPS
    }

    fn in_words(&self) -> Option<Arc<Self>> {
        let raw = self.range.map(|value| (value - self.inter()) / self.slope());
        let (low, high) = (raw[0].min(raw[1]), raw[0].max(raw[1]));
        let (scale, slope) = ((STEPS / (high - low)) as f32, self.slope() * (high - low) / STEPS);
        if !(scale.is_normal() && slope.is_normal()) {
            return None;
        }
        let scale = WordScale { first: low as f32, per_value: scale };
        // Words of a grid on the device are made there.
        let (voxels, away) = match &self.away {
            Some(away) => (Voxels::U16(Vec::new()), Some(away.in_words(scale))),
            None => (scale.words(&self.parts.voxels), None),
        };
        let inter = self.inter() + self.slope() * low;
        let parts = NewVolume { slope, inter, notes: self.notes().to_vec(), ..self.parts_with(voxels) };
        let words = self.derived(parts, self.world_from_index);
        // The quantile of the words is the word of the quantile.
        let upper = self.upper.map(|upper| f64::from(scale.word(upper as f32)) * slope + inter);
        Some(Arc::new(Self { bright_mean: self.bright_mean.clone(), upper, away, ..words }))
    }
}

/// Raw values as words: word = (value − first) per_value, rounded, in single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WordScale {
    /// The value of word 0.
    pub first: f32,
    /// Words per value.
    pub per_value: f32,
}

impl WordScale {
    /// The word of a value. The cast saturates, so that a value that rounding takes past an end becomes the end.
    fn word(self, value: f32) -> u16 {
        ((value - self.first) * self.per_value + 0.5) as u16
    }

    /// The words of floats; none for voxels that are no floats.
    pub(super) fn words(self, voxels: &Voxels) -> Voxels {
        let Voxels::F32(values) = voxels else { return Voxels::U16(Vec::new()) };
        let mut words = vec![0u16; values.len()];
        over_slices(&mut words, PART, |part, words| {
            for (word, value) in words.iter_mut().zip(&values[part * PART..]) {
                *word = self.word(*value);
            }
        });
        Voxels::U16(words)
    }
}
