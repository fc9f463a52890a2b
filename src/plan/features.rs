//! The features of a scene that decide the model it needs.

use serde::Serialize;

use crate::render::Scene;
use crate::technique::PreparedView;

/// The features of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Features {
    /// True if every voxel has the same value.
    pub homogeneous: bool,
    /// The greatest optical depth of the scattering medium along each of the volume's axes; `None` if nothing scatters.
    pub optical_depth: Option<[f64; 3]>,
    /// The greatest part of a collision that is scattered.
    pub albedo: Option<f64>,
    /// The mean cosine of the scattering angle.
    pub anisotropy: Option<f64>,
    /// The part of the light sent back by a slab of the volume's least depth that was scattered more than once. It is the bound by which
    /// multiple scattering may be left out.
    pub multiple_scattering: Option<f64>,
    /// The place in the request of each light but a sky, with its share of the light in the middle of the volume.
    pub light_shares: Vec<(usize, f64)>,
    /// The change of a voxel's optical depth if the value goes through its range from one voxel to the next, at the slope of the transfer
    /// function's steepest part.
    pub steepest_slope: Option<f64>,
    /// The part of the pixels that are opaque, if a view ends its rays there.
    pub opaque: Option<f64>,
    /// The side of the smallest voxel over the side of a pixel at the volume's middle.
    pub pixels_per_voxel: f64,
}

impl Features {
    /// The features of a scene with its prepared view.
    pub fn of(scene: &Scene, view: &dyn PreparedView) -> Self {
        let optics = view.optics();
        let volume = scene.subject().volume();
        let voxel = volume.map_or(scene.subject().bounds().smallest_side(), |v| v.smallest_side());
        let width = volume.map_or(0.0, |v| v.range()[1] - v.range()[0]);
        let pixel = scene.camera().height_at_target() / f64::from(scene.image()[1]);
        Self {
            homogeneous: volume.is_some_and(|v| v.non_finite() == 0 && v.range()[0] == v.range()[1]),
            optical_depth: optics.as_ref().map(|o| o.optical_depth),
            albedo: optics.as_ref().map(|o| o.albedo),
            anisotropy: optics.as_ref().and_then(|o| o.anisotropy),
            steepest_slope: view.steepest_slope().map(|slope| slope * width * voxel),
            opaque: None,
            multiple_scattering: optics.as_ref().map(|o| o.missing(1)),
            light_shares: optics.map_or(Vec::new(), |o| o.light_shares),
            pixels_per_voxel: if pixel > 0.0 { voxel / pixel } else { f64::INFINITY },
        }
    }

    /// The features in words, for a reader.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.homogeneous {
            words.push("the volume is the same everywhere: free paths are a closed form".into());
        }
        if let (Some(depth), Some(albedo)) = (self.optical_depth, self.albedo) {
            let [least, most] =
                [depth.into_iter().fold(f64::INFINITY, f64::min), depth.into_iter().fold(0.0, f64::max)];
            words.push(format!("optical depth up to {least:.3} to {most:.3} along its axes, albedo {albedo}"));
            if let Some(g) = self.anisotropy.filter(|g| *g != 0.0 && albedo > 0.0) {
                words.push(format!("light is turned by a mean cosine of {g:.2}"));
            }
            if albedo == 0.0 {
                words.push("nothing is scattered: a path ends at its first collision".into());
            }
        }
        if let Some(slope) = self.steepest_slope {
            words.push(format!(
                "a voxel's optical depth is up to {slope:.2} from its neighbour's, were they as unlike as any two"
            ));
        }
        if self.pixels_per_voxel < 1.0 {
            words.push(format!("a voxel is {:.2} pixels wide", self.pixels_per_voxel));
        }
        if let Some(part) = self.opaque.filter(|part| *part > 0.0) {
            words.push(format!("{:.0} % of the pixels are opaque: nothing behind is sampled", 100.0 * part));
        }
        words
    }
}
