//! The limits of a volume's size, checked before anything is allocated for it.

use super::samples::RawType;
use crate::error::{Error, Result};

/// The limits of a volume's size.
#[derive(Debug, Clone, Copy)]
pub struct VolumeLimits {
    /// The most bytes of its voxels once decoded.
    pub max_volume_bytes: u64,
    /// The most voxels along its longest side.
    pub max_side: usize,
}

impl Default for VolumeLimits {
    /// The default limits: 1 GiB, the least that OpenCL devices of today promise for one buffer, and 4096 a side.
    fn default() -> Self {
        Self { max_volume_bytes: 1 << 30, max_side: 4096 }
    }
}

/// The sizes as dimensions and their product, if they are within the limits. This is checked before anything is allocated.
pub(super) fn checked_count(
    sizes: [u64; 3],
    raw: RawType,
    limits: &VolumeLimits,
    pointer: &str,
) -> Result<([usize; 3], usize)> {
    let permitted = || format!("1 to {} along each axis", limits.max_side);
    let mut dims = [0; 3];
    for (dim, size) in dims.iter_mut().zip(sizes) {
        *dim = usize::try_from(size).unwrap_or(usize::MAX);
        if !(1..=limits.max_side).contains(dim) {
            return Err(Error::invalid(pointer, format!("a side of {size} voxels"), permitted()));
        }
    }
    let count = dims.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
    let bytes = count.and_then(|count| (count as u64).checked_mul(raw.kept_as().bytes() as u64));
    match (count, bytes) {
        (Some(count), Some(bytes)) if bytes <= limits.max_volume_bytes => Ok((dims, count)),
        _ => Err(Error::TooLarge {
            what: format!("a volume of {} x {} x {} voxels", dims[0], dims[1], dims[2]),
            limit: format!("{} bytes of voxels", limits.max_volume_bytes),
        }),
    }
}
