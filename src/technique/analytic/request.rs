//! The parts of a request that reconstructions share: the sinogram and the grid.

use schemars::JsonSchema;
use serde::Deserialize;

use super::Data;
use crate::asset::{AssetLimits, Assets};
use crate::error::{Error, Result};
use crate::tomography::{Geometry, GeometryRequest, Phantom, PhantomRequest};

/// The most voxels of a side, and of a grid.
const MOST_SIDE: usize = 2048;
const MOST_VOXELS: usize = 1 << 28;

/// What is reconstructed.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SinogramRequest {
    /// The id of an upload.
    id: Option<String>,
    /// A measurement that is made for it, without noise.
    projection: Option<ProjectionRequest>,
}

/// A measurement.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ProjectionRequest {
    /// What is measured.
    of: Option<OfRequest>,
    /// Where each bin of each view looks.
    #[serde(default)]
    geometry: GeometryRequest,
}

/// What is measured.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct OfRequest {
    /// A phantom, whose line integrals are exact. Default: the head of Shepp and Logan.
    phantom: PhantomRequest,
}

/// The grid in a request.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridRequest {
    /// Voxels along x, y, z. Default: as many as bins along u, u and v.
    #[schemars(inner(range(min = 1, max = 2048)))]
    dims: Option<[usize; 3]>,
    /// Their sides, mm. Default: those of bins; of more than 2048 bins wider ones, so that all is seen.
    #[schemars(inner(range(min = 1e-6, max = 1e6)))]
    spacing_mm: Option<[f64; 3]>,
    /// The grid's centre, mm.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    center_mm: Option<[f64; 3]>,
}

impl SinogramRequest {
    /// The data and their geometry.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`.
    pub(in crate::technique) fn resolve(&self, assets: &Assets, at: &str) -> Result<(Data, Geometry)> {
        if let Some(id) = &self.id {
            if self.projection.is_some() {
                return Err(Error::invalid(
                    format!("{at}/projection"),
                    "there is an id, too",
                    "one of id and projection",
                ));
            }
            let sinogram = assets.sinograms().named(id, &format!("{at}/id"))?;
            let geometry = sinogram.geometry().clone();
            return Ok((Data::Measured(sinogram), geometry));
        }
        let at = format!("{at}/projection");
        let projection = self.projection.clone().unwrap_or_default();
        let geometry = projection.geometry.resolve(&format!("{at}/geometry"))?;
        let phantom = match &projection.of {
            Some(of) => of.phantom.resolve(&format!("{at}/of/phantom"))?,
            None => Phantom::shepp_logan(),
        };
        Ok((Data::Exact(phantom), geometry))
    }
}

impl GridRequest {
    /// Voxels, their sides and the centre, mm.
    pub(in crate::technique) fn resolve(&self, geometry: &Geometry) -> ([usize; 3], [f64; 3], [f64; 3]) {
        let ([u, v], [du, dv]) = (geometry.count(), geometry.spacing_mm());
        let most = [u.min(MOST_SIDE), u.min(MOST_SIDE), v.min(MOST_SIDE)];
        // A default grid is as wide as the detector, with wider voxels if there are more bins than voxels may be.
        let wider = |bins: usize| if self.dims.is_none() { bins as f64 / bins.min(MOST_SIDE) as f64 } else { 1.0 };
        let spacing = [du * wider(u), du * wider(u), dv * wider(v)];
        (self.dims.unwrap_or(most), self.spacing_mm.unwrap_or(spacing), self.center_mm.unwrap_or_default())
    }
}

/// Refuses a grid of more voxels than may be computed, or of more bytes than the server's limits permit.
///
/// # Errors
/// [`Error::TooLarge`].
pub(super) fn check_voxels(dims: [usize; 3], limits: &AssetLimits) -> Result<()> {
    let voxels = dims.iter().fold(1usize, |all, n| all.saturating_mul(*n));
    let most = limits.volume.max_volume_bytes / size_of::<f32>() as u64;
    let most = most.min(MOST_VOXELS as u64);
    if voxels as u64 > most {
        let what = format!("a grid of {voxels} voxels");
        return Err(Error::TooLarge { what, limit: format!("{most} voxels of 4 bytes") });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::VolumeLimits;

    #[test]
    fn a_grid_has_no_more_bytes_than_a_volume_may_have() {
        let limits = |max_volume_bytes| AssetLimits {
            volume: VolumeLimits { max_volume_bytes, ..VolumeLimits::default() },
            max_store_bytes: 0,
            max_resident_bytes: 0,
        };
        assert!(check_voxels([10, 10, 10], &limits(4000)).is_ok());
        let refused = check_voxels([10, 10, 10], &limits(3999));
        assert!(matches!(&refused, Err(Error::TooLarge { limit, .. }) if limit.contains("999 voxels")), "{refused:?}");
        assert!(check_voxels([usize::MAX, 2, 1], &limits(u64::MAX)).is_err());
    }
}
