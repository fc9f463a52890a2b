//! Parameters and numbers of `kernels/photon_transport.cl`.

use crate::{device_enum, device_struct};

/// Words of a lane that a launch leaves to the next: a photon, its steps and its mask.
pub const STATE_WORDS: usize = 21;

device_enum! {
    /// The geometry of the media (`kernels/shared/medium.h`).
    pub enum Media: "MEDIA" {
        /// One everywhere.
        Uniform,
        /// One per layer along z.
        Layers,
        /// One per voxel, by its label.
        Labels,
        /// One whose extinction is times a voxel's density.
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
    /// The boundary condition at an end of the media.
    pub enum BoundaryKind: "BOUNDARY" {
        /// Nothing.
        Absorbing,
        /// The other side.
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
    /// Entries of the ledger before the histogram. The first ten are weights that add up to all that was launched, the next two are parts
    /// of exits; the others count.
    pub enum LedgerEntry: "LEDGER" {
        /// Left at x = 0. The exits are in the order of axes, the lower end of each first.
        ExitMinusX,
        /// Left at the other end of x.
        ExitPlusX,
        /// Left at y = 0.
        ExitMinusY,
        /// Left at the other end of y.
        ExitPlusY,
        /// Left at z = 0.
        ExitMinusZ,
        /// Left at the other end of z.
        ExitPlusZ,
        /// Absorbed.
        Absorbed,
        /// Lost in the roulette (or gained: below 0), by faults, or past the box.
        Lost,
        /// Reflected where the beam enters.
        Specular,
        /// Taken out by the time gate.
        Gated,
        /// Left at z = 0 without a scattering.
        UnscatteredMinusZ,
        /// Left at the other end of z without a scattering.
        UnscatteredPlusZ,
        /// Scatterings.
        Scatterings,
        /// Photons of too many steps, or whose weight is not finite.
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
        /// One work-item in so many works.
        pub stride: u32,
        /// 1 if each working item has a grid of its own, and takes histories until there are no more.
        pub own_grids: i32,
        /// The entry of the ledger that counts the histories that have been taken.
        pub taken_at: i32,
        /// Steps that a work-item may take in this launch.
        pub most_steps: u32,
        /// 1 if the work-items go on with what the launch before has left.
        pub resumed: i32,
        /// The seed, low and high word.
        pub seed: [u32; 2],
    }
}

device_struct! {
    /// The kernel's own parameters. Lengths are in mm from the box's corner; `at_` is the place in the table at which something starts.
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
        /// 1 if they go further than the grid.
        pub endless: i32,
        /// A `BoundaryKind` per axis.
        pub boundary: [i32; 3],
        /// Cells of the DDA along each axis.
        pub cells: [i32; 3],
        /// Sides of a cell.
        pub cell_mm: [f32; 3],
        /// Cells per mm; 0 where there is but one cell.
        pub cells_per_mm: [f32; 3],
        /// Media that the table has room for.
        pub media: i32,
        /// The refractive index, where there is but one.
        pub index: f32,
        /// Layers.
        pub layers: i32,
        /// Ends of the layers, from 0 on.
        pub at_layers: i32,
        /// Labels or densities of the voxels.
        pub at_voxels: i32,
        /// Bytes of a label: 1 or 2. Where voxels are cells, a byte with its clearance follows.
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
        /// The axis that radii count from.
        pub beam_mm: [f32; 2],
        /// Refractive index outside.
        pub outside_index: f32,
        /// 1 if the outer faces reflect and refract.
        pub fresnel: i32,
        /// 1 if what they reflect of the beam is lost.
        pub specular_entry: i32,
        /// 1 if refractive indices differ inside.
        pub mismatch: i32,
        /// Optical path after which a photon is taken out.
        pub gate_mm: f32,
        /// The march's step.
        pub march_step_mm: f32,
        /// A `SourceKind`.
        pub source_type: i32,
        /// Its position.
        pub source: [f32; 3],
        /// Its direction, unit length.
        pub source_axis: [f32; 3],
        /// Its edges, or the axes of its disk times its radius.
        pub source_u: [f32; 3],
        /// See `source_u`.
        pub source_v: [f32; 3],
        /// Cosine of the cone's half angle; -1 for all directions.
        pub source_cos_from: f32,
        /// Weights below this meet the roulette.
        pub roulette_threshold: f32,
        /// Probability to survive it.
        pub roulette_survival: f32,
        /// The quantity in the grid: a `Tally`.
        pub tally: i32,
        /// Deposits of length are times this.
        pub deposit_scale: f32,
        /// Paths are counted times this.
        pub paths_per_mm: f32,
        /// A photon that takes more steps than this is trapped, or has met a fault of arithmetic; it is counted as lost.
        pub most_steps: i32,
        /// Energy of the source's gamma photons.
        pub source_kev: f32,
        /// Energy below which they are absorbed.
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
