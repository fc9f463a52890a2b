//! Coarser levels of a volume, as of a mip map: level k has voxels 2ᵏ times as wide as the smallest side of the volume's own.
//!
//! A voxel of a level is the mean of the volume's voxels that its box covers, each weighted by the part of it that is inside (area
//! averaging). A voxel without a value does not count. Axes whose voxels are as wide already stay as they are. The box is the same at all
//! levels, and so are range and histogram, so that colours that depend on them do not change.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DMat3, DVec3};

use super::parallel::over_slices;
use super::voxels::{Sample, Voxels, with_slice};
use super::{Contents, DataKind, NewVolume, Volume};
use crate::error::Result;

/// The coarsest level that a request may name.
pub const MOST_LEVEL: usize = 8;

/// The levels of a volume, made as they are asked for.
pub(super) type Levels = [OnceLock<Arc<Volume>>; MOST_LEVEL];

/// The part of an axis that one voxel of a level covers: the first voxel, and the covered parts of it and of those that follow.
struct Span {
    first: usize,
    parts: Vec<f64>,
}

impl Volume {
    /// A coarser level, made when it is first asked for and kept as long as the volume. Level 0 is the volume itself; a number beyond the
    /// coarsest level gives the coarsest.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn level(self: &Arc<Self>, level: usize) -> Result<Arc<Self>> {
        let Some(place) = level.min(MOST_LEVEL).checked_sub(1) else { return Ok(self.clone()) };
        let (voxels, bright_mean, _) = (self.voxels()?, self.bright_mean()?, self.contents()?);
        Ok(self.levels[place].get_or_init(|| Arc::new(self.averaged(level, voxels, bright_mean))).clone())
    }

    /// The number of voxels along x, y, z of a level.
    fn level_dims(&self, level: usize) -> [usize; 3] {
        let spacing = self.spacing();
        let target = spacing.into_iter().fold(f64::INFINITY, f64::min) * (1u64 << level) as f64;
        // A little is taken off, so that an axis whose voxels are as wide but for rounding stays.
        [0, 1, 2].map(|a| {
            let needed = (self.dims()[a] as f64 * spacing[a] / target - 1e-6).ceil() as usize;
            needed.clamp(1, self.dims()[a])
        })
    }

    fn averaged(&self, level: usize, fine: &Voxels, bright_mean: f64) -> Self {
        let dims = self.level_dims(level);
        let spans = [0, 1, 2].map(|a| spans(self.dims()[a], dims[a]));
        let mut values = vec![0f32; dims.iter().product()];
        with_slice!(fine, average, self.dims(), &spans, &mut values);
        let voxels = match fine {
            Voxels::U8(_) => Voxels::U8(values.iter().map(|v| v.round() as u8).collect()),
            Voxels::I16(_) => Voxels::I16(values.iter().map(|v| v.round() as i16).collect()),
            Voxels::U16(_) => Voxels::U16(values.iter().map(|v| v.round() as u16).collect()),
            Voxels::F32(_) => Voxels::F32(values),
        };
        let scale = DVec3::from_array([0, 1, 2].map(|a| self.dims()[a] as f64 / dims[a] as f64));
        let DAffine3 { matrix3, translation } = self.world_from_index;
        let parts = NewVolume {
            dims,
            spacing: [0, 1, 2].map(|a| self.spacing()[a] * scale[a]),
            name: format!("{}, level {level}", self.name()),
            ..self.parts_with(voxels)
        };
        let world_from_index = DAffine3 { matrix3: matrix3 * DMat3::from_diagonal(scale), translation };
        let made = self.derived(parts, world_from_index);
        // Means of labels are no labels.
        let contents = made.contents.get().map(|contents| match contents.kind {
            DataKind::Labels => Contents { kind: DataKind::Intensity, ..contents.clone() },
            _ => contents.clone(),
        });
        let contents = contents.map_or_else(OnceLock::new, OnceLock::from);
        Self { bright_mean: OnceLock::from(bright_mean), contents, ..made }
    }

    /// The parts that a volume made of this one takes over: all but its notes and its place as its file gives it.
    pub(super) fn parts_with(&self, voxels: Voxels) -> NewVolume {
        NewVolume {
            linear: None,
            voxels,
            name: self.name().to_owned(),
            format: self.format().to_owned(),
            file_affine: None,
            unit: self.unit().to_owned(),
            notes: Vec::new(),
            ..self.parts
        }
    }

    /// A volume in the same box with the same range and histogram.
    pub(super) fn derived(&self, parts: NewVolume, world_from_index: DAffine3) -> Self {
        let non_finite = match &parts.voxels {
            Voxels::F32(values) => values.iter().filter(|v| v.is_nan()).count() as u64,
            _ => 0,
        };
        let made = Self::of_parts(parts, world_from_index, self.range, non_finite);
        Self { histogram: self.histogram.clone(), contents: self.contents.clone(), upper: self.upper, ..made }
    }

    /// The bytes of the volume, of the levels that were made of it, and of all their words.
    pub(crate) fn bytes_in_all(&self) -> u64 {
        let words = self.words.get().and_then(Option::as_ref).map_or(0, |words| words.bytes());
        let levels = self.levels.iter().filter_map(OnceLock::get);
        let index = self.index.get().map_or(0, |indexed| indexed.volume.bytes());
        self.bytes() + words + index + levels.map(|level| level.bytes_in_all()).sum::<u64>()
    }
}

/// The spans of `to` equal parts of an axis of `from` voxels.
fn spans(from: usize, to: usize) -> Vec<Span> {
    let width = from as f64 / to as f64;
    let span = |i: usize| {
        let [start, end] = [i, i + 1].map(|i| i as f64 * width);
        let voxels: Range<usize> = start.floor() as usize..(end.ceil() as usize).min(from);
        let inside = |v: usize| (end.min(v as f64 + 1.0) - start.max(v as f64)).max(0.0);
        Span { first: voxels.start, parts: voxels.map(inside).collect() }
    };
    (0..to).map(span).collect()
}

/// The means over products of spans.
fn average<T: Sample>(voxels: &[T], [width, height, _]: [usize; 3], spans: &[Vec<Span>; 3], values: &mut [f32]) {
    let [across, down, deep] = spans;
    over_slices(values, across.len() * down.len(), |z, slice| {
        for (i, value) in slice.iter_mut().enumerate() {
            let (x, y, z) = (&across[i % across.len()], &down[i / across.len()], &deep[z]);
            let (mut sum, mut weight) = (0.0, 0.0);
            for (k, of_z) in z.parts.iter().enumerate() {
                for (j, of_y) in y.parts.iter().enumerate() {
                    let row = x.first + width * (y.first + j + height * (z.first + k));
                    for (voxel, of_x) in voxels[row..].iter().zip(&x.parts) {
                        let (voxel, part) = (voxel.to_f64(), of_x * of_y * of_z);
                        if voxel.is_finite() {
                            (sum, weight) = (sum + part * voxel, weight + part);
                        }
                    }
                }
            }
            *value = (sum / weight) as f32;
        }
    });
}
