//! Reductions: sums, inner products, extremes and quantiles of floats on the device, the same for any number of threads and lanes (`kernels/reduce.cl`).

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

const COUNT_KEYS: Variant = Variant::new(KERNEL, None, &[]).of_function("count_keys");
/// The number of halves of a key.
const HALVES: usize = 1 << 16;

/// The kernels of reductions.
pub fn source() -> Source {
    Source {
        kernel: KERNEL,
        words: || define("BLOCK", BLOCK),
        structs: Vec::new,
        variants: || variants().to_vec(),
        // Those of grids.
        common: 2,
    }
}

/// The variants that a process lists among its kernels if it uses reductions.
pub fn variants() -> [Variant; 4] {
    [EXTREMES, COUNT_KEYS, SUM, DOT_PRODUCT]
}

/// The variants that the statistics of grids need.
pub(super) fn of_grids() -> [Variant; 2] {
    [EXTREMES, COUNT_KEYS]
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
        self.take_count(device, buffers, count)?;
        let mut arguments = vec![("count", &self.count), ("partials", &self.partials)];
        arguments.extend(["a", "b"].into_iter().zip(buffers.iter().copied()));
        let blocks = count.div_ceil(BLOCK);
        device.run(kernel, &arguments, blocks)?;
        let mut partials = vec![[0.0; 2]; blocks];
        device.read(&self.partials, 0, &mut partials)?;
        Ok(partials)
    }

    /// Tells the device how many floats there are.
    fn take_count(&mut self, device: &Device, buffers: &[&Buffer], count: usize) -> Result<()> {
        if count > self.most || buffers.iter().any(|buffer| buffer.len() < count * size_of::<f32>()) {
            return Err(Error::internal(format!("{count} floats are more than there are to reduce")));
        }
        device.write(&mut self.count, 0, &(count as i32).to_ne_bytes())
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

    /// The number of the first `count` floats that are finite, and their quantile `q`: the value at the rank ⌊(n − 1) q⌋ of n. The quantile is 0 if no
    /// float is finite.
    ///
    /// # Errors
    /// As [`Reduction::sum`].
    pub fn quantile(&mut self, device: &Device, a: &Buffer, count: usize, q: f64) -> Result<(u64, f32)> {
        let of_upper = self.keys(device, a, count, None)?;
        let finite: u64 = of_upper.iter().map(|n| u64::from(*n)).sum();
        let rank = (finite.saturating_sub(1) as f64 * q) as u64;
        let Some((upper, rank)) = at_rank(&of_upper, rank) else { return Ok((finite, 0.0)) };
        let of_lower = self.keys(device, a, count, Some(upper))?;
        let (lower, _) = at_rank(&of_lower, rank).unwrap_or_default();
        let key = (upper << 16 | lower) as u32;
        Ok((finite, f32::from_bits(if key >> 31 == 1 { key ^ 0x8000_0000 } else { !key })))
    }

    /// The number of floats per upper half of their key, or per lower half of those with this upper half.
    fn keys(&mut self, device: &Device, a: &Buffer, count: usize, upper: Option<usize>) -> Result<Vec<u32>> {
        self.take_count(device, &[a], count)?;
        let upper = device.upload(&upper.map_or(-1, |upper| upper as i32).to_ne_bytes(), 0)?;
        let buffer = device.upload(&vec![0; HALVES * size_of::<u32>()], 0)?;
        let arguments = [("count", &self.count), ("upper", &upper), ("a", a), ("counts", &buffer)];
        device.run(&COUNT_KEYS, &arguments, count.div_ceil(BLOCK))?;
        let mut counts = vec![0; HALVES];
        device.read(&buffer, 0, &mut counts)?;
        Ok(counts)
    }
}

/// The place of the value of a rank in a table of counts, and its rank among those of the place; `None` if there are fewer values.
fn at_rank(counts: &[u32], mut rank: u64) -> Option<(usize, u64)> {
    for (place, count) in counts.iter().enumerate() {
        match rank.checked_sub(u64::from(*count)) {
            Some(left) => rank = left,
            None => return Some((place, rank)),
        }
    }
    None
}

/// The total of the blocks' sums, in their order.
fn total(partials: &[[f32; 2]]) -> f64 {
    partials.iter().map(|[sum, lost]| f64::from(*sum) + f64::from(*lost)).sum()
}
