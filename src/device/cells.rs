//! Macro-cells on the device: the least and greatest value in each block of voxels, and from them the distance to the nearest cell that a view needs.

pub use super::numbers::CELL;
use super::program::{Source, Variant};
use super::structs::DeviceStruct;
use super::{Buffer, Device};
use crate::device_struct;
use crate::error::Result;
use crate::volume::VoxelType;

device_struct! {
    /// Parameters of the kernels of the cells.
    pub struct CellsPass {
        /// Voxels along x, y, z.
        pub dims: [i32; 3],
        /// The axis along which a pass of `distances` works.
        pub axis: i32,
        /// The number of intervals of values that make a cell occupied.
        pub intervals: i32,
        /// The part of a cell's range by which an interpolant may exceed it.
        pub overshoot: f32,
    }
}

fn variant(kernel: &'static str, voxel: VoxelType) -> Variant {
    Variant::new(kernel, Some(voxel), &[])
}

fn source(kernel: &'static str, variants: fn() -> Vec<Variant>) -> Source {
    Source { kernel, words: String::new, structs: || vec![CellsPass::LAYOUT], variants, common: VoxelType::ALL.len() }
}

/// The kernels of the cells.
pub fn sources() -> [Source; 2] {
    [
        source("cells", || VoxelType::ALL.map(|t| variant("cells", t)).to_vec()),
        source("distances", || VoxelType::ALL.map(|t| variant("distances", t)).to_vec()),
    ]
}

/// The variants that a volume of these voxels needs.
pub fn needed(voxel: VoxelType) -> [Variant; 2] {
    [variant("cells", voxel), variant("distances", voxel)]
}

/// The least and greatest voxel that a sample in each cell can read.
pub struct Cells {
    /// Two voxels per cell, in the volume's own type; if all are NaN the least is above the greatest.
    pub ranges: Buffer,
    voxel_dims: [usize; 3],
    voxel: VoxelType,
}

impl Cells {
    /// Builds the cells from the voxels on the device.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room or a kernel fails.
    pub fn new(device: &mut Device, voxels: &Buffer, voxel_dims: [usize; 3], voxel: VoxelType) -> Result<Self> {
        let [build, _] = sources();
        let kernel = variant("cells", voxel);
        device.build(&build, &kernel)?;
        let [wide, high, deep] = voxel_dims.map(|n| n.div_ceil(CELL));
        // Lanes load whole words.
        let ranges = device.allocate(2 * voxel.bytes() * wide * high * deep + 8)?;
        let pass = device.upload(bytemuck::bytes_of(&pass(voxel_dims, 0, 0, 0.0)), 0)?;
        device.run(&kernel, &[("pass", &pass), ("voxels", voxels), ("ranges", &ranges)], high * deep)?;
        Ok(Self { ranges, voxel_dims, voxel })
    }

    /// Cells along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.voxel_dims.map(|n| n.div_ceil(CELL))
    }

    /// For each cell, x fastest, the Chebyshev distance in cells to the nearest one whose range meets one of `intervals` (raw values), widened by the
    /// part `overshoot` of itself: 0 in such a cell itself, 255 for 255 or more. Around a cell of distance `d` all cells within `d − 1` are empty.
    ///
    /// # Errors
    /// As [`Cells::new`].
    pub fn distances(&self, device: &mut Device, intervals: &[[f32; 2]], overshoot: f32) -> Result<Buffer> {
        let [_, source] = sources();
        let kernel = variant("distances", self.voxel);
        device.build(&source, &kernel)?;
        let [wide, high, deep] = self.dims();
        let (a, b) = (device.allocate(wide * high * deep)?, device.allocate(wide * high * deep)?);
        let wanted = device.upload(bytemuck::cast_slice(intervals), 8)?;
        for (axis, lines, from, to) in [(0, high * deep, &b, &a), (1, wide * deep, &a, &b), (2, wide * high, &b, &a)] {
            let pass =
                device.upload(bytemuck::bytes_of(&pass(self.voxel_dims, axis, intervals.len(), overshoot)), 0)?;
            let arguments =
                [("pass", &pass), ("intervals", &wanted), ("ranges", &self.ranges), ("from", from), ("to", to)];
            device.run(&kernel, &arguments, lines)?;
        }
        Ok(a)
    }
}

fn pass(voxel_dims: [usize; 3], axis: i32, intervals: usize, overshoot: f32) -> CellsPass {
    CellsPass { dims: voxel_dims.map(|n| n as i32), axis, intervals: intervals as i32, overshoot }
}
