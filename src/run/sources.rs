//! Every kernel of this program, and those that are compiled before somebody asks for them.

use crate::device::program::{Source, Variant};
use crate::device::{cells, encode, reduce};
use crate::error::{Error, Result};
use crate::technique;
use crate::volume::VoxelType;

/// Every kernel that there is.
pub fn sources() -> impl Iterator<Item = Source> {
    technique::all().map(|t| (t.source)()).chain(cells::sources()).chain([encode::source(), reduce::source()])
}

/// The source of a variant.
pub(super) fn source_of(variant: &Variant) -> Result<Source> {
    let missing = || Error::internal(format!("{} is no kernel of this program", variant.label()));
    sources().find(|s| s.kernel == variant.kernel).ok_or_else(missing)
}

/// What the first picture needs, most likely: the first technique on words, which the floats of built-in volumes are taken as, and on
/// bytes, and what films are encoded by.
pub(super) fn first() -> Vec<Variant> {
    let views = technique::ALL.first().map_or(Vec::new(), |t| ((t.source)().variants)());
    let of =
        |voxel| views.iter().find(move |v| v.voxel == Some(voxel)).copied().into_iter().chain(cells::needed(voxel));
    of(VoxelType::U16).chain(of(VoxelType::U8)).chain((encode::source().variants)()).collect()
}

/// What is compiled ahead, the likeliest first.
pub(super) fn common() -> Vec<Variant> {
    sources().flat_map(|s| (s.variants)().into_iter().take(s.common).collect::<Vec<_>>()).collect()
}
