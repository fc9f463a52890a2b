//! The surfaces of a request.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::volume::{DataKind, Volume};

/// The most surfaces of a render.
pub const MOST_SURFACES: usize = 8;
/// The linear colour of old bone.
const IVORY: [f64; 3] = [0.83, 0.74, 0.58];
/// The isovalue of bone in a CT scan, Hounsfield units.
const BONE_HOUNSFIELD: f64 = 300.0;

/// A surface of one value.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// The value on it.
    #[schemars(range(min = -1e30, max = 1e30), extend("x-slider" = "values"))]
    pub isovalue: f64,
    /// Linear red, green, blue.
    #[serde(default = "ivory")]
    #[schemars(inner(range(min = 0, max = 1)))]
    pub color: [f64; 3],
    /// What of the light behind it does not get through.
    #[serde(default = "opaque")]
    #[schemars(range(min = 0.001, max = 1))]
    pub opacity: f64,
}

fn ivory() -> [f64; 3] {
    IVORY
}
fn opaque() -> f64 {
    1.0
}

impl Surface {
    /// A surface, with defaults for the arguments that are not given.
    pub fn new(isovalue: f64, color: Option<[f64; 3]>, opacity: Option<f64>) -> Self {
        Self { isovalue, color: color.unwrap_or(IVORY), opacity: opacity.unwrap_or(1.0) }
    }
}

/// Checks a rule that the schema cannot express: no two surfaces have one value.
///
/// # Errors
/// [`Error::Invalid`] naming the later of the two under `at`.
pub fn check(surfaces: &[Surface], at: &str) -> Result<()> {
    for (i, surface) in surfaces.iter().enumerate() {
        if let Some(first) = surfaces[..i].iter().position(|s| s.isovalue == surface.isovalue) {
            let detail = format!("surface {first} has this value too");
            return Err(Error::invalid(format!("{at}/{i}/isovalue"), detail, "a value of its own for each surface"));
        }
    }
    Ok(())
}

/// The isovalue if the request gives none: bone in Hounsfield units, else the threshold that separates two classes of voxels best, by the variance
/// between them (Otsu, "A Threshold Selection Method from Gray-Level Histograms", IEEE Transactions on Systems, Man and Cybernetics 9(1), 1979).
///
/// # Errors
/// As [`Volume::voxels`].
pub fn default_isovalue(volume: &Volume) -> Result<f64> {
    let contents = volume.contents()?;
    if contents.kind == DataKind::Hounsfield {
        return Ok(BONE_HOUNSFIELD);
    }
    let histogram = volume.histogram_within(contents.data)?;
    let bins = histogram.counts.len();
    let (total, sum) = histogram
        .counts
        .iter()
        .enumerate()
        .fold((0.0, 0.0), |(n, sum), (i, &count)| (n + count as f64, sum + i as f64 * count as f64));
    let (mut below, mut below_sum, mut best, mut at) = (0.0, 0.0, -1.0, 0);
    for (i, &count) in histogram.counts.iter().enumerate().take(bins.saturating_sub(1)) {
        below += count as f64;
        below_sum += i as f64 * count as f64;
        let difference = below_sum / below - (sum - below_sum) / (total - below);
        let between = below * (total - below) * difference * difference;
        if between > best {
            (best, at) = (between, i + 1);
        }
    }
    Ok(histogram.min + (histogram.max - histogram.min) * at as f64 / bins.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::builtin;

    #[test]
    fn otsus_threshold_is_between_two_classes() {
        let volume = builtin::build("sphere", 16, 0).expect("a sphere");
        let [low, high] = volume.range();
        let isovalue = default_isovalue(&volume).expect("voxels on the host");
        assert!(low < isovalue && isovalue < high, "{low} {isovalue} {high}");
    }

    #[test]
    fn two_surfaces_of_one_value_are_refused() {
        let surfaces = [Surface::new(1.0, None, None), Surface::new(2.0, None, None), Surface::new(1.0, None, None)];
        assert!(check(&surfaces[..2], "/s").is_ok() && check(&surfaces, "/s").is_err());
    }
}
