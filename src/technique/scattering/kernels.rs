//! The kernels of scattering views and their variants.

use super::device::{Density, Scattering};
use crate::device::Resume;
use crate::device::enums::{DeviceEnum, LightKind, PhaseKind};
use crate::device::numbers::define;
use crate::device::program::{Source, Variant, listed};
use crate::device::structs::{DeviceStruct, View};
use crate::error::Result;
use crate::scene::interpolation::Interpolation;
use crate::scene::lights::LIGHT_NUMBERS;
use crate::technique::majorant::Tracking;
use crate::technique::view::{TILE, TILES_HEADER};
use crate::technique::view_words;
use crate::volume::VoxelType;

/// Words of a lane that a launch leaves to the next: a sample of `single_scatter`, which is larger than a path, and its mask.
pub(super) const STATE_WORDS: usize = 54;

pub(super) type Features = [(&'static str, i32); 3];

pub(super) const fn of(density: Density, tracking: Tracking, interpolation: Interpolation) -> Features {
    [("DENSITY", density.code()), ("TRACKING", tracking.code()), ("INTERPOLATION", interpolation.code())]
}

/// Every set of features that may be built: the box, whose density is the same everywhere, and each tracker through a grid.
static FEATURES: [Features; 8] = {
    use Interpolation::{Nearest, Trilinear};
    [
        of(Density::Grid, Tracking::Delta, Trilinear),
        of(Density::Constant, Tracking::Exact, Nearest),
        of(Density::Grid, Tracking::Delta, Nearest),
        of(Density::Grid, Tracking::Exact, Nearest),
        of(Density::Grid, Tracking::March, Trilinear),
        of(Density::Grid, Tracking::March, Nearest),
        of(Density::Grid, Tracking::Weighted, Trilinear),
        of(Density::Grid, Tracking::Weighted, Nearest),
    ]
};

pub(in crate::technique) fn source(kernel: &'static str) -> Source {
    Source {
        kernel,
        words: || {
            "#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable\n".to_owned()
                + &view_words()
                + &[define("LIGHT_NUMBERS", LIGHT_NUMBERS), define("TILE", TILE), define("TILES_HEADER", TILES_HEADER)]
                    .concat()
                + &[Density::opencl_text(), Tracking::opencl_text()].concat()
                + &[PhaseKind::opencl_text(), LightKind::opencl_text()].concat()
                + &Resume::opencl_text("SCATTERING", STATE_WORDS)
        },
        structs: || vec![View::LAYOUT, Scattering::LAYOUT],
        variants: match kernel {
            "single_scatter" => || variants("single_scatter"),
            _ => || variants("volume_path"),
        },
        common: 1,
    }
}

/// The listed variant of a technique with those features.
///
/// # Errors
/// [`crate::error::Error::Internal`] if there is none.
pub(super) fn permitted(kernel: &str, wanted: Features) -> Result<&'static Features> {
    listed(kernel, &FEATURES, wanted)
}

/// The variants of a kernel. The first is a built-in's.
fn variants(kernel: &'static str) -> Vec<Variant> {
    let mut types = VoxelType::ALL;
    types.reverse();
    let of = |features: &'static Features| types.map(|t| Variant::new(kernel, Some(t), features));
    FEATURES.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use crate::scene::lights::{LightSource, Lights};
    use crate::scene::phase::Phase;
    use serde_json::json;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted("volume_path", of(Density::Grid, Tracking::March, Interpolation::Nearest)).is_ok());
        let said = permitted("volume_path", of(Density::Constant, Tracking::March, Interpolation::Nearest))
            .expect_err("not listed")
            .to_string();
        assert!(said.contains("volume_path DENSITY=0 TRACKING=1 INTERPOLATION=0"), "{said}");
    }

    /// The type of a light or a phase function gives the number of its kind in the kernels.
    #[test]
    fn kinds_of_lights_and_phases_are_the_devices() {
        let lights = json!([{"type": "sun"}, {"type": "point", "position": [0, 0, 1]},
            {"type": "sphere", "position": [0, 0, 1], "radius": 1},
            {"type": "quad", "corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}]);
        let request: Vec<LightSource> = serde_json::from_value(lights).expect("lights");
        let table = Lights::from_request(Some(&request), "").expect("lights").table(1.0, glam::DVec3::Y);
        let kinds: Vec<i32> = table.chunks(scene::lights::LIGHT_NUMBERS).map(|light| light[0] as i32).collect();
        assert_eq!(kinds, LightKind::ALL.iter().map(|kind| kind.code()).collect::<Vec<_>>());
        for (value, kind) in [
            (json!({"type": "isotropic"}), PhaseKind::Lobes),
            (json!({"type": "henyey_greenstein"}), PhaseKind::Lobes),
            (json!({"type": "two_term_henyey_greenstein"}), PhaseKind::Lobes),
            (json!({"type": "rayleigh"}), PhaseKind::Rayleigh),
            (json!({"type": "tabulated", "cosines": [-1, 1], "densities": [1, 1]}), PhaseKind::Table),
        ] {
            let phase: Phase = serde_json::from_value(value).expect("a phase function");
            assert_eq!(phase.numbers(&mut Vec::new(), 0)[0] as i32, kind.code(), "{}", phase.kind);
        }
    }
}
