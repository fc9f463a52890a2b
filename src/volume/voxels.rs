//! Voxels in the type of their file, and the histogram of their values.

use super::parallel;

/// The type of a stored voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum VoxelType {
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// IEEE 754 single precision.
    F32,
}

impl VoxelType {
    /// Every type. Kernels are built for each.
    pub const ALL: [Self; 4] = [Self::U8, Self::I16, Self::U16, Self::F32];

    /// The bytes of one voxel.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// The voxels of a grid, x fastest, then y, then z.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    /// Unsigned, 8 bits.
    U8(Vec<u8>),
    /// Signed, 16 bits.
    I16(Vec<i16>),
    /// Unsigned, 16 bits.
    U16(Vec<u16>),
    /// IEEE 754 single precision.
    F32(Vec<f32>),
}

/// Calls a function that is generic over the voxel's type with the slice of voxels as its first argument.
macro_rules! with_slice {
    ($voxels:expr, $function:ident $(, $argument:expr)*) => {
        match $voxels {
            $crate::volume::Voxels::U8(v) => $function(v.as_slice() $(, $argument)*),
            $crate::volume::Voxels::I16(v) => $function(v.as_slice() $(, $argument)*),
            $crate::volume::Voxels::U16(v) => $function(v.as_slice() $(, $argument)*),
            $crate::volume::Voxels::F32(v) => $function(v.as_slice() $(, $argument)*),
        }
    };
}
pub(super) use with_slice;

impl Voxels {
    /// The number of voxels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::I16(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    /// True if there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type of a voxel.
    pub fn voxel_type(&self) -> VoxelType {
        match self {
            Self::U8(_) => VoxelType::U8,
            Self::I16(_) => VoxelType::I16,
            Self::U16(_) => VoxelType::U16,
            Self::F32(_) => VoxelType::F32,
        }
    }

    /// All voxels as they lie in memory (native byte order). The device gets these bytes.
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::U8(v) => v,
            Self::I16(v) => bytemuck::cast_slice(v),
            Self::U16(v) => bytemuck::cast_slice(v),
            Self::F32(v) => bytemuck::cast_slice(v),
        }
    }

    /// The raw value of voxel `i`, not scaled (exact in every type); NaN past the end.
    pub fn get_f32(&self, i: usize) -> f32 {
        match self {
            Self::U8(v) => v.get(i).map(|&value| f32::from(value)),
            Self::I16(v) => v.get(i).map(|&value| f32::from(value)),
            Self::U16(v) => v.get(i).map(|&value| f32::from(value)),
            Self::F32(v) => v.get(i).copied(),
        }
        .unwrap_or(f32::NAN)
    }

    /// Turns infinities into NaN, the one mark for "no value here", and counts both.
    pub(super) fn make_finite_or_nan(&mut self) -> u64 {
        let Self::F32(values) = self else { return 0 };
        let mut count = 0;
        for value in values {
            if !value.is_finite() {
                *value = f32::NAN;
                count += 1;
            }
        }
        count
    }
}

/// A voxel's type as the statistics see it. Comparisons with NaN are false, so NaN never becomes a minimum or maximum.
pub(super) trait Sample: Copy + PartialOrd + Send + Sync {
    /// The start value of a search for the minimum.
    const HIGHEST: Self;
    /// The start value of a search for the maximum.
    const LOWEST: Self;
    /// The value, without rounding.
    fn to_f64(self) -> f64;
}

macro_rules! sample {
    ($type:ty, $highest:expr, $lowest:expr) => {
        impl Sample for $type {
            const HIGHEST: Self = $highest;
            const LOWEST: Self = $lowest;
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }
    };
}
sample!(u8, u8::MAX, u8::MIN);
sample!(i16, i16::MAX, i16::MIN);
sample!(u16, u16::MAX, u16::MIN);
sample!(f32, f32::INFINITY, f32::NEG_INFINITY);

/// How many voxels have a value in each of equal steps from `min` to `max`; NaN is not counted.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct Histogram {
    /// The lower end of the first bin: the least value.
    pub min: f64,
    /// The upper end of the last bin: the greatest value, which belongs to it.
    pub max: f64,
    /// Voxels per bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// The number of bins of a histogram: one a grey level for bytes.
    pub const BINS: usize = 256;

    /// Counts the scaled values over `range`. If the range is a point, all are in the first bin.
    pub(super) fn new(voxels: &Voxels, slope: f64, inter: f64, range: [f64; 2]) -> Self {
        let [min, max] = range;
        // bin = (raw · slope + inter − min) · BINS / (max − min), with the constants multiplied out.
        let per_value = if max > min { Self::BINS as f64 / (max - min) } else { 0.0 };
        let counts = with_slice!(voxels, count_bins, slope * per_value, (inter - min) * per_value);
        Self { min, max, counts }
    }
}

/// The number of tables. Neighbours count into tables of their own, since in runs of equal voxels each count would wait for the one before
/// it.
const TABLES: usize = 4;

fn count_bins<T: Sample>(voxels: &[T], scale: f64, offset: f64) -> Vec<u64> {
    let parts = parallel::over_ranges(voxels.len(), voxels.len(), |range| {
        let mut tables = [[0u64; Histogram::BINS]; TABLES];
        for group in voxels.get(range).unwrap_or_default().chunks(TABLES) {
            for (table, value) in tables.iter_mut().zip(group) {
                let place = value.to_f64() * scale + offset;
                // The cast saturates, so a rounding error below 0 is bin 0, as is NaN, which adds nothing.
                table[(place as usize).min(Histogram::BINS - 1)] += u64::from(!place.is_nan());
            }
        }
        tables
    });
    let mut total = vec![0; Histogram::BINS];
    for table in parts.iter().flatten() {
        total.iter_mut().zip(table).for_each(|(sum, count)| *sum += count);
    }
    total
}
