//! The variants of the kernel of `emission_absorption`.

use super::pieces::PIECES;
use super::{EmissionAbsorption, TECHNIQUE};
use crate::device::Resume;
use crate::device::numbers::define;
use crate::device::program::{Source, each_voxel_type, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene::interpolation::Interpolation;
use crate::scene::transfer::TABLE_SIZE;
use crate::scene::transfer_table::KNOTS;
use crate::technique::view_words;
use crate::volume::VoxelType;

/// Words of a lane that a launch leaves to the next: a packet's radiance and transmittance.
pub(super) const STATE_WORDS: usize = 4;

pub(super) type Features = [(&'static str, i32); 5];

pub(super) const fn features(
    interpolation: Interpolation,
    shaded: bool,
    reversed: bool,
    styled: bool,
    pre: bool,
) -> Features {
    [
        ("INTERPOLATION", interpolation.code()),
        ("SHADED", shaded as i32),
        ("BACK_TO_FRONT", reversed as i32),
        ("STYLED", styled as i32),
        ("PREINTEGRATED", pre as i32),
    ]
}

pub(super) const fn plain(interpolation: Interpolation, shaded: bool) -> Features {
    features(interpolation, shaded, false, false, false)
}

pub(super) const fn styled(interpolation: Interpolation) -> Features {
    features(interpolation, false, false, true, false)
}

/// Every set of features that may be built; the first two are built before the service is ready.
static FEATURES: [Features; 16] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        plain(Trilinear, false),
        plain(Trilinear, true),
        features(Trilinear, false, true, false, false),
        features(Trilinear, true, true, false, false),
        features(Trilinear, false, false, false, true),
        features(Trilinear, true, false, false, true),
        plain(Nearest, false),
        plain(Nearest, true),
        plain(BSpline, false),
        plain(BSpline, true),
        plain(CatmullRom, false),
        plain(CatmullRom, true),
        styled(Trilinear),
        styled(Nearest),
        styled(BSpline),
        styled(CatmullRom),
    ]
};
const COMMON: usize = 2;

/// The listed features that are `wanted`. `check_together` refuses every combination that is not listed.
pub(super) fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

pub(super) fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: || {
            view_words()
                + &[define("TABLE_SIZE", TABLE_SIZE), define("PIECES", PIECES), define("KNOTS", KNOTS)].concat()
                + &Resume::opencl_text_of_beams("RADIANCE", STATE_WORDS)
        },
        structs: || vec![DeviceView::LAYOUT, EmissionAbsorption::LAYOUT],
        variants: || each_voxel_type(TECHNIQUE.name, &FEATURES),
        common: COMMON * VoxelType::ALL.len(),
    }
}
