//! The recognition of a body's format, and the limits that all formats share.

use super::inflate::{Source, is_gzip};
use super::limits::VolumeLimits;
use super::raw::RawParams;
use super::{Volume, nifti, nrrd, raw};
use crate::error::{Error, Result};

/// The formats read, in words for the sender of another one.
pub const FORMATS: &str = "NIfTI-1 (.nii, .nii.gz), NRRD with its data attached (.nrrd; raw or gzip), \
    or raw voxels with ?dims=NX,NY,NZ&type=u8&spacing=1,1,1";

/// The longest name, in characters. Names are for people, and longer ones are cut.
const MAX_NAME: usize = 120;

/// Reads a volume. With `raw` the body is taken for bare voxels, whatever it looks like; otherwise its content tells its format (its name
/// does not matter).
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
    if is_gzip(bytes) {
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
