//! What a sinogram's sender says of its numbers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::GeometryRequest;
use crate::error::{Error, Result};
use crate::volume::{Endian, RawType};

/// The description of a sinogram.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SinogramMeta {
    /// Where each bin of each view looks. Numbers of views and bins that it does not say are those of the data.
    #[serde(default)]
    pub geometry: GeometryRequest,
    /// What the numbers are.
    #[serde(default)]
    pub quantity: Quantity,
    /// Counts in a bin without an object. Only for counts without a flat frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 1e15))]
    pub photons_per_ray: Option<f64>,
    /// The type of bare numbers: u fastest, then v, then the view. NRRD and NumPy say it themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raw: Option<RawNumbers>,
}

/// What numbers of a sinogram are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Integrals of the attenuation along rays: −ln of what is let through.
    #[default]
    LineIntegral,
    /// Photons.
    Counts,
    /// A detector's readings, in proportion to the light. They need a flat frame.
    Intensity,
}

/// The type of bare numbers.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawNumbers {
    /// The type of a number.
    #[serde(rename = "type")]
    pub kind: RawType,
    /// The order of its bytes.
    #[serde(default = "little")]
    pub endian: Endian,
}

fn little() -> Endian {
    Endian::Little
}

impl SinogramMeta {
    /// Checks what is said against the frames that came with it.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `/meta/…`, `/flat` or `/dark`.
    pub fn check(&self, has_flat: bool, has_dark: bool) -> Result<()> {
        let wrong = |at: &str, detail: &str, permitted: &str| Err(Error::invalid(at, detail, permitted));
        if let Some(photons) = self.photons_per_ray {
            if !(1e-3..=1e15).contains(&photons) {
                return wrong("/meta/photons_per_ray", "no such number of photons", "1e-3 to 1e15");
            }
            if self.quantity != Quantity::Counts || has_flat {
                let permitted = "counts without a flat frame";
                return wrong("/meta/photons_per_ray", "only for counts without a flat frame", permitted);
            }
        }
        match self.quantity {
            Quantity::LineIntegral if has_flat => wrong("/flat", "line integrals have no open beam", "no flat frame"),
            Quantity::LineIntegral if has_dark => wrong("/dark", "line integrals have no dark frame", "no dark frame"),
            Quantity::Counts if !has_flat && self.photons_per_ray.is_none() => {
                wrong("/meta/photons_per_ray", "counts need those of the open beam", "a number, or a flat frame")
            }
            Quantity::Intensity if !has_flat => {
                wrong("/flat", "intensities need those of the open beam", "a flat frame: one view, or some of them")
            }
            _ => Ok(()),
        }
    }
}
