//! The medium of a volume, for views that scatter light. The volume's values are densities.

use schemars::JsonSchema;
use serde::Deserialize;

use super::phase::Phase;
use crate::error::{Error, Result};
use crate::volume::Volume;

/// A number for all colours, or one each for red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Spectrum {
    /// The same for all.
    Grey(f64),
    /// Red, green, blue.
    Rgb([f64; 3]),
}

impl Spectrum {
    /// The spectrum as red, green, blue.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Self::Grey(v) => [v; 3],
            Self::Rgb(v) => v,
        }
    }

    /// Checks that all numbers are between `least` and `most`. A schema of two forms would say this in too many words.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field `at`.
    pub fn check(self, at: &str, least: f64, most: f64) -> Result<()> {
        let permitted = || format!("{least} to {most}");
        match self {
            Self::Grey(v) if !(least..=most).contains(&v) => Err(Error::invalid(at, format!("{v}"), permitted())),
            Self::Rgb(v) => match v.iter().position(|c| !(least..=most).contains(c)) {
                Some(i) => Err(Error::invalid(format!("{at}/{i}"), format!("{}", v[i]), permitted())),
                None => Ok(()),
            },
            Self::Grey(_) => Ok(()),
        }
    }
}

/// How light collides in the volume: extinction is the volume's value times `sigma_t_per_unit`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MediumRequest {
    /// Extinction per world unit of length at a density of 1; a number, or one each for red, green and blue. Default: an optical depth of
    /// 40 from side to side at the greatest density.
    pub sigma_t_per_unit: Option<Spectrum>,
    /// The part of a collision that is scattered, from 0 to 1; a number, or one each for red, green and blue.
    pub albedo: Spectrum,
    /// How a collision turns light.
    pub phase: Phase,
    /// Radiance that is emitted per unit of length at a density of 1.
    pub emission: Spectrum,
    /// Refractive index, against 1 outside; other than 1 only for `volume_path` under a sky alone.
    #[schemars(range(min = 1, max = 4))]
    pub index: f64,
    /// Values of density 0 and of density 1; what is beyond is as its end. Default: the value is the density.
    pub density_window: Option<[f64; 2]>,
}

impl Default for MediumRequest {
    fn default() -> Self {
        Self {
            sigma_t_per_unit: None,
            albedo: Spectrum::Grey(0.9),
            phase: Phase::default(),
            emission: Spectrum::Grey(0.0),
            index: 1.0,
            density_window: None,
        }
    }
}

/// The optical depth from side to side of a medium without `sigma_t_per_unit`.
const DEFAULT_DEPTH: f64 = 40.0;

impl MediumRequest {
    /// Checks the rules that the schema cannot express.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn check(&self, at: &str) -> Result<()> {
        if let Some(sigma) = self.sigma_t_per_unit {
            sigma.check(&format!("{at}/sigma_t_per_unit"), 0.0, 1e18)?;
            let (sigma, emission) = (sigma.rgb(), self.emission.rgb());
            if (0..3).any(|i| sigma[i] == 0.0 && emission[i] > 0.0) {
                let detail = "light is emitted where nothing collides, and emission is found at collisions";
                return Err(Error::invalid(format!("{at}/emission"), detail, "0, or a sigma_t_per_unit above 0"));
            }
        }
        self.albedo.check(&format!("{at}/albedo"), 0.0, 1.0)?;
        self.emission.check(&format!("{at}/emission"), 0.0, 1e9)?;
        let two = self.phase.kind == "two_term_henyey_greenstein" && self.phase.weight > 0.0 && self.phase.weight < 1.0;
        for (name, g) in [("g1", self.phase.g1), ("g2", self.phase.g2)] {
            if two && g.abs() == 1.0 {
                let detail = "light that is not turned at all has no density to weigh beside the other lobe's";
                return Err(Error::invalid(format!("{at}/phase/{name}"), detail, "above -1 and below 1"));
            }
        }
        self.phase.check(&format!("{at}/phase"))?;
        match self.density_window {
            Some([low, high]) if !((high - low).abs() >= 1e-36 && low.abs() <= 1e36 && high.abs() <= 1e36) => {
                let permitted = "two values from -1e36 to 1e36, 1e-36 or more apart";
                Err(Error::invalid(format!("{at}/density_window"), "its ends are the same, or too large", permitted))
            }
            _ => Ok(()),
        }
    }

    /// The three numbers of the density: density = value · first + second, and no more than third.
    pub fn density(&self) -> [f64; 3] {
        match self.density_window {
            Some([low, high]) => [1.0 / (high - low), -low / (high - low), 1.0],
            None => [1.0, 0.0, 3e38],
        }
    }

    /// The density of a value of the volume.
    pub fn density_of(&self, value: f64) -> f64 {
        let [scale, offset, most] = self.density();
        (value * scale + offset).min(most).max(0.0)
    }

    /// The greatest density in the volume.
    pub fn greatest_density(&self, volume: &Volume) -> f64 {
        volume.range().into_iter().map(|v| self.density_of(v)).fold(0.0, f64::max)
    }

    /// The extinction per world unit at a density of 1, by colour.
    pub fn sigma_t_per_unit(&self, volume: &Volume) -> [f64; 3] {
        // Outliers would make all else transparent.
        let data = volume.contents().map_or(volume.range(), |contents| contents.data);
        let greatest = data.into_iter().map(|v| self.density_of(v)).fold(0.0, f64::max);
        let otherwise = DEFAULT_DEPTH / (super::mean_side(volume) * if greatest > 0.0 { greatest } else { 1.0 });
        self.sigma_t_per_unit.map_or([otherwise; 3], Spectrum::rgb)
    }
}
