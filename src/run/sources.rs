//! All kernels of this program, and the variants that are compiled before somebody asks for them.

use crate::device::program::{Source, Variant};
use crate::device::{cells, encode, grid, reduce, variance};
use crate::error::{Error, Result};
use crate::technique;
use crate::volume::VoxelType;

/// All kernels.
pub fn sources() -> impl Iterator<Item = Source> {
    technique::all().map(|t| (t.source)()).chain(cells::sources()).chain([
        encode::source(),
        grid::source(),
        reduce::source(),
        variance::source(),
    ])
}

/// The source of a variant.
pub(super) fn source_of(variant: &Variant) -> Result<Source> {
    let missing = || Error::internal(format!("{} is no kernel of this program", variant.label()));
    sources().find(|s| s.kernel == variant.kernel).ok_or_else(missing)
}

/// The variants that the first picture most likely needs: the first technique on words, as which the floats of built-in volumes are taken, and on
/// bytes, the encoder of films, and the kernel that tells where they vary.
pub(super) fn first() -> Vec<Variant> {
    let views = technique::ALL.first().map_or(Vec::new(), |t| ((t.source)().variants)());
    let of =
        |voxel| views.iter().find(move |v| v.voxel == Some(voxel)).copied().into_iter().chain(cells::needed(voxel));
    let of_films = [encode::source(), variance::source()].into_iter().flat_map(|source| (source.variants)());
    of(VoxelType::U16).chain(of(VoxelType::U8)).chain(of_films).collect()
}

/// The variants that are compiled ahead, the likeliest first.
pub(super) fn common() -> Vec<Variant> {
    sources().flat_map(|s| (s.variants)().into_iter().take(s.common).collect::<Vec<_>>()).collect()
}
