//! Parameters and numbers of `kernels/photon_transport.cl`.

use crate::{device_enum, device_struct};

/// Words of a lane that a launch leaves to the next: a photon, its steps and its mask.
pub const STATE_WORDS: usize = 21;

device_enum! {
    /// The geometry of the media (`kernels/shared/medium.h`).
    pub enum Media: "MEDIA" {
        /// One medium everywhere.
        Uniform,
        /// One medium per layer along z.
        Layers,
        /// One medium per voxel, by its label.
        Labels,
        /// One medium, whose extinction is multiplied by a voxel's density.
        Density,
    }
}

device_enum! {
    /// Numbers of a medium in the table.
    pub enum MediumNumber: "MEDIUM" {
        /// Extinction per mm.
        Extinction,
        /// Albedo.
        Albedo,
        /// Refractive index.
        Index,
        /// Kind of its phase function.
        Phase,
        /// Three parameters of the kind.
        PhaseA,
        /// See `PhaseA`.
        PhaseB,
        /// See `PhaseA`.
        PhaseC,
    }
}

device_enum! {
    /// The boundary condition at an end of the media. An absorbing boundary lets photons out, a cyclic one brings them back on the other side, and a
    /// mirror reflects them.
    pub enum BoundaryKind: "BOUNDARY" {
        /// Absorbing.
        Absorbing,
        /// Cyclic.
        Cyclic,
        /// A mirror.
        Mirror,
    }
}

device_enum! {
    /// The quantity in the grid, and its estimator.
    pub enum Tally: "TALLY" {
        /// Absorbed energy, by collisions.
        Absorbed,
        /// Fluence, by collisions.
        Fluence,
        /// Fluence, by track length.
        FluenceTrack,
        /// Radiance towards the eye, by collisions.
        Gather,
        /// Absorbed energy, by track length.
        AbsorbedTrack,
    }
}

device_enum! {
    /// The kinds of source (`kernels/shared/photon.h`).
    pub enum SourceKind: "SOURCE" {
        /// One ray.
        Pencil,
        /// A point that shines everywhere.
        Isotropic,
        /// Parallel rays from a parallelogram.
        Planar,
        /// Parallel rays from a disk.
        Disk,
        /// A point that shines into a cone.
        Cone,
        /// A Lambertian disk.
        Diffuse,
    }
}

device_enum! {
    /// Entries of the ledger before the histogram. The first ten are weights that sum to the launched weight, the next two are parts of exits; the
    /// others are counts.
    pub enum LedgerEntry: "LEDGER" {
        /// Weight that left at x = 0. The exits are in the order of axes, the lower end of each first.
        ExitMinusX,
        /// Weight that left at the other end of x.
        ExitPlusX,
        /// Weight that left at y = 0.
        ExitMinusY,
        /// Weight that left at the other end of y.
        ExitPlusY,
        /// Weight that left at z = 0.
        ExitMinusZ,
        /// Weight that left at the other end of z.
        ExitPlusZ,
        /// Absorbed weight.
        Absorbed,
        /// Weight that was lost in the roulette (negative if gained), by faults, or past the box.
        Lost,
        /// Weight that was reflected at the beam's entry.
        Specular,
        /// Weight that the time gate removed.
        Gated,
        /// Weight that left at z = 0 without a scattering.
        UnscatteredMinusZ,
        /// Weight that left at the other end of z without a scattering.
        UnscatteredPlusZ,
        /// Scatterings.
        Scatterings,
        /// Photons that took too many steps, or whose weight is not finite.
        Faults,
        /// Collisions at which the majorant was below the extinction.
        Broken,
        /// Photons that flew past the box.
        Missed,
        /// Length of paths, in units of `Simulation::path_unit_mm`.
        Path,
    }
}

device_struct! {
    /// The histories of a launch.
    pub struct FieldPass {
        /// Number of the first history, low and high word.
        pub first: [u32; 2],
        /// Histories in this launch.
        pub count: u32,
        /// Histories that a work-item takes at a time.
        pub per_item: u32,
        /// The stride of working items: one work-item in `stride` works.
        pub stride: u32,
        /// 1 if each working item has a grid of its own and takes shares of histories until there are none.
        pub own_grids: i32,
        /// The entry of the ledger that counts the histories taken so far.
        pub taken_at: i32,
        /// Steps that a work-item may take in this launch.
        pub most_steps: u32,
        /// 1 if the work-items resume the state that the launch before has left.
        pub resumed: i32,
        /// The seed, low and high word.
        pub seed: [u32; 2],
    }
}

device_struct! {
    /// The kernel's own parameters. Lengths are in mm from the box's corner. An `at_` field is the index in the table at which something starts.
    pub struct PhotonTransport {
        /// Voxels along x, y, z.
        pub grid: [i32; 3],
        /// Their sides.
        pub voxel_mm: [f32; 3],
        /// Voxels per mm along x, y, z.
        pub voxels_per_mm: [f32; 3],
        /// Size of the grid.
        pub size_mm: [f32; 3],
        /// The lower ends of the media.
        pub low_mm: [f32; 3],
        /// Their upper ends.
        pub high_mm: [f32; 3],
        /// 1 if the media extend further than the grid.
        pub endless: i32,
        /// A `BoundaryKind` per axis.
        pub boundary: [i32; 3],
        /// Cells of the DDA along each axis.
        pub cells: [i32; 3],
        /// Sides of a cell.
        pub cell_mm: [f32; 3],
        /// Cells per mm; 0 if there is but one cell.
        pub cells_per_mm: [f32; 3],
        /// The number of media that the table has room for.
        pub media: i32,
        /// The refractive index, if there is but one.
        pub index: f32,
        /// Layers.
        pub layers: i32,
        /// Ends of the layers, from 0 on.
        pub at_layers: i32,
        /// Labels or densities of the voxels.
        pub at_voxels: i32,
        /// Bytes of a label: 1 or 2. If voxels are cells, a byte with the voxel's clearance follows.
        pub label_bytes: i32,
        /// Majorants of the blocks.
        pub at_blocks: i32,
        /// Edges of the histogram's radii.
        pub at_radii: i32,
        /// Cosines of the edges of its angles.
        pub at_cosines: i32,
        /// Bins by radius.
        pub radius_bins: i32,
        /// Bins by angle.
        pub angle_bins: i32,
        /// The axis from which radii are measured.
        pub beam_mm: [f32; 2],
        /// Refractive index outside.
        pub outside_index: f32,
        /// 1 if the outer faces reflect and refract.
        pub fresnel: i32,
        /// 1 if the part of the beam that they reflect is lost.
        pub specular_entry: i32,
        /// 1 if refractive indices differ inside.
        pub mismatch: i32,
        /// Optical path at which the time gate removes a photon.
        pub gate_mm: f32,
        /// The march's step.
        pub march_step_mm: f32,
        /// A `SourceKind`.
        pub source_type: i32,
        /// Its position.
        pub source: [f32; 3],
        /// Its direction, unit length.
        pub source_axis: [f32; 3],
        /// Its edges, or the axes of its disk times the disk's radius.
        pub source_u: [f32; 3],
        /// See `source_u`.
        pub source_v: [f32; 3],
        /// Cosine of the cone's half angle; -1 for all directions.
        pub source_cos_from: f32,
        /// Weights below this play Russian roulette.
        pub roulette_threshold: f32,
        /// The probability of surviving it.
        pub roulette_survival: f32,
        /// The quantity in the grid: a `Tally`.
        pub tally: i32,
        /// The scale of deposits of length.
        pub deposit_scale: f32,
        /// The scale of paths in the ledger.
        pub paths_per_mm: f32,
        /// A photon that takes more steps than this is trapped, or has met a fault of arithmetic; it is counted as lost.
        pub most_steps: i32,
        /// Energy of the source's gamma photons.
        pub source_kev: f32,
        /// Energy below which gamma photons are absorbed.
        pub gamma_least_kev: f32,
        /// Its logarithm to the base 2.
        pub gamma_least_log2: f32,
        /// Rows of the attenuation tables per octave of energy.
        pub gamma_rows_per_log2: f32,
        /// Attenuation and albedo of each medium by energy.
        pub at_gamma: i32,
        /// The eye of the gather.
        pub eye_mm: [f32; 3],
    }
}
