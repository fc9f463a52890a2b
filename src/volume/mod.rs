//! Grids of voxels: their values, their place in the world, and the code that reads, builds and keeps them.
//!
//! **Index space** is cell-cornered: along an axis of `n` voxels the continuous index `u` runs over `0..n`, voxel `i`
//! has its centre at `i + 0.5`, and the volume's box is `[0, n]`. [`Volume::world_from_index`] takes that box to the
//! world with its centre at the origin. World axes of a scan are NIfTI's: x right, y anterior, z superior.
//!
//! **Values** are `raw · slope + inter`. Voxels stay in the type of their file, so that a byte volume takes a byte a voxel on the device
//! too. Floats are taken as words of 16 bits if a view needs no more (`words.rs`).

mod array;
mod away;
mod bright;
pub mod builtin;
mod contents;
mod indexed;
mod inflate;
mod info;
mod levels;
mod limits;
mod magnitude;
mod nifti;
mod nrrd;
mod nrrd_header;
mod nrrd_write;
mod parallel;
mod place;
mod range;
mod raw;
mod read;
mod samples;
mod values;
mod voxels;
mod words;

pub use array::Array;
pub use away::{DeviceGrid, GridStatistics};
pub use contents::{Contents, DataKind, is_hounsfield};
pub use indexed::{Indexed, MOST_VALUES};
pub(crate) use inflate::is_gzip;
pub use info::VolumeInfo;
pub use levels::MOST_LEVEL;
pub use limits::VolumeLimits;
pub use nrrd_write::write_nrrd;
pub use raw::{RawParams, RawQuery};
pub use read::{FORMATS, read};
pub use samples::{Endian, RawType};
pub use values::Values;
pub use voxels::{Histogram, VoxelType, Voxels};
pub use words::WordScale;

use crate::error::{Error, Result};
use away::Away;
use glam::{DAffine3, DMat3, DVec3};
use place::physical_range;
use range::raw_range;
use std::sync::OnceLock;

/// The parts of a volume that a reader or a built-in gives. [`Volume::new`] checks them and derives the rest.
#[derive(Debug)]
pub struct NewVolume {
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// Distance between neighbouring voxels in world units; used only without `linear`.
    pub spacing: [f64; 3],
    /// The matrix whose columns are the steps from voxel to voxel along x, y, z in world units, if the file gives it.
    pub linear: Option<DMat3>,
    /// The voxels, x fastest, then y, then z.
    pub voxels: Voxels,
    /// value = raw · slope + inter.
    pub slope: f64,
    /// value = raw · slope + inter.
    pub inter: f64,
    /// A name for people.
    pub name: String,
    /// The source of the volume: `nifti`, `nrrd`, `raw`, `builtin` or `field`.
    pub format: String,
    /// Row-major map from integer voxel indices to patient space (RAS) in the file's own length unit.
    pub file_affine: Option<[[f64; 4]; 4]>,
    /// The world's length unit: `mm`, or `unit` for a volume without a physical size.
    pub unit: String,
    /// The losses and assumptions of reading, in words for the sender.
    pub notes: Vec<String>,
}

/// A grid of finite voxels (NaN where there is no value) with its place in the world and its statistics.
#[derive(Debug)]
pub struct Volume {
    parts: NewVolume,
    world_from_index: DAffine3,
    range: [f64; 2],
    non_finite: u64,
    histogram: OnceLock<Histogram>,
    bright_mean: OnceLock<f64>,
    /// The value that few of a field's voxels exceed.
    upper: Option<f64>,
    levels: levels::Levels,
    words: words::Words,
    index: indexed::Index,
    contents: OnceLock<Contents>,
    /// The voxels, if they are on the device and not among the parts.
    away: Option<Away>,
}

impl Volume {
    /// Checks the parts and computes range and histogram. Infinite voxels become NaN.
    ///
    /// # Errors
    /// [`Error::Invalid`] if spacing, axes or scaling make no sense; [`Error::Internal`] if voxels do not fit `dims`.
    pub fn new(parts: NewVolume) -> Result<Self> {
        let count = parts.dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        if count != Some(parts.voxels.len()) || parts.voxels.is_empty() {
            return Err(Error::internal(format!("{} voxels for dims {:?}", parts.voxels.len(), parts.dims)));
        }
        let (mut parts, world_from_index) = parts.placed()?;
        let non_finite = parts.voxels.make_finite_or_nan();
        let parts = parts.of_usual_magnitude();
        let range = match raw_range(&parts.voxels) {
            Some(raw) => physical_range(raw, parts.slope, parts.inter)?,
            None => [0.0; 2],
        };
        let histogram = Histogram::new(&parts.voxels, parts.slope, parts.inter, range);
        let made = Self::of_parts(parts, world_from_index, range, non_finite);
        Ok(Self { histogram: OnceLock::from(histogram), ..made })
    }

    /// A volume of checked parts; what is not given is found when it is asked for.
    fn of_parts(parts: NewVolume, world_from_index: DAffine3, range: [f64; 2], non_finite: u64) -> Self {
        let (histogram, bright_mean, levels, words, index, contents) = Default::default();
        let (upper, away) = (None, None);
        Self {
            parts,
            world_from_index,
            range,
            non_finite,
            histogram,
            bright_mean,
            upper,
            levels,
            words,
            index,
            contents,
            away,
        }
    }

    /// Voxels along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.parts.dims
    }

    /// World distance between neighbouring voxels along each index axis.
    pub fn spacing(&self) -> [f64; 3] {
        self.parts.spacing
    }

    /// The smallest of these distances.
    pub fn smallest_side(&self) -> f64 {
        self.spacing().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The voxels in the type of their file, x fastest, then y, then z. Those of a field are read from the device when they are first asked for.
    ///
    /// # Errors
    /// [`Error::Internal`] if the device fails.
    pub fn voxels(&self) -> Result<&Voxels> {
        self.away.as_ref().map_or(Ok(&self.parts.voxels), Away::voxels)
    }

    /// The number of voxels.
    pub fn voxel_count(&self) -> usize {
        self.dims().iter().product()
    }

    /// The type of a voxel.
    pub fn voxel_type(&self) -> VoxelType {
        self.parts.voxels.voxel_type()
    }

    /// Bytes of all voxels.
    pub fn bytes(&self) -> u64 {
        (self.voxel_count() * self.voxel_type().bytes()) as u64
    }

    /// value = raw · slope + inter.
    pub fn slope(&self) -> f64 {
        self.parts.slope
    }

    /// value = raw · slope + inter.
    pub fn inter(&self) -> f64 {
        self.parts.inter
    }

    /// The values of its voxels.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn values(&self) -> Result<Values<'_>> {
        Ok(Values { volume: self, voxels: self.voxels()? })
    }

    /// World from continuous index: the box `[0, n]` stands centred at the world's origin.
    pub fn world_from_index(&self) -> DAffine3 {
        self.world_from_index
    }

    /// Continuous index from world.
    pub fn index_from_world(&self) -> DAffine3 {
        self.world_from_index.inverse()
    }

    /// Half the size of the smallest world-aligned box around the volume; its centre is the origin.
    pub fn world_half_size(&self) -> DVec3 {
        let linear = self.world_from_index.matrix3;
        let half = DVec3::from_array(self.parts.dims.map(|n| n as f64 / 2.0));
        linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z
    }

    /// The least and the greatest value, scaled; both are 0 if no voxel is finite.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The number of voxels that are NaN, or were infinite in the file. Nothing is rendered in these voxels.
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// The histogram of the values.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn histogram(&self) -> Result<&Histogram> {
        if let (None, Some(away)) = (self.histogram.get(), &self.away) {
            let histogram = Histogram::new(away.values()?, 1.0, 0.0, self.range);
            return Ok(self.histogram.get_or_init(|| histogram));
        }
        Ok(self.histogram.get_or_init(|| Histogram::new(&self.parts.voxels, self.slope(), self.inter(), self.range)))
    }

    /// The histogram of the values over a range; what is beyond counts to its ends.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn histogram_within(&self, range: [f64; 2]) -> Result<Histogram> {
        if range == self.range {
            return self.histogram().cloned();
        }
        Ok(Histogram::new(self.voxels()?, self.slope(), self.inter(), range))
    }

    /// The mean of the finite voxels along a bright ray, without outliers: one in fifty of the rays along the grid's axes is brighter.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn bright_mean(&self) -> Result<f64> {
        let (values, data) = (self.values()?, self.contents()?.data);
        Ok(*self.bright_mean.get_or_init(|| bright::bright_mean(self.dims(), values, data)))
    }

    /// The value that few voxels of a field exceed, those next to its source ([`GridStatistics::UPPER`]); `None` for other volumes.
    pub fn upper(&self) -> Option<f64> {
        self.upper
    }

    /// A name for people.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// The source of the volume: `nifti`, `nrrd`, `raw`, `builtin` or `field`.
    pub fn format(&self) -> &str {
        &self.parts.format
    }

    /// Row-major map from integer voxel indices to patient space (RAS), in the file's own length unit.
    pub fn file_affine(&self) -> Option<[[f64; 4]; 4]> {
        self.parts.file_affine
    }

    /// The world's length unit: `mm` or `unit`.
    pub fn unit(&self) -> &str {
        &self.parts.unit
    }

    /// The losses and assumptions of reading.
    pub fn notes(&self) -> &[String] {
        &self.parts.notes
    }
}
