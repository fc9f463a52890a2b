//! The optics of a scene, for views that scatter light.

use super::slab::missing;

/// The optics of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    /// The greatest optical depth along each of the volume's axes.
    pub optical_depth: [f64; 3],
    /// The greatest scattering albedo.
    pub albedo: f64,
    /// The mean cosine of the scattering angle, if known.
    pub anisotropy: Option<f64>,
    /// The part of each given light, except skies, in the light in the middle of the volume, with its index in the request.
    pub light_shares: Vec<(usize, f64)>,
}

impl Optics {
    /// A bound on the relative loss if light is followed through `scatterings` scatterings: the part of a slab's reflectance that was scattered more
    /// often, for a slab as deep as the volume is along its shallowest axis.
    pub fn missing(&self, scatterings: u32) -> f64 {
        missing(self.optical_depth.into_iter().fold(f64::INFINITY, f64::min), self.albedo, scatterings)
    }

    /// All lights except skies, by their indices in the request, the faintest first.
    pub fn faintest_lights(&self) -> Vec<usize> {
        let mut shares = self.light_shares.clone();
        shares.sort_by(|a, b| a.1.total_cmp(&b.1));
        shares.into_iter().map(|(i, _)| i).collect()
    }
}
