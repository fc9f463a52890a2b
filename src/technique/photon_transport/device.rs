//! What `kernels/photon_transport.cl` is told.

use crate::device_struct;

device_struct! {
    /// Which histories a launch takes.
    pub struct FieldPass {
        /// Number of the first history, low and high word.
        pub first: [u32; 2],
        /// Histories in this launch.
        pub count: u32,
        /// Histories that a work-item takes at a time.
        pub per_item: u32,
        /// One work-item in so many works.
        pub stride: u32,
        /// Whether each working item has a grid of its own, and takes histories until there are no more.
        pub own_grids: i32,
        /// Where in the ledger it says how many have been taken.
        pub taken_at: i32,
        /// The seed, low and high word.
        pub seed: [u32; 2],
    }
}

device_struct! {
    /// The kernel's own parameters. Lengths are in mm from the box's corner; `at_` says where in the table something starts.
    pub struct PhotonTransport {
        /// Voxels along x, y, z.
        pub grid: [i32; 3],
        /// Their sides.
        pub voxel_mm: [f32; 3],
        /// Voxels per mm along x, y, z.
        pub voxels_per_mm: [f32; 3],
        /// Size of the grid.
        pub size_mm: [f32; 3],
        /// Where the media start.
        pub low_mm: [f32; 3],
        /// Where they end.
        pub high_mm: [f32; 3],
        /// Whether they go further than the grid.
        pub endless: i32,
        /// What is at their ends: 0 nothing (absorbing), 1 the other side (cyclic), 2 a mirror.
        pub boundary: [i32; 3],
        /// Cells between walls, along each axis.
        pub walls: [i32; 3],
        /// From wall to wall.
        pub wall_mm: [f32; 3],
        /// Walls per mm; 0 where there is but one cell.
        pub walls_per_mm: [f32; 3],
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
        /// Bytes of a label: 1 or 2. With voxels' walls a byte follows that says how far around it is the same.
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
        /// Whether the outer faces reflect and refract.
        pub fresnel: i32,
        /// Whether what they reflect of the beam is lost.
        pub specular_entry: i32,
        /// Whether refractive indices differ inside.
        pub mismatch: i32,
        /// Optical path after which a photon is taken out.
        pub gate_mm: f32,
        /// The march's step.
        pub march_step_mm: f32,
        /// The source's number.
        pub source_type: i32,
        /// Where it is.
        pub source: [f32; 3],
        /// Where it shines, unit length.
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
        /// What is added up: see the `TALLY_` names.
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
        /// What the gather looks from.
        pub eye_mm: [f32; 3],
    }
}
