//! Grids of fields on the device: floats from fixed-point sums, statistics, words, and the way to the host for those who ask (`kernels/grid.cl`).

use std::sync::Arc;

use opencl3::command_queue::CommandQueue;

use super::buffer::read;
use super::numbers::define;
use super::program::{Source, Variant};
use super::reduce::{self, Reduction};
use super::structs::DeviceStruct;
use super::{Buffer, Device};
use crate::device_struct;
use crate::error::{Error, Result};
use crate::volume::{DeviceGrid, GridStatistics, WordScale};

/// The name of the kernels' file.
const KERNEL: &str = "grid";
/// Bytes that kernels may read behind voxels: lanes load whole words.
pub const PADDING: usize = 8;
/// A sum above this may soon wrap round.
pub const NEAR_OVERFLOW: u64 = 1 << 61;

/// The kernel of [`of_sums`], for the fields that use it.
pub const OF_SUMS: Variant = Variant::new(KERNEL, None, &[]).of_function("of_sums");
/// The kernel of [`in_words`].
pub const IN_WORDS: Variant = Variant::new(KERNEL, None, &[]).of_function("in_words");
const MARK_NON_FINITE: Variant = Variant::new(KERNEL, None, &[]).of_function("mark_non_finite");

device_struct! {
    /// Parameters of `of_sums`.
    pub struct SumsPass {
        /// Voxels of a grid.
        pub voxels: u32,
        /// Grids whose sums are added.
        pub grids: u32,
        /// The bits of a double, by which totals are multiplied; the lower half first.
        pub scale: [u32; 2],
    }
}

device_struct! {
    /// Parameters of `in_words`.
    pub struct WordsPass {
        /// Voxels of the grid.
        pub voxels: u32,
        /// The value of word 0.
        pub first: f32,
        /// Words per value.
        pub per_value: f32,
    }
}

/// The kernels of grids.
pub fn source() -> Source {
    Source {
        kernel: KERNEL,
        words: || define("NEAR_OVERFLOW", format!("{NEAR_OVERFLOW}ul")),
        structs: || vec![SumsPass::LAYOUT, WordsPass::LAYOUT],
        variants: || vec![OF_SUMS, IN_WORDS, MARK_NON_FINITE],
        common: 3,
    }
}

/// The variants that [`statistics`] needs.
pub fn needed() -> impl Iterator<Item = Variant> {
    reduce::of_grids().into_iter().chain([MARK_NON_FINITE])
}

/// Room for a grid of floats.
///
/// # Errors
/// [`Error::Internal`] if the device has no room.
pub fn allocate(device: &Device, voxels: usize) -> Result<Buffer> {
    device.allocate(size_of::<f32>() * voxels + PADDING)
}

/// A copy of a grid of floats: the next steps of a process do not change it.
///
/// # Errors
/// [`Error::Internal`] if the device has no room or fails.
pub fn copy(device: &Device, values: &Buffer, voxels: usize) -> Result<Buffer> {
    let mut copy = allocate(device, voxels)?;
    device.copy(values, &mut copy, size_of::<f32>() * voxels)?;
    Ok(copy)
}

/// A grid of floats: the totals of `grids` grids of 64-bit fixed-point sums, which follow each other in `sums`, times `scale`. Also true if a total is
/// near the end of its range, [`NEAR_OVERFLOW`].
///
/// # Errors
/// [`Error::Internal`] if the kernel is not built or the device fails.
pub fn of_sums(device: &Device, sums: &Buffer, [voxels, grids]: [usize; 2], scale: f64) -> Result<(Buffer, bool)> {
    if sums.len() < size_of::<u64>() * voxels * grids {
        return Err(Error::internal(format!("{voxels} sums in {grids} grids are more than there are")));
    }
    let bits = scale.to_bits();
    let pass = SumsPass { voxels: voxels as u32, grids: grids as u32, scale: [bits as u32, (bits >> 32) as u32] };
    let (pass, flag) = (device.upload(bytemuck::bytes_of(&pass), 0)?, device.upload(&[0; size_of::<i32>()], 0)?);
    let values = allocate(device, voxels)?;
    device.run(&OF_SUMS, &[("pass", &pass), ("sums", sums), ("values", &values), ("near_overflow", &flag)], voxels)?;
    let mut near_overflow = [0i32];
    device.read(&flag, 0, &mut near_overflow)?;
    Ok((values, near_overflow != [0]))
}

/// The statistics of a grid of floats. Values that are not finite become NaN.
///
/// # Errors
/// [`Error::Internal`] if a kernel is not built or the device fails.
pub fn statistics(device: &Device, values: &Buffer, voxels: usize) -> Result<GridStatistics> {
    let mut reduction = Reduction::new(device, voxels)?;
    let range = reduction.extremes(device, values, voxels)?;
    let (finite, upper) = reduction.quantile(device, values, voxels, GridStatistics::UPPER)?;
    let non_finite = voxels as u64 - finite;
    if non_finite > 0 {
        let count = device.upload(&(voxels as u32).to_ne_bytes(), 0)?;
        device.run(&MARK_NON_FINITE, &[("voxels", &count), ("values", values)], voxels)?;
    }
    Ok(GridStatistics { range, non_finite, upper })
}

/// The words of a grid of floats.
///
/// # Errors
/// [`Error::Internal`] if the kernel is not built or the device fails.
pub fn in_words(device: &Device, values: &Buffer, voxels: usize, scale: WordScale) -> Result<Buffer> {
    let pass = WordsPass { voxels: voxels as u32, first: scale.first, per_value: scale.per_value };
    let pass = device.upload(bytemuck::bytes_of(&pass), 0)?;
    let words = device.allocate(size_of::<u16>() * voxels + PADDING)?;
    device.run(&IN_WORDS, &[("pass", &pass), ("values", values), ("words", &words)], voxels)?;
    Ok(words)
}

/// A grid of floats that any thread may read.
pub struct Grid {
    values: Arc<Buffer>,
    voxels: usize,
    queue: Arc<CommandQueue>,
}

impl Grid {
    /// The first `voxels` floats of a buffer.
    ///
    /// # Errors
    /// [`Error::Internal`] if the buffer is shorter than [`allocate`] makes it.
    pub fn new(device: &Device, values: Buffer, voxels: usize) -> Result<Self> {
        if values.len() < size_of::<f32>() * voxels + PADDING {
            return Err(Error::internal("a grid without room behind it"));
        }
        Ok(Self { values: Arc::new(values), voxels, queue: device.reads.clone() })
    }

    /// Its floats on the device.
    pub fn values(&self) -> &Arc<Buffer> {
        &self.values
    }
}

impl DeviceGrid for Grid {
    fn read(&self) -> Result<Vec<f32>> {
        let mut values = vec![0.0; self.voxels];
        read(&self.queue, &self.values, 0, &mut values)?;
        Ok(values)
    }
}
