//! Parameters of the kernels of scattering views.

use crate::{device_enum, device_struct};

device_enum! {
    /// The variation of density in the volume.
    pub enum Density: "DENSITY" {
        /// The same density everywhere.
        Constant,
        /// A density that is interpolated between voxels.
        Grid,
    }
}

device_struct! {
    /// The kernels' own parameters. Positions are in index units, lengths in world units. An `at_` field is the index in the table at which something
    /// starts.
    pub struct Scattering {
        /// Column-major map from index to world, three rows and four columns.
        pub world_from_index: [f32; 12],
        /// Cells of the DDA along each axis.
        pub cells: [i32; 3],
        /// Voxels along a cell's sides.
        pub voxels_per_cell: [f32; 3],
        /// Cells per voxel; 0 if there is but one cell.
        pub cells_per_voxel: [f32; 3],
        /// 1 if one majorant stands for the whole volume.
        pub whole: i32,
        /// density = raw × scale + offset, from 0 to `density_most`.
        pub density_scale: f32,
        /// See `density_scale`.
        pub density_offset: f32,
        /// See `density_scale`.
        pub density_most: f32,
        /// The density if it is the same everywhere.
        pub density_box: f32,
        /// Extinction at a density of 1, by colour.
        pub sigma_t: [f32; 3],
        /// The greatest of them.
        pub sigma_most: f32,
        /// The three extinctions over the greatest.
        pub colour: [f32; 3],
        /// 1 if they differ.
        pub chromatic: i32,
        /// Majorant at a density of 1: the whole volume's if there is but one, or the extinction if it is the same everywhere.
        pub majorant: f32,
        /// The march's step.
        pub march_step: f32,
        /// The scattered part of a collision, by colour.
        pub albedo: [f32; 3],
        /// Radiance emitted per unit of optical depth, by colour.
        pub emission: [f32; 3],
        /// Refractive index.
        pub index: f32,
        /// Kind and parameters of the phase function, see `kernels/shared/phase.h`.
        pub phase: [f32; 4],
        /// Lights besides the sky.
        pub lights: i32,
        /// The lights' place in the table.
        pub at_lights: i32,
        /// 1 if rays can meet any of the lights.
        pub discs: i32,
        /// 1 if there is a sky.
        pub sky: i32,
        /// 1 if the eye sees the sky.
        pub sky_visible: i32,
        /// The sky's radiance straight above.
        pub sky_zenith: [f32; 3],
        /// The sky's radiance at the horizon.
        pub sky_horizon: [f32; 3],
        /// The sky's radiance straight below.
        pub sky_ground: [f32; 3],
        /// The sky's up direction.
        pub sky_up: [f32; 3],
        /// 1 if a ray in any direction may meet light: a sky, lights that have a size, or emission.
        pub lit_by_chance: i32,
        /// 1 if next-event estimation aims at lights.
        pub next_event: i32,
        /// The number of scatterings after which a path ends at its next collision.
        pub max_scatterings: i32,
        /// Light below this plays Russian roulette.
        pub roulette_threshold: f32,
        /// The luminance that brighter samples are scaled down to; 0 for no limit.
        pub clamp_luminance: f32,
        /// 1 if points on a ray are also sampled by the angle to a light (equiangular sampling).
        pub equiangular: i32,
        /// The mean extinction.
        pub sigma_mean: f32,
    }
}
