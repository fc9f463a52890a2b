//! How free paths are found, and why.

use super::Parameters;
use super::geometry::{Geometry, Where};
use crate::error::{Error, Result};

/// A tracker of `kernels/shared/medium.h`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tracking {
    /// Closed form in a piece, from wall to wall.
    Exact,
    /// Steps of one length.
    March,
    /// Woodcock's, with majorants.
    Delta,
    /// The same with weights, for majorants that may be too small.
    Weighted,
}

impl Tracking {
    /// Its name in requests and replies.
    pub fn name(self) -> &'static str {
        ["exact", "march", "delta", "weighted"][self as usize]
    }
}

/// The tracker of a request, with the reason in words.
///
/// # Errors
/// A tracker that cannot see the interfaces of the scene.
pub fn choose(p: &Parameters, geometry: &Geometry, at: &str) -> Result<(Tracking, String)> {
    let tracking = match p.tracking.as_str() {
        "exact" => Tracking::Exact,
        "march" => Tracking::March,
        "delta" => Tracking::Delta,
        "weighted" => Tracking::Weighted,
        _ => {
            let why = match geometry.place {
                Where::Box => "exact: the box is homogeneous, so a free path is a closed form",
                Where::Layers(_) => "exact: in a layer a free path is a closed form",
                Where::Labels(_) => "exact: from voxel to voxel, no majorant and no bias",
                Where::Density(_) => "exact: from voxel to voxel, no majorant and no bias",
            };
            return Ok((Tracking::Exact, why.into()));
        }
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

/// Voxels along a block's side.
const BLOCK: usize = 8;

/// Majorants of blocks of voxels.
pub struct Majorants {
    /// Blocks along each axis.
    pub blocks: [usize; 3],
    /// Voxels along a block's sides.
    pub voxels: [usize; 3],
    /// Greatest extinction in each, per mm, times the request's scale.
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
