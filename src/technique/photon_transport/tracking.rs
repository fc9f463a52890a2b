//! The choice of a tracker, with its reason.

use super::geometry::Geometry;
use super::parameters::Parameters;
use crate::error::{Error, Result};
pub use crate::technique::majorant::Tracking;

/// The tracker of a request, with the reason in words.
///
/// # Errors
/// [`Error::Invalid`] for a tracker that cannot detect the interfaces of the scene.
pub fn choose(p: &Parameters, geometry: &Geometry, track: bool, at: &str) -> Result<(Tracking, String)> {
    let tracking = match p.tracking.as_str() {
        "exact" => Tracking::Exact,
        "march" => Tracking::March,
        "delta" => Tracking::Delta,
        "weighted" => Tracking::Weighted,
        _ => return Ok(cheapest(p, geometry, track)),
    };
    if tracking != Tracking::Exact && geometry.bends() {
        let detail = format!("{} tracking does not see where the refractive index changes", tracking.name());
        return Err(Error::invalid(format!("{at}/tracking"), detail, "auto or exact, or media of one index"));
    }
    let why = match tracking {
        Tracking::March => "as asked: biased by up to a step a path",
        _ => "as asked",
    };
    Ok((tracking, format!("{}: {why}", tracking.name())))
}

/// The mean number of boundaries of cubes that a photon crosses per side of a cube, averaged over directions.
const BOUNDARIES_PER_SIDE: f64 = 1.5;
/// Delta tracking is chosen if it needs less than this part of the look-ups of voxels.
const CLEARLY_LESS: f64 = 0.7;

/// The cheapest unbiased tracker for the scene. Tracks are scored voxel by voxel in any case, so that voxels can be skipped only if collisions are
/// scored.
fn cheapest(p: &Parameters, geometry: &Geometry, track: bool) -> (Tracking, String) {
    let exact = |why: &str| (Tracking::Exact, format!("exact: {why}"));
    let Some(voxels) = geometry.voxel_extinction_per_mm() else {
        return exact("from face to face a free path is a closed form");
    };
    if geometry.is_gamma() {
        return exact("the extinction changes with the energy, so no majorant holds");
    }
    if geometry.bends() {
        return exact("from one cell boundary to the next, for light is bent there");
    }
    if track {
        return exact("from voxel to voxel, where tracks are scored as well");
    }
    let mean = |v: &[f32]| v.iter().map(|e| f64::from(*e)).sum::<f64>() / v.len() as f64;
    let voxel_mm = (0..3).map(|a| geometry.size_mm[a] / geometry.dims[a] as f64).sum::<f64>() / 3.0;
    // A photon crosses voxels with a clearance in one step.
    let per_voxel = |clearance: &[u8]| {
        clearance.iter().map(|r| 1.0 / (2.0 * f64::from(*r) + 1.0)).sum::<f64>() / clearance.len() as f64
    };
    let boundaries = geometry.clearance().map_or(1.0, per_voxel);
    let by_voxels = boundaries * BOUNDARIES_PER_SIDE / voxel_mm + mean(&voxels);
    let by_majorants = mean(&majorants(p, geometry).per_mm);
    let numbers =
        format!("{by_majorants:.3} tentative collisions a mm for {by_voxels:.3} cell boundaries and collisions");
    if by_majorants < CLEARLY_LESS * by_voxels && p.majorant.scale >= 1.0 {
        (Tracking::Delta, format!("delta: {numbers}"))
    } else {
        exact(&format!("from one cell boundary to the next: delta tracking would make {numbers}"))
    }
}

/// Voxels along a block's side.
const BLOCK: usize = 8;

/// Majorants of blocks of voxels.
pub struct Majorants {
    /// Blocks along each axis.
    pub blocks: [usize; 3],
    /// Voxels along a block's sides.
    pub voxels: [usize; 3],
    /// The greatest extinction in each block, per mm, times the request's scale.
    pub per_mm: Vec<f32>,
}

/// The majorants of a geometry.
pub fn majorants(p: &Parameters, geometry: &Geometry) -> Majorants {
    let scale = p.majorant.scale as f32;
    let dims = geometry.dims;
    let local = p.majorant.grid == "local";
    match geometry.voxel_extinction_per_mm() {
        Some(voxels) if local => {
            let blocks = dims.map(|n| n.div_ceil(BLOCK));
            let mut per_mm = vec![0f32; blocks.iter().product()];
            for (i, extinction) in voxels.into_iter().enumerate() {
                let [x, y, z] = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]].map(|c| c / BLOCK);
                let block = &mut per_mm[(z * blocks[1] + y) * blocks[0] + x];
                *block = block.max(extinction * scale);
            }
            Majorants { blocks, voxels: [BLOCK; 3], per_mm }
        }
        _ => {
            let greatest = geometry.extinction_range_per_mm()[1] as f32;
            Majorants { blocks: [1; 3], voxels: dims, per_mm: vec![greatest * scale] }
        }
    }
}
