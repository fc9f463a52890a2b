//! The attenuation of gamma photons in matter: published mass attenuation coefficients, and the part of them that is Compton scattering.
//!
//! The tables are of Hubbell & Seltzer, NISTIR 5632 (1995). The part n_e σ_KN(E) / µ(E) of each collision is Compton scattering (n_e electrons per
//! volume, free and at rest). The rest, which is photoelectric absorption and a little coherent scattering, is absorbed on the spot.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};

/// The energy below which a photon is absorbed on the spot.
pub const LEAST_KEV: f64 = 10.0;
/// Rows of a medium in the kernel's table: `GAMMA_ROWS`.
pub const ROWS: usize = 512;
const ELECTRON_KEV: f64 = 510.998_95;
/// Classical electron radius, cm.
const ELECTRON_RADIUS_CM: f64 = 2.817_940_326_2e-13;
const AVOGADRO: f64 = 6.022_140_76e23;

/// Attenuation by energy: a material's, or a table.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Attenuation {
    /// `water`, `bone` (cortical), `air` (dry, at sea level) or `lead`.
    #[schemars(extend("enum" = ["water", "bone", "air", "lead", null]))]
    pub material: Option<String>,
    /// Instead: energies of a table, rising.
    #[schemars(length(min = 2, max = 1024), inner(range(min = 1, max = 1e5)))]
    pub energies_kev: Option<Vec<f64>>,
    /// The table's linear attenuation; between its energies the logarithms are linear.
    #[schemars(length(min = 2, max = 1024), inner(range(min = 1e-12, max = 1e6)))]
    pub mu_per_mm: Option<Vec<f64>>,
    /// Electrons of the table's matter, which scatter.
    #[schemars(range(min = 0, max = 1e24))]
    pub electrons_per_mm3: Option<f64>,
}

struct Material {
    name: &'static str,
    density_g_per_cm3: f64,
    /// Electrons per nucleon, Z/A.
    electrons: f64,
    /// Energy in keV and mass attenuation coefficient in cm²/g, with coherent scattering.
    table: &'static [(f64, f64)],
}

const MATERIALS: [Material; 4] = [
    Material {
        name: "water",
        density_g_per_cm3: 1.0,
        electrons: 0.55508,
        table: &[
            (10.0, 5.329),
            (15.0, 1.673),
            (20.0, 0.8096),
            (30.0, 0.3756),
            (40.0, 0.2683),
            (50.0, 0.2269),
            (60.0, 0.2059),
            (80.0, 0.1837),
            (100.0, 0.1707),
            (150.0, 0.1505),
            (200.0, 0.1370),
            (300.0, 0.1186),
            (400.0, 0.1061),
            (500.0, 0.09687),
            (600.0, 0.08956),
            (800.0, 0.07865),
            (1000.0, 0.07072),
            (1250.0, 0.06323),
            (1500.0, 0.05754),
            (2000.0, 0.04942),
        ],
    },
    Material {
        name: "bone",
        density_g_per_cm3: 1.92,
        electrons: 0.51478,
        table: &[
            (10.0, 28.51),
            (15.0, 9.032),
            (20.0, 4.001),
            (30.0, 1.331),
            (40.0, 0.6655),
            (50.0, 0.4242),
            (60.0, 0.3148),
            (80.0, 0.2229),
            (100.0, 0.1855),
            (150.0, 0.1480),
            (200.0, 0.1309),
            (300.0, 0.1113),
            (400.0, 0.09908),
            (500.0, 0.09022),
            (600.0, 0.08332),
            (800.0, 0.07308),
            (1000.0, 0.06566),
            (1250.0, 0.05871),
            (1500.0, 0.05346),
            (2000.0, 0.04607),
        ],
    },
    Material {
        name: "air",
        density_g_per_cm3: 1.205e-3,
        electrons: 0.49919,
        table: &[
            (10.0, 5.120),
            (15.0, 1.614),
            (20.0, 0.7779),
            (30.0, 0.3538),
            (40.0, 0.2485),
            (50.0, 0.2080),
            (60.0, 0.1875),
            (80.0, 0.1662),
            (100.0, 0.1541),
            (150.0, 0.1356),
            (200.0, 0.1233),
            (300.0, 0.1067),
            (400.0, 0.09549),
            (500.0, 0.08712),
            (600.0, 0.08055),
            (800.0, 0.07074),
            (1000.0, 0.06358),
            (1250.0, 0.05687),
            (1500.0, 0.05175),
            (2000.0, 0.04447),
        ],
    },
    Material {
        name: "lead",
        density_g_per_cm3: 11.35,
        electrons: 0.39575,
        table: &[
            (10.0, 130.6),
            (13.0352, 67.01),
            (13.0352, 162.1),
            (15.0, 111.6),
            (15.2, 107.8),
            (15.2, 148.5),
            (15.8608, 134.4),
            (15.8608, 154.8),
            (20.0, 86.36),
            (30.0, 30.32),
            (40.0, 14.36),
            (50.0, 8.041),
            (60.0, 5.021),
            (80.0, 2.419),
            (88.0045, 1.910),
            (88.0045, 7.683),
            (100.0, 5.549),
            (150.0, 2.014),
            (200.0, 0.9985),
            (300.0, 0.4031),
            (400.0, 0.2323),
            (500.0, 0.1614),
            (600.0, 0.1248),
            (800.0, 0.08870),
            (1000.0, 0.07102),
            (1250.0, 0.05876),
            (1500.0, 0.05222),
            (2000.0, 0.04606),
        ],
    },
];

/// The cross-section of a free electron at rest in cm², integrated over all angles (Klein & Nishina, Z. Phys. 52, 1929).
pub fn klein_nishina_cm2(energy_kev: f64) -> f64 {
    let k = energy_kev / ELECTRON_KEV;
    let l = (2.0 * k).ln_1p();
    2.0 * PI
        * ELECTRON_RADIUS_CM.powi(2)
        * ((1.0 + k) / (k * k) * (2.0 * (1.0 + k) / (1.0 + 2.0 * k) - l / k) + l / (2.0 * k)
            - (1.0 + 3.0 * k) / (1.0 + 2.0 * k).powi(2))
}

/// The table interpolated in the logarithms of both columns; constant beyond the ends.
fn log_log(table: &[(f64, f64)], energy_kev: f64) -> f64 {
    let above = table.partition_point(|(e, _)| *e <= energy_kev);
    if above == 0 {
        return table[0].1;
    }
    let (e0, v0) = table[above - 1];
    let Some(&(e1, v1)) = table.get(above) else { return v0 };
    let f = (energy_kev / e0).ln() / (e1 / e0).ln();
    (v0.ln() + f * (v1 / v0).ln()).exp()
}

impl Attenuation {
    fn material(&self) -> Option<&'static Material> {
        MATERIALS.iter().find(|m| Some(m.name) == self.material.as_deref())
    }

    /// Linear attenuation per mm, and the part of it that is Compton scattering.
    pub fn at(&self, energy_kev: f64) -> (f64, f64) {
        let (mu_per_mm, electrons_per_mm3) = match (self.material(), &self.energies_kev, &self.mu_per_mm) {
            (Some(m), ..) => {
                let per_mm3 = m.density_g_per_cm3 * AVOGADRO * m.electrons / 1e3;
                (0.1 * m.density_g_per_cm3 * log_log(m.table, energy_kev), per_mm3)
            }
            (None, Some(energies), Some(mu)) => {
                let table: Vec<(f64, f64)> = energies.iter().copied().zip(mu.iter().copied()).collect();
                (log_log(&table, energy_kev), self.electrons_per_mm3.unwrap_or(0.0))
            }
            _ => (0.0, 0.0),
        };
        let compton_per_mm = electrons_per_mm3 * 100.0 * klein_nishina_cm2(energy_kev);
        (mu_per_mm, if mu_per_mm > 0.0 { (compton_per_mm / mu_per_mm).min(1.0) } else { 0.0 })
    }

    /// Checks that it is either a material or a valid table.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn check(&self, at: &str) -> Result<()> {
        let table = self.energies_kev.is_some() || self.mu_per_mm.is_some() || self.electrons_per_mm3.is_some();
        match (&self.material, &self.energies_kev, &self.mu_per_mm) {
            (Some(_), ..) if !table => Ok(()),
            (None, Some(energies), Some(mu)) if energies.len() == mu.len() => {
                if energies.windows(2).all(|w| w[0] < w[1]) {
                    Ok(())
                } else {
                    Err(Error::invalid(format!("{at}/energies_kev"), "the energies do not rise", "rising numbers"))
                }
            }
            _ => {
                let permitted = "material, or energies_kev and mu_per_mm of one length with electrons_per_mm3";
                Err(Error::invalid(at, "neither a material nor a table", permitted))
            }
        }
    }
}
