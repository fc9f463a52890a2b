//! Built-in volumes: known functions on [−1, 1]³, sampled at voxel centres, one `f32` a voxel, no length unit.
//!
//! | name | value | bounds |
//! |---|---|---|
//! | `chamber` | a room of dense walls with a round hole in its lid and fog on its floor (see [`chamber_value`]) | 0.1, 100 |
//! | `marschner_lobb` | the test signal for reconstruction filters (see [`marschner_lobb_value`]) | 0, 1 |
//! | `shepp_logan` | the head phantom in 3D, Kak & Slaney's geometry, contrast modified (see [`shepp_logan_value`]) | 0, 1 |
//! | `gaussian` | exp(−r² / 2σ²), σ = 0.3 | 0, 1 |
//! | `sphere` | 1 within radius 0.8, 0 outside, a linear edge one voxel wide | 0, 1 |
//! | `smoke` | a seeded fractal puff (see [`smoke`]) | 0, 1 |
//! | `constant` | 1 | 1, 1 |

pub mod phantom;
pub mod smoke;

pub use phantom::{ELLIPSOIDS, Ellipsoid, shepp_logan_value};

use super::voxels::Voxels;
use super::{NewVolume, Volume, parallel};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// The default number of voxels along each side.
pub const DEFAULT_RESOLUTION: usize = 128;

/// The permitted numbers of voxels along each side. Below, nothing is recognisable; above, a volume takes more than 512 MiB.
pub const RESOLUTIONS: std::ops::RangeInclusive<usize> = 8..=512;

/// The radius of `sphere`.
pub const SPHERE_RADIUS: f64 = 0.8;

/// The standard deviation of `gaussian`.
pub const GAUSSIAN_SIGMA: f64 = 0.3;

/// The density of `chamber`'s walls and lid.
pub const CHAMBER_DENSE: f64 = 100.0;
/// The density of the air in it.
pub const CHAMBER_AIR: f64 = 0.1;
/// The density of the fog on its floor at y = 0; it falls as 1 − y.
pub const CHAMBER_FOG: f64 = 5.0;
/// The fog lies below this height.
pub const CHAMBER_FOG_TOP: f64 = 0.2;
/// The lower and the upper side of the lid.
pub const CHAMBER_LID: [f64; 2] = [0.78, 0.83];
/// The square of the radius of the hole in the lid, whose axis is x = z = 0.5.
pub const CHAMBER_HOLE_RADIUS_SQUARED: f64 = 0.001;
/// The thickness of the walls at x = 0, y = 0 and z = 1.
pub const CHAMBER_WALL: f64 = 0.02;

/// The frequency of `marschner_lobb`.
pub const MARSCHNER_LOBB_FREQUENCY: f64 = 6.0;
/// The amplitude of its ripple.
pub const MARSCHNER_LOBB_ALPHA: f64 = 0.25;

/// A built-in volume.
#[derive(Debug)]
pub struct Builtin {
    /// Its name in a request.
    pub name: &'static str,
    /// The bounds of its values.
    pub bounds: [f64; 2],
    /// True if the seed changes it.
    pub seeded: bool,
}

/// Every built-in volume.
pub const BUILTINS: [Builtin; 7] = [
    Builtin { name: "chamber", bounds: [CHAMBER_AIR, CHAMBER_DENSE], seeded: false },
    Builtin { name: "marschner_lobb", bounds: [0.0, 1.0], seeded: false },
    Builtin { name: "shepp_logan", bounds: [0.0, 1.0], seeded: false },
    Builtin { name: "gaussian", bounds: [0.0, 1.0], seeded: false },
    Builtin { name: "sphere", bounds: [0.0, 1.0], seeded: false },
    Builtin { name: "smoke", bounds: [0.0, 1.0], seeded: true },
    Builtin { name: "constant", bounds: [1.0, 1.0], seeded: false },
];

/// The names, in the order of [`BUILTINS`].
pub const NAMES: [&str; 7] = {
    let mut names = [""; 7];
    let mut i = 0;
    while i < names.len() {
        names[i] = BUILTINS[i].name;
        i += 1;
    }
    names
};

/// The built-in of that name, if the resolution is permitted.
///
/// # Errors
/// [`Error::Invalid`] that points at `/volume/builtin` or `/volume/resolution`.
pub fn find(name: &str, resolution: usize) -> Result<&'static Builtin> {
    let Some(builtin) = BUILTINS.iter().find(|builtin| builtin.name == name) else {
        return Err(Error::invalid("/volume/builtin", format!("there is no built-in '{name}'"), NAMES.join(", ")));
    };
    if !RESOLUTIONS.contains(&resolution) {
        let permitted = format!("{} to {}", RESOLUTIONS.start(), RESOLUTIONS.end());
        return Err(Error::invalid("/volume/resolution", format!("is {resolution}"), permitted));
    }
    Ok(builtin)
}

/// Builds a volume of `resolution`³ voxels; `seed` matters to `smoke` alone.
///
/// # Errors
/// As [`find`].
pub fn build(name: &str, resolution: usize, seed: u64) -> Result<Volume> {
    find(name, resolution)?;
    let voxel = 2.0 / resolution as f64;
    let values = match name {
        "chamber" => sample(resolution, |x, y, z| chamber_value((x + 1.0) / 2.0, (y + 1.0) / 2.0, (z + 1.0) / 2.0)),
        "marschner_lobb" => sample(resolution, marschner_lobb_value),
        "shepp_logan" => sample(resolution, shepp_logan_value),
        "gaussian" => sample(resolution, gaussian_value),
        "sphere" => sample(resolution, |x, y, z| sphere_value(x, y, z, voxel)),
        "smoke" => sample(resolution, |x, y, z| smoke::value(x, y, z, seed)),
        _ => sample(resolution, |_, _, _| 1.0),
    };
    Volume::new(NewVolume {
        dims: [resolution; 3],
        spacing: [voxel; 3],
        linear: None,
        voxels: Voxels::F32(values),
        slope: 1.0,
        inter: 0.0,
        name: name.to_owned(),
        format: "builtin".to_owned(),
        file_affine: None,
        unit: "unit".to_owned(),
        notes: Vec::new(),
    })
}

/// The function at the voxel centres, in world coordinates.
fn sample(n: usize, value: impl Fn(f64, f64, f64) -> f64 + Sync) -> Vec<f32> {
    let world = |i: usize| (2 * i + 1) as f64 / n as f64 - 1.0;
    let mut values = vec![0.0; n * n * n];
    parallel::over_slices(&mut values, n * n, |z, slice| {
        for (y, row) in slice.chunks_mut(n).enumerate() {
            row.iter_mut().enumerate().for_each(|(x, voxel)| *voxel = value(world(x), world(y), world(z)) as f32);
        }
    });
    values
}

/// The room at a point of the unit cube: dense walls at x < 0.02, y < 0.02 and z > 0.98, a dense lid between y = 0.78
/// and 0.83 with a round hole in its middle, fog of 5(1 − y) below y = 0.2, thin air elsewhere.
pub fn chamber_value(x: f64, y: f64, z: f64) -> f64 {
    let wall = x < CHAMBER_WALL || y < CHAMBER_WALL || z > 1.0 - CHAMBER_WALL;
    let in_hole = (x - 0.5).powi(2) + (z - 0.5).powi(2) < CHAMBER_HOLE_RADIUS_SQUARED;
    let lid = y > CHAMBER_LID[0] && y < CHAMBER_LID[1] && !in_hole;
    match (wall || lid, y < CHAMBER_FOG_TOP) {
        (true, _) => CHAMBER_DENSE,
        (false, true) => (1.0 - y) * CHAMBER_FOG,
        (false, false) => CHAMBER_AIR,
    }
}

/// Marschner & Lobb, "An evaluation of reconstruction filters for volume rendering" (Visualization 1994), eq. 9:
/// ρ = (1 − sin(πz/2) + α(1 + ρᵣ(√(x² + y²)))) / 2(1 + α), ρᵣ(r) = cos(2π f cos(πr/2)), f = 6, α = 0.25.
///
/// 40³ samples are just above its Nyquist rate, so that a filter's errors are visible there.
pub fn marschner_lobb_value(x: f64, y: f64, z: f64) -> f64 {
    let ripple = (2.0 * PI * MARSCHNER_LOBB_FREQUENCY * (PI * x.hypot(y) / 2.0).cos()).cos();
    let alpha = MARSCHNER_LOBB_ALPHA;
    (1.0 - (PI * z / 2.0).sin() + alpha * (1.0 + ripple)) / (2.0 * (1.0 + alpha))
}

/// exp(−r² / 2σ²).
pub fn gaussian_value(x: f64, y: f64, z: f64) -> f64 {
    (-(x * x + y * y + z * z) / (2.0 * GAUSSIAN_SIGMA * GAUSSIAN_SIGMA)).exp()
}

/// 1 inside, 0 outside, and linear in the distance over one voxel, so that the value ½ lies on the sphere.
fn sphere_value(x: f64, y: f64, z: f64, voxel: f64) -> f64 {
    ((SPHERE_RADIUS - (x * x + y * y + z * z).sqrt()) / voxel + 0.5).clamp(0.0, 1.0)
}
