//! The geometry of the media: one in the whole box, in layers, by a label volume or by a density.

use std::sync::OnceLock;

use serde_json::json;

use super::clearance::clearances;
use super::layers::{self, Layer};
use super::medium::Medium;
use super::parameters::Parameters;
use crate::asset::Assets;
use crate::error::{Error, Result};
use crate::scene::phase::Phase;
use crate::volume::{Volume, builtin};

/// The place of each medium.
#[derive(Debug, Clone)]
pub enum Where {
    /// One medium.
    Box,
    /// Layers by their ends along z; the last end may be infinite.
    Layers(Vec<f64>),
    /// A medium per voxel.
    Labels {
        /// The number of each voxel's medium.
        of_voxel: Vec<u16>,
        /// See [`Geometry::clearance`].
        clearance: OnceLock<Vec<u8>>,
    },
    /// A factor of the medium's extinction per voxel.
    Density(Vec<f32>),
}

/// A box of media with its grid.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// The place of each medium.
    pub place: Where,
    /// The media, by number.
    pub media: Vec<Medium>,
    /// Size of the grid.
    pub size_mm: [f64; 3],
    /// The number of voxels along x, y, z.
    pub dims: [usize; 3],
    /// True if it is the lecture's chamber.
    pub chamber: bool,
}

impl Geometry {
    /// The geometry of a request.
    ///
    /// # Errors
    /// [`Error::Invalid`] for more than one kind of geometry, a layer without end before the last, a label without a medium, or a density below 0.
    pub fn new(p: &Parameters, assets: &Assets, at: &str) -> Result<Self> {
        let given = [("media", p.media.is_some()), ("layers", p.layers.is_some()), ("medium", p.medium.is_some())];
        if given.iter().filter(|g| g.1).count() > 1 {
            let names: Vec<&str> = given.iter().filter(|g| g.1).map(|g| g.0).collect();
            return Err(Error::invalid(
                format!("{at}/{}", names[0]),
                format!("given beside {}", names[1]),
                "one of medium, media, layers",
            ));
        }
        for (name, set, needs, there) in [
            ("labels", p.labels.is_some(), "media", p.media.is_some()),
            ("media", p.media.is_some(), "labels", p.labels.is_some()),
        ] {
            if set && !there {
                return Err(Error::invalid(
                    format!("{at}/{name}"),
                    format!("{name} without {needs}"),
                    format!("{name} with {needs}"),
                ));
            }
        }
        if p.density.is_some() && (p.labels.is_some() || p.layers.is_some()) {
            return Err(Error::invalid(
                format!("{at}/density"),
                "given beside labels or layers",
                "density with a medium",
            ));
        }
        let geometry = if let Some(layers) = &p.layers {
            Self::layers(p, layers, at)
        } else if let (Some(labels), Some(media)) = (&p.labels, &p.media) {
            Self::labels(p, &*labels.volume(assets, &format!("{at}/labels"))?, media, at)
        } else if let Some(density) = &p.density {
            Self::density(p, &*density.volume(assets, &format!("{at}/density"))?, at)
        } else if let Some(medium) = &p.medium {
            let size_mm = p.size_mm.unwrap_or([60.0; 3]);
            Ok(Self { place: Where::Box, media: vec![medium.clone()], size_mm, dims: p.dims([60; 3]), chamber: false })
        } else {
            Ok(Self::chamber(p))
        }?;
        if !geometry.chamber {
            for (name, set) in [("albedo", p.albedo.is_some()), ("extinction_scale", p.extinction_scale.is_some())] {
                if set {
                    return Err(Error::invalid(
                        format!("{at}/{name}"),
                        "only for the chamber",
                        "leave it out: the media say it",
                    ));
                }
            }
        }
        for (i, medium) in geometry.media.iter().enumerate() {
            let place = match geometry.place {
                Where::Layers(_) => format!("{at}/layers/{i}/phase"),
                Where::Labels { .. } => format!("{at}/media/{i}/phase"),
                _ => format!("{at}/medium/phase"),
            };
            medium.phase.check(&place)?;
        }
        Ok(geometry)
    }

    fn layers(p: &Parameters, layers: &[Layer], at: &str) -> Result<Self> {
        let ends = layers::ends(layers, &format!("{at}/layers"))?;
        let depth = ends.last().copied().unwrap_or(0.0);
        let mut size_mm = p.size_mm.unwrap_or([60.0; 3]);
        let finite = ends.iter().rev().find(|e| e.is_finite()).copied().unwrap_or(0.0);
        if depth.is_finite() {
            size_mm[2] = depth;
        } else if size_mm[2] <= finite {
            let permitted = format!("more than {finite}, where the last layer starts");
            return Err(Error::invalid(format!("{at}/size_mm/2"), "the grid ends before the last layer", permitted));
        }
        let media = layers.iter().map(Layer::medium).collect();
        Ok(Self { place: Where::Layers(ends), media, size_mm, dims: p.dims([60; 3]), chamber: false })
    }

    /// The grid of a volume: its voxels, and its size if the request gives none.
    fn grid_of(p: &Parameters, volume: &Volume, at: &str) -> Result<([usize; 3], [f64; 3])> {
        let dims = volume.dims();
        if let Some(grid) = p.grid
            && grid.map(|n| n as usize) != dims
        {
            return Err(Error::invalid(format!("{at}/grid"), "the grid is the volume's", json!(dims).to_string()));
        }
        if dims.iter().any(|&n| n > 512) {
            return Err(Error::invalid(at, "the volume is too large to simulate", "512 voxels a side"));
        }
        let spacing = volume.spacing();
        Ok((dims, p.size_mm.unwrap_or(std::array::from_fn(|a| dims[a] as f64 * spacing[a]))))
    }

    fn labels(p: &Parameters, volume: &Volume, media: &[Medium], at: &str) -> Result<Self> {
        let (dims, size_mm) = Self::grid_of(p, volume, at)?;
        let values = volume.values()?;
        let of_voxel = (0..volume.voxel_count())
            .map(|i| values.of(i))
            .map(|v| if v.fract() == 0.0 && (0.0..media.len() as f64).contains(&v) { Ok(v as u16) } else { Err(v) })
            .collect::<std::result::Result<Vec<u16>, f64>>()
            .map_err(|v| {
                Error::invalid(
                    format!("{at}/labels"),
                    format!("there is a voxel of {v}"),
                    format!("whole numbers from 0 to {}", media.len() - 1),
                )
            })?;
        let place = Where::Labels { of_voxel, clearance: OnceLock::new() };
        Ok(Self { place, media: media.to_vec(), size_mm, dims, chamber: false })
    }

    fn density(p: &Parameters, volume: &Volume, at: &str) -> Result<Self> {
        let (dims, size_mm) = Self::grid_of(p, volume, at)?;
        let values = volume.values()?;
        let density: Vec<f32> = (0..volume.voxel_count()).map(|i| values.of(i) as f32).collect();
        if let Some(bad) = density.iter().find(|v| !(0.0..=1e9).contains(*v)) {
            return Err(Error::invalid(
                format!("{at}/density"),
                format!("there is a voxel of {bad}"),
                "densities from 0 to 1000000000",
            ));
        }
        let medium = p.medium.clone().unwrap_or_else(|| Medium { index: 1.0, ..Medium::default() });
        Ok(Self { place: Where::Density(density), media: vec![medium], size_mm, dims, chamber: false })
    }

    /// The lecture's chamber, whose densities are per mm.
    fn chamber(p: &Parameters) -> Self {
        let dims = p.dims([64; 3]);
        let albedo = p.albedo.unwrap_or(0.9);
        let scale = p.extinction_scale.unwrap_or(1.0);
        let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let [nx, ny, nz] = dims;
        let mut density = Vec::with_capacity(nx * ny * nz);
        for z in 0..nz {
            for y in 0..ny {
                density.extend(
                    (0..nx)
                        .map(|x| (builtin::chamber_value(centre(x, nx), centre(y, ny), centre(z, nz)) * scale) as f32),
                );
            }
        }
        let medium = Medium {
            mu_a_per_mm: 1.0 - albedo,
            mu_s_per_mm: albedo,
            index: 1.0,
            phase: Phase::default(),
            attenuation: None,
        };
        let size_mm = p.size_mm.unwrap_or([1.0; 3]);
        Self { place: Where::Density(density), media: vec![medium], size_mm, dims, chamber: true }
    }

    /// True if its photons are gamma photons.
    pub fn is_gamma(&self) -> bool {
        self.media.iter().any(|m| m.phase.kind == "klein_nishina")
    }

    /// True if refractive indices differ within it.
    pub fn bends(&self) -> bool {
        self.media.iter().any(|m| m.index != self.media[0].index)
    }

    /// The clearance of each voxel (see [`clearances`]), for labels. It is computed at the first call.
    pub fn clearance(&self) -> Option<&[u8]> {
        match &self.place {
            Where::Labels { of_voxel, clearance } => Some(clearance.get_or_init(|| clearances(of_voxel, self.dims))),
            _ => None,
        }
    }

    /// Extinction of every voxel, per mm, for the kinds that have voxels.
    pub fn voxel_extinction_per_mm(&self) -> Option<Vec<f32>> {
        match &self.place {
            Where::Labels { of_voxel, .. } => {
                let of: Vec<f32> = self.media.iter().map(|m| m.extinction_per_mm() as f32).collect();
                Some(of_voxel.iter().map(|&l| of[l as usize]).collect())
            }
            Where::Density(density) => {
                let extinction = self.media[0].extinction_per_mm() as f32;
                Some(density.iter().map(|d| d * extinction).collect())
            }
            _ => None,
        }
    }

    /// Least and greatest extinction anywhere, per mm.
    pub fn extinction_range_per_mm(&self) -> [f64; 2] {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold([f64::INFINITY, 0.0], |[a, b], v| [f64::min(a, v), f64::max(b, v)])
        };
        match self.voxel_extinction_per_mm() {
            Some(voxels) => range(&mut voxels.into_iter().map(f64::from)),
            None => range(&mut self.media.iter().map(Medium::extinction_per_mm)),
        }
    }
}
