//! Phase functions: the distribution of the scattering angle.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::device::enums::{DeviceEnum, PhaseKind};
use crate::error::{Error, Result};

/// A phase function. Which of the parameters count is said by `type`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Phase {
    /// `isotropic`; `henyey_greenstein` of mean cosine `g`; `two_term_henyey_greenstein`: `weight` of a lobe `g1`, the rest of a lobe
    /// `g2`; `rayleigh`; `tabulated`: a density over the cosine, linear between its points;
    /// `klein_nishina`: Compton scattering of gamma photons, with its loss of energy.
    #[serde(rename = "type")]
    #[schemars(extend("enum" = ["isotropic", "henyey_greenstein", "two_term_henyey_greenstein", "rayleigh", "tabulated", "klein_nishina"]))]
    pub kind: String,
    /// Mean cosine of `henyey_greenstein`.
    #[schemars(range(min = -1, max = 1))]
    pub g: f64,
    /// Mean cosine of the first of two lobes.
    #[schemars(range(min = -1, max = 1))]
    pub g1: f64,
    /// Mean cosine of the second.
    #[schemars(range(min = -1, max = 1))]
    pub g2: f64,
    /// The part of the first.
    #[schemars(range(min = 0, max = 1))]
    pub weight: f64,
    /// `tabulated`: cosines in rising order, from -1 to 1.
    #[schemars(length(min = 2, max = 512), inner(range(min = -1, max = 1)))]
    pub cosines: Option<Vec<f64>>,
    /// `tabulated`: the density at each, of any scale.
    #[schemars(length(min = 2, max = 512), inner(range(min = 0, max = 1e30)))]
    pub densities: Option<Vec<f64>>,
}

impl Default for Phase {
    fn default() -> Self {
        let kind = "isotropic".into();
        Self { kind, g: 0.0, g1: 0.9, g2: -0.3, weight: 0.9, cosines: None, densities: None }
    }
}

impl Phase {
    /// The mean cosine of the scattering angle; `None` if it depends on an energy.
    pub fn mean_cosine(&self) -> Option<f64> {
        match (self.kind.as_str(), &self.cosines, &self.densities) {
            ("henyey_greenstein", ..) => Some(self.g),
            ("two_term_henyey_greenstein", ..) => Some(self.weight * self.g1 + (1.0 - self.weight) * self.g2),
            ("tabulated", Some(cosines), Some(densities)) => Some(mean_of_linear(cosines, densities)),
            ("klein_nishina", ..) => None,
            _ => Some(0.0),
        }
    }

    /// Checks the rules that the schema cannot express.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn check(&self, at: &str) -> Result<()> {
        let tabulated = self.kind == "tabulated";
        for (name, set) in [("cosines", self.cosines.is_some()), ("densities", self.densities.is_some())] {
            if set != tabulated {
                let (detail, permitted) =
                    if set { ("only for tabulated", "leave it out") } else { ("missing", "2 to 512 numbers") };
                return Err(Error::invalid(format!("{at}/{name}"), detail, permitted));
            }
        }
        let (Some(cosines), Some(densities)) = (&self.cosines, &self.densities) else { return Ok(()) };
        let rising = cosines.windows(2).all(|w| w[0] < w[1]);
        if !rising || cosines.first() != Some(&-1.0) || cosines.last() != Some(&1.0) {
            return Err(Error::invalid(format!("{at}/cosines"), "not a table of all angles", "rising from -1 to 1"));
        }
        if densities.len() != cosines.len() || densities.iter().sum::<f64>() <= 0.0 {
            let permitted = format!("{} numbers, not all of them 0", cosines.len());
            return Err(Error::invalid(format!("{at}/densities"), "not a density at each cosine", permitted));
        }
        Ok(())
    }

    /// The kernel's kind and its three parameters. The rows of a tabulated function are appended to `rows`, which starts at `rows_at` in
    /// the kernel's table.
    pub fn numbers(&self, rows: &mut Vec<f32>, rows_at: usize) -> [f32; 4] {
        let (kind, [a, b, c]) = match self.kind.as_str() {
            "henyey_greenstein" => (PhaseKind::Lobes, [self.g as f32, self.g as f32, 1.0]),
            "two_term_henyey_greenstein" => (PhaseKind::Lobes, [self.g1 as f32, self.g2 as f32, self.weight as f32]),
            "rayleigh" => (PhaseKind::Rayleigh, [0.0, 0.0, 1.0]),
            "tabulated" => {
                let first = rows_at + rows.len();
                let count = self.tabulate(rows);
                (PhaseKind::Table, [first as f32, count as f32, 1.0])
            }
            _ => (PhaseKind::Lobes, [0.0, 0.0, 1.0]),
        };
        [kind.number() as f32, a, b, c]
    }

    /// Appends rows of cosine, normalised density and cumulative probability, and returns their number.
    fn tabulate(&self, rows: &mut Vec<f32>) -> usize {
        let (Some(cosines), Some(densities)) = (&self.cosines, &self.densities) else { return 0 };
        let area = |i: usize| 0.5 * (densities[i] + densities[i - 1]) * (cosines[i] - cosines[i - 1]);
        let total: f64 = (1..cosines.len()).map(area).sum();
        let mut below = 0.0;
        for i in 0..cosines.len() {
            if i > 0 {
                below += area(i) / total;
            }
            rows.extend([cosines[i] as f32, (densities[i] / total) as f32, below as f32]);
        }
        cosines.len()
    }
}

/// ∫ x p dx / ∫ p dx of a density that is linear between points.
fn mean_of_linear(x: &[f64], p: &[f64]) -> f64 {
    let (mut first, mut whole) = (0.0, 0.0);
    for (x, p) in x.windows(2).zip(p.windows(2)) {
        let width = x[1] - x[0];
        whole += 0.5 * width * (p[0] + p[1]);
        first += width / 6.0 * (p[0] * (2.0 * x[0] + x[1]) + p[1] * (x[0] + 2.0 * x[1]));
    }
    if whole > 0.0 { first / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_cosines_are_those_of_the_formulae() {
        let of = |value| serde_json::from_value::<Phase>(value).map(|p| p.mean_cosine()).ok().flatten();
        assert_eq!(of(serde_json::json!({"type": "henyey_greenstein", "g": 0.7})), Some(0.7));
        assert_eq!(of(serde_json::json!({"type": "rayleigh"})), Some(0.0));
        assert_eq!(of(serde_json::json!({"type": "klein_nishina"})), None);
        let two = of(serde_json::json!({"type": "two_term_henyey_greenstein", "weight": 0.75, "g1": 0.8, "g2": -0.4}));
        assert!(two.is_some_and(|g| (g - 0.5).abs() < 1e-12), "{two:?}");
        // A density of 1 + μ over [−1, 1] has the mean 1/3.
        let table = of(serde_json::json!({"type": "tabulated", "cosines": [-1, 0.2, 1], "densities": [0, 1.2, 2]}));
        assert!(table.is_some_and(|g| (g - 1.0 / 3.0).abs() < 1e-12), "{table:?}");
    }
}
