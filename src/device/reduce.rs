//! Reductions: sums, inner products and extremes of floats on the device, the same for any number of threads and lanes (`kernels/reduce.cl`).

use super::numbers::define;
use super::program::{Source, Variant};
use super::{Buffer, Device};
use crate::error::{Error, Result};

/// Values that a work-item reduces: `BLOCK` of the kernels.
const BLOCK: usize = 1024;
/// The name of the kernels' file.
const KERNEL: &str = "reduce";

const SUM: Variant = Variant::new(KERNEL, None, &[]).of_function("sum");
const DOT_PRODUCT: Variant = Variant::new(KERNEL, None, &[]).of_function("dot_product");
const EXTREMES: Variant = Variant::new(KERNEL, None, &[]).of_function("extremes");

/// The kernels of reductions.
pub fn source() -> Source {
    Source {
        kernel: KERNEL,
        words: || define("BLOCK", BLOCK),
        structs: Vec::new,
        variants: || variants().to_vec(),
        common: 0,
    }
}

/// The variants that a process lists among its kernels if it uses reductions.
pub fn variants() -> [Variant; 3] {
    [SUM, DOT_PRODUCT, EXTREMES]
}

/// Reduces buffers of at most a given number of floats. Its kernels are built.
pub struct Reduction {
    count: Buffer,
    partials: Buffer,
    most: usize,
}

impl Reduction {
    /// Allocates memory for buffers of `most` floats.
    ///
    /// # Errors
    /// [`Error::Internal`] if the device has no room.
    pub fn new(device: &Device, most: usize) -> Result<Self> {
        let partials = device.allocate(most.div_ceil(BLOCK) * size_of::<[f32; 2]>())?;
        Ok(Self { count: device.allocate(size_of::<i32>())?, partials, most })
    }

    fn partials(
        &mut self,
        device: &Device,
        kernel: &Variant,
        buffers: &[&Buffer],
        count: usize,
    ) -> Result<Vec<[f32; 2]>> {
        if count > self.most || buffers.iter().any(|buffer| buffer.len() < count * size_of::<f32>()) {
            return Err(Error::internal(format!("{count} floats are more than there are to reduce")));
        }
        device.write(&mut self.count, 0, &(count as i32).to_ne_bytes())?;
        let mut arguments = vec![("count", &self.count), ("partials", &self.partials)];
        arguments.extend(["a", "b"].into_iter().zip(buffers.iter().copied()));
        let blocks = count.div_ceil(BLOCK);
        device.run(kernel, &arguments, blocks)?;
        let mut partials = vec![[0.0; 2]; blocks];
        device.read(&self.partials, 0, &mut partials)?;
        Ok(partials)
    }

    /// Σ a over the first `count` floats, with a relative error of about 10⁻¹³ · Σ |a| / |Σ a|.
    ///
    /// # Errors
    /// [`Error::Internal`] if a buffer is too short or the device fails.
    pub fn sum(&mut self, device: &Device, a: &Buffer, count: usize) -> Result<f64> {
        Ok(total(&self.partials(device, &SUM, &[a], count)?))
    }

    /// Σ a b over the first `count` floats of each, with the same relative error.
    ///
    /// # Errors
    /// As [`Reduction::sum`].
    pub fn dot_product(&mut self, device: &Device, a: &Buffer, b: &Buffer, count: usize) -> Result<f64> {
        Ok(total(&self.partials(device, &DOT_PRODUCT, &[a, b], count)?))
    }

    /// The least and the greatest of the first `count` floats that are finite; `None` if no float is.
    ///
    /// # Errors
    /// As [`Reduction::sum`].
    pub fn extremes(&mut self, device: &Device, a: &Buffer, count: usize) -> Result<Option<[f32; 2]>> {
        let partials = self.partials(device, &EXTREMES, &[a], count)?;
        let wider = |[low, high]: [f32; 2], [l, h]: &[f32; 2]| [low.min(*l), high.max(*h)];
        let [low, high] = partials.iter().fold([f32::INFINITY, f32::NEG_INFINITY], wider);
        Ok((low <= high).then_some([low, high]))
    }
}

/// The total of the blocks' sums, in their order.
fn total(partials: &[[f32; 2]]) -> f64 {
    partials.iter().map(|[sum, lost]| f64::from(*sum) + f64::from(*lost)).sum()
}
