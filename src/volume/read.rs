//! Which format a body has, and the limits that all formats share.

use super::inflate::Source;
use super::raw::RawParams;
use super::samples::RawType;
use super::{Volume, nifti, nrrd, raw};
use crate::error::{Error, Result};

/// The formats read, in words for the sender of another one.
pub const FORMATS: &str = "NIfTI-1 (.nii, .nii.gz), NRRD with its data attached (.nrrd; raw or gzip), \
    or raw voxels with ?dims=NX,NY,NZ&type=u8&spacing=1,1,1";

/// Names are for people; what is longer is cut.
const MAX_NAME: usize = 120;

/// How large a volume may be.
#[derive(Debug, Clone, Copy)]
pub struct VolumeLimits {
    /// Bytes of its voxels once decoded.
    pub max_volume_bytes: u64,
    /// Voxels along its longest side.
    pub max_side: usize,
}

impl Default for VolumeLimits {
    /// 1 GiB, the least that OpenCL devices of today promise for one buffer, and 4096 a side.
    fn default() -> Self {
        Self { max_volume_bytes: 1 << 30, max_side: 4096 }
    }
}

/// Reads a volume. With `raw` the body is taken for bare voxels, whatever it looks like; otherwise its content says
/// what it is (its name does not matter).
///
/// # Errors
/// [`Error::UnsupportedMediaType`] for an unknown format, [`Error::TooLarge`] above the limits, and [`Error::Invalid`]
/// with `header:FIELD` or `query:NAME` as pointer for a body that contradicts itself.
pub fn read(bytes: &[u8], name: &str, raw: Option<RawParams>, limits: &VolumeLimits) -> Result<Volume> {
    if bytes.is_empty() {
        return Err(Error::invalid("", "the body is empty", FORMATS));
    }
    let name = clean_name(name);
    if let Some(params) = raw {
        return raw::read(bytes, &name, &params, limits);
    }
    if Source::is_gzip(bytes) {
        let mut start = [0; nifti::HEADER_BYTES];
        let got = Source::gzip(bytes).fill(&mut start)?;
        return match nifti::is_nifti(&start[..got]) {
            true => nifti::read(Source::gzip(bytes), &name, limits),
            false => Err(unsupported("gzip of something that is not NIfTI-1")),
        };
    }
    if bytes.starts_with(b"NRRD") {
        return nrrd::read(bytes, &name, limits);
    }
    if nifti::is_nifti(bytes) {
        return nifti::read(Source::plain(bytes), &name, limits);
    }
    Err(unsupported(if nifti::is_nifti_2(bytes) { "NIfTI-2" } else { "in no known volume format" }))
}

fn unsupported(what: &str) -> Error {
    Error::UnsupportedMediaType(format!("the body is {what}; this service reads {FORMATS}"))
}

/// A name without control characters, of bearable length.
fn clean_name(name: &str) -> String {
    let clean: String = name.trim().chars().filter(|c| !c.is_control()).take(MAX_NAME).collect();
    if clean.is_empty() { "volume".to_owned() } else { clean }
}

/// The sizes as dimensions and their product, if they are within the limits: asked before anything is allocated.
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
