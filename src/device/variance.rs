//! The variance of a film's clusters of 2 × 2 pixels, summed on the device over those at the same place in the cells of a grid
//! (`kernels/variance.cl`).

use super::program::{Source, Variant};
use super::structs::DeviceStruct;
use super::{Buffer, Device};
use crate::device_struct;
use crate::error::Result;

const VARIANCE: Variant = Variant::new("variance", None, &[]);

device_struct! {
    /// A film, and the cells of a grid in it.
    pub struct VariancePass {
        /// Pixels across the film.
        pub width: i32,
        /// Pixels down the film.
        pub height: i32,
        /// Clusters across and down a cell.
        pub side: i32,
        /// Cells across and down.
        pub cells: [i32; 2],
        /// Every so manyth cell down counts apart from the others.
        pub sparse: i32,
        /// 1 for the variance of the four colours in a cluster, 0 for that of the samples of its pixels.
        pub of_colours: i32,
    }
}

/// The kernel.
pub fn source() -> Source {
    Source {
        kernel: "variance",
        words: String::new,
        structs: || vec![VariancePass::LAYOUT],
        variants: || vec![VARIANCE],
        common: 1,
    }
}

/// Builds the kernel, for [`of_clusters`].
///
/// # Errors
/// [`crate::error::Error::Internal`] if it does not build.
pub fn build(device: &mut Device) -> Result<()> {
    device.build(&source(), &VARIANCE)
}

/// For every row of a cell, and every cluster across: the sum of M2 over the pixels of the clusters there, or of the squared deviations of a cluster's
/// luminances from their mean. First those in every `sparse`-th cell down, then those in the others. What is not finite is left out.
///
/// # Errors
/// [`crate::error::Error::Internal`] if the device has no room, or the kernel is not built or fails.
pub fn of_clusters(device: &Device, film: &Buffer, pass: &VariancePass) -> Result<Vec<f32>> {
    let mut sums = vec![0.0; (2 * pass.side * pass.cells[0] * pass.side) as usize];
    let on_device = device.allocate(size_of_val(sums.as_slice()))?;
    let pass = device.upload(bytemuck::bytes_of(pass), 0)?;
    device.run(&VARIANCE, &[("pass", &pass), ("film", film), ("sums", &on_device)], sums.len())?;
    device.read(&on_device, 0, &mut sums)?;
    Ok(sums)
}
