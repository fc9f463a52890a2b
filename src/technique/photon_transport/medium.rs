//! Media: their absorption and scattering, their refractive index and their phase function.

use schemars::JsonSchema;
use serde::Deserialize;

use super::attenuation::Attenuation;
use super::device::MediumNumber;
use crate::device::enums::DeviceEnum;
use crate::scene::phase::Phase;

/// The numbers of a medium in the kernel's table, with one for padding.
const NUMBERS: usize = MediumNumber::LENGTH + 1;

/// A homogeneous medium.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Medium {
    /// Absorption coefficient.
    #[schemars(range(min = 0, max = 1e6))]
    pub mu_a_per_mm: f64,
    /// Scattering coefficient.
    #[schemars(range(min = 0, max = 1e6))]
    pub mu_s_per_mm: f64,
    /// Refractive index.
    #[schemars(range(min = 1, max = 4))]
    pub index: f64,
    /// How a collision turns a photon.
    pub phase: Phase,
    /// Of gamma photons, in place of absorption and scattering: attenuation by energy, with the phase `klein_nishina`.
    pub attenuation: Option<Attenuation>,
}

impl Default for Medium {
    fn default() -> Self {
        Self { mu_a_per_mm: 0.005, mu_s_per_mm: 1.0, index: 1.37, phase: Phase::default(), attenuation: None }
    }
}

impl Medium {
    /// Extinction coefficient, per mm.
    pub fn extinction_per_mm(&self) -> f64 {
        self.mu_a_per_mm + self.mu_s_per_mm
    }

    /// The scattered part of a collision; 1 if nothing collides.
    pub fn albedo(&self) -> f64 {
        let extinction = self.extinction_per_mm();
        if extinction > 0.0 { self.mu_s_per_mm / extinction } else { 1.0 }
    }
}

/// The number of media that the kernel's table has room for. Up to 16 fit in a register.
pub fn room(media: usize) -> usize {
    media.max(16)
}

/// The kernel's table of media: one number of all media, then the next number; then the rows of tabulated phase functions.
pub fn table(media: &[Medium]) -> Vec<f32> {
    let room = room(media.len());
    let mut table = vec![0.0; NUMBERS * room];
    let mut rows = Vec::new();
    for (i, medium) in media.iter().enumerate() {
        let [kind, a, b, c] = medium.phase.numbers(&mut rows, NUMBERS * room);
        let (extinction, albedo) = (medium.extinction_per_mm() as f32, medium.albedo() as f32);
        let numbers: [f32; MediumNumber::LENGTH] = [extinction, albedo, medium.index as f32, kind, a, b, c];
        for (number, value) in MediumNumber::ALL.iter().zip(numbers) {
            table[*number as usize * room + i] = value;
        }
    }
    table.extend(rows);
    table
}
