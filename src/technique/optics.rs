//! What a scene is like for views that scatter light.

use super::slab::missing;

/// The optics of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    /// The greatest optical depth along each of the volume's axes.
    pub optical_depth: [f64; 3],
    /// The greatest part of a collision that is scattered.
    pub albedo: f64,
    /// The mean cosine of the angle that a scattering turns light by, where it is known.
    pub anisotropy: Option<f64>,
    /// The part that each given light but a sky has of the light in the middle of the volume, with its place in the request.
    pub light_shares: Vec<(usize, f64)>,
}

impl Optics {
    /// The bound on what is lost where light is followed through so many scatterings: what a slab of the volume's least depth sends back that
    /// was scattered more often, relative.
    pub fn missing(&self, scatterings: u32) -> f64 {
        missing(self.optical_depth.into_iter().fold(f64::INFINITY, f64::min), self.albedo, scatterings)
    }

    /// All lights but skies, by their places in the request, the faintest first.
    pub fn faintest_lights(&self) -> Vec<usize> {
        let mut shares = self.light_shares.clone();
        shares.sort_by(|a, b| a.1.total_cmp(&b.1));
        shares.into_iter().map(|(i, _)| i).collect()
    }
}
