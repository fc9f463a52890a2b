//! Lights of views that scatter light.

use glam::DVec3;

pub use super::light_source::LightSource;
use super::light_source::luminance;
use super::medium::Spectrum;
use crate::device::enums::DeviceEnum;
use crate::error::{Error, Result};

/// The number of floats of a light in the kernel's table: `LIGHT_NUMBERS` of the kernels.
pub const LIGHT_NUMBERS: usize = 16;
/// The most lights of a scene.
const MOST_LIGHTS: usize = 8;
/// The sky's radiances, its up direction and its visibility.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// The radiance at the zenith, the horizon and straight below.
    pub radiance: [[f64; 3]; 3],
    /// The up direction, if the request gives one.
    pub up: Option<DVec3>,
    /// True if the eye sees the sky.
    pub visible: bool,
}

/// A scene's lights.
#[derive(Debug, Clone, PartialEq)]
pub struct Lights(Vec<LightSource>);

impl Default for Lights {
    /// A sun in a blue sky, high on the left.
    fn default() -> Self {
        let sun = LightSource { kind: "sun".into(), ..LightSource::default() };
        let sky = LightSource {
            kind: "sky".into(),
            zenith: Some(Spectrum::Rgb([0.05, 0.11, 0.26])),
            horizon: Some(Spectrum::Rgb([0.26, 0.34, 0.42])),
            ground: Some(Spectrum::Rgb([0.1, 0.09, 0.08])),
            ..LightSource::default()
        };
        Self(vec![sun, sky])
    }
}

impl Lights {
    /// The lights of a request, or the default ones.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn from_request(request: Option<&[LightSource]>, at: &str) -> Result<Self> {
        let Some(lights) = request else { return Ok(Self::default()) };
        if lights.len() > MOST_LIGHTS {
            return Err(Error::invalid(at, format!("{} lights", lights.len()), format!("0 to {MOST_LIGHTS}")));
        }
        for (i, light) in lights.iter().enumerate() {
            light.check(&format!("{at}/{i}"))?;
        }
        let skies: Vec<usize> = (0..lights.len()).filter(|&i| lights[i].kind == "sky").collect();
        if let Some(second) = skies.get(1) {
            return Err(Error::invalid(format!("{at}/{second}"), "there is another sky", "one sky"));
        }
        Ok(Self(lights.to_vec()))
    }

    fn aimed_at(&self) -> impl Iterator<Item = &LightSource> {
        self.0.iter().filter(|l| l.kind != "sky")
    }

    /// The number of lights besides the sky.
    pub fn count(&self) -> usize {
        self.aimed_at().count()
    }

    /// True if a ray may meet a light, since one of them has a size.
    pub fn any_with_size(&self) -> bool {
        self.aimed_at().any(|l| l.kind != "point" && (l.kind != "sun" || l.size() > 0.0))
    }

    /// The index of the first light that no ray meets by chance.
    pub fn first_without_size(&self) -> Option<usize> {
        self.0.iter().position(|l| l.kind == "point" || (l.kind == "sun" && l.size() == 0.0))
    }

    /// The sky.
    pub fn sky(&self) -> Option<Sky> {
        let sky = self.0.iter().find(|l| l.kind == "sky")?;
        let rgb = |s: Option<Spectrum>, otherwise: [f64; 3]| s.map_or(otherwise, Spectrum::rgb);
        let zenith = rgb(sky.zenith, sky.color());
        let horizon = rgb(sky.horizon, zenith);
        let ground = rgb(sky.ground, horizon);
        Some(Sky {
            radiance: [zenith, horizon, ground],
            up: sky.up.map(|u| DVec3::from(u).normalize_or_zero()),
            visible: sky.visible.unwrap_or(true),
        })
    }

    /// The share of each light in the irradiance on a face in the middle of a volume of that radius, in the order of the request. A sky has
    /// no share, since its light comes from everywhere.
    pub fn shares(&self, radius: f64) -> Vec<Option<f64>> {
        let sky = self.sky().map_or(0.0, |s| s.radiance.into_iter().map(luminance).sum::<f64>() / 3.0);
        let falls = |l: &LightSource| (l.kind != "sky").then(|| l.irradiance_at_middle(radius));
        let all: Vec<Option<f64>> = self.0.iter().map(falls).collect();
        let total = all.iter().flatten().sum::<f64>() + std::f64::consts::PI * sky;
        all.into_iter().map(|share| share.map(|s| if total > 0.0 { s / total } else { 0.0 })).collect()
    }

    /// The kernel's table of all lights but the sky. A light's probability of being chosen follows its irradiance in the middle of a volume
    /// of that radius; a fifth of the probability is spread evenly over the lights.
    pub fn table(&self, radius: f64, up: DVec3) -> Vec<f32> {
        let shares: Vec<f64> = self.aimed_at().map(|l| l.irradiance_at_middle(radius)).collect();
        let (total, n) = (shares.iter().sum::<f64>(), shares.len() as f64);
        let mut table = Vec::with_capacity(shares.len() * LIGHT_NUMBERS);
        for (light, share) in self.aimed_at().zip(&shares) {
            let chance = if total > 0.0 { 0.8 * share / total + 0.2 / n } else { 1.0 / n };
            let mut numbers = [0.0; LIGHT_NUMBERS];
            (numbers[0], numbers[1]) =
                (f64::from(light.on_device().number()), if shares.len() == 1 { 1.0 } else { chance });
            numbers[2..5].copy_from_slice(&light.color());
            numbers[5..8].copy_from_slice(&light.place(up).to_array());
            numbers[8] = light.size();
            numbers[9..12].copy_from_slice(&light.edge_u.unwrap_or_default());
            numbers[12..15].copy_from_slice(&light.edge_v.unwrap_or_default());
            table.extend(numbers.map(|v| v as f32));
        }
        table
    }
}
