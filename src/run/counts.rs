//! The kernels' counters of a picture's samples, as they are read from the device.

use super::context::DeviceContext;
use crate::device::Buffer;
use crate::device::enums::{Count, DeviceEnum};
use crate::error::Result;
use crate::job::SampleCounts;
use crate::technique::Random;

/// Energy is counted in this part of the luminance that brighter samples are scaled down to.
const UNIT: f64 = 1.0 / 65536.0;

/// Reads the counters.
///
/// # Errors
/// [`crate::error::Error::Internal`] if OpenCL fails.
pub(super) fn read(context: &DeviceContext, buffer: &Buffer, random: Option<Random>) -> Result<SampleCounts> {
    let mut counts = [0u32; Count::LENGTH];
    context.device.read(buffer, 0, &mut counts)?;
    let of = |count: Count| counts[count as usize];
    let unit = random.and_then(|r| r.clamp_luminance).unwrap_or(0.0) * UNIT;
    let clamped = u64::from(of(Count::ClampedEnergyHigh)) << 32 | u64::from(of(Count::ClampedEnergyLow));
    Ok(SampleCounts {
        non_finite: of(Count::NonFinite),
        fireflies: of(Count::Fireflies),
        clamped: of(Count::Clamped),
        broken: of(Count::Broken),
        clamped_luminance: clamped as f64 * unit,
        cut: of(Count::Cut),
    })
}
