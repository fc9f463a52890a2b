//! The geometry of a measurement as a request or a file says it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Geometry;
use crate::error::{Error, Result};

/// The most bins of a side of the detector, and the most views.
const MOST_BINS: usize = 8192;
const MOST_VIEWS: usize = 65_536;
/// The least distance of bins, and the greatest distance of anything, mm. A schema says the same, but headers of files have none.
const LEAST_MM: f64 = 1e-6;
const MOST_MM: f64 = 1e6;
/// The most bins of all views together.
const MOST_DATA: usize = 1 << 28;

/// The geometry in a request.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GeometryRequest {
    /// How rays go.
    #[serde(rename = "type", default)]
    kind: Kind,
    /// The angles of the views, degrees.
    #[serde(default)]
    angles_deg: AnglesRequest,
    /// The detector.
    #[serde(default)]
    detector: DetectorRequest,
}

/// How rays go.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Parallel to each other, at right angles to the detector.
    #[default]
    Parallel,
}

/// The angles of the views.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum AnglesRequest {
    /// Each on its own. It stands before the other, which would take three numbers for its fields.
    Each(#[schemars(length(min = 1, max = 65_536), inner(range(min = -36_000, max = 36_000)))] Vec<f64>),
    /// Evenly spread ones.
    Even(EvenAngles),
}

impl Default for AnglesRequest {
    fn default() -> Self {
        Self::Even(EvenAngles { from: 0.0, to: default_to(), count: None })
    }
}

/// Evenly spread angles.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvenAngles {
    /// The first angle.
    #[serde(default)]
    #[schemars(range(min = -36_000, max = 36_000))]
    from: f64,
    /// The angle after the last.
    #[serde(default = "default_to")]
    #[schemars(range(min = -36_000, max = 36_000))]
    to: f64,
    /// The number of views. Default: 360, or that of the data, or 180 of a projected volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 65_536))]
    count: Option<usize>,
}

fn default_to() -> f64 {
    180.0
}

/// The number of views of which nothing is said.
const VIEWS: usize = 360;
/// Bins along u and v of a detector of which nothing is said, and their distances.
const BINS: [usize; 2] = [256, 1];
const SPACING_MM: [f64; 2] = [1.0; 2];

/// The detector in a request.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct DetectorRequest {
    /// Bins along u and v. Default: 256 and 1, or those of the data, or as many as see all of a projected volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1, max = 8192)))]
    count: Option<[usize; 2]>,
    /// Their distances, mm. Default: 1, or of a projected volume the smallest side of its voxels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1e-6, max = 1e6)))]
    spacing_mm: Option<[f64; 2]>,
    /// The place of the detector's centre, mm.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    offset_mm: [f64; 2],
}

impl GeometryRequest {
    /// The same for an object of a size along u and v, mm: what it does not say sees all of that, by so many views of bins of this side.
    #[must_use]
    pub fn seeing(mut self, size_mm: [f64; 2], side_mm: f64, views: usize) -> Self {
        let spacing = *self.detector.spacing_mm.get_or_insert([side_mm; 2]);
        let size = |side: usize| size_mm[side] + 2.0 * self.detector.offset_mm[side].abs();
        let bins = |side: usize| ((size(side) / spacing[side]).ceil() as usize).max(1);
        let bins = self.detector.count.unwrap_or([bins(0), bins(1)]);
        self.of_data(views, bins)
    }

    /// The same for data of so many views and bins: what it does not say is theirs.
    #[must_use]
    pub fn of_data(mut self, views: usize, bins: [usize; 2]) -> Self {
        self.detector.count.get_or_insert(bins);
        self.detector.spacing_mm.get_or_insert(SPACING_MM);
        if let AnglesRequest::Even(even) = &mut self.angles_deg {
            even.count.get_or_insert(views);
        }
        self
    }

    /// Bins along u and v, if they are said.
    pub fn bins(&self) -> Option<[usize; 2]> {
        self.detector.count
    }

    /// Checks the geometry.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`; [`Error::TooLarge`] for more bins than a sinogram may have.
    pub fn resolve(&self, at: &str) -> Result<Geometry> {
        let Kind::Parallel = self.kind;
        let degrees: Vec<f64> = match &self.angles_deg {
            AnglesRequest::Each(angles) => angles.clone(),
            AnglesRequest::Even(even) => {
                let count = even.count.unwrap_or(VIEWS);
                if count > 1 && even.from == even.to {
                    let detail = format!("all {count} views have one angle");
                    return Err(Error::invalid(format!("{at}/angles_deg/to"), detail, "another angle than from"));
                }
                if count > MOST_VIEWS {
                    let permitted = format!("1 to {MOST_VIEWS}");
                    return Err(Error::invalid(format!("{at}/angles_deg/count"), "too many views", permitted));
                }
                (0..count).map(|i| even.from + (even.to - even.from) * i as f64 / count as f64).collect()
            }
        };
        if degrees.is_empty() || degrees.len() > MOST_VIEWS || degrees.iter().any(|angle| !angle.is_finite()) {
            let permitted = format!("1 to {MOST_VIEWS} finite angles");
            return Err(Error::invalid(format!("{at}/angles_deg"), "these are no views", permitted));
        }
        let DetectorRequest { count, spacing_mm, offset_mm } = self.detector;
        let (count, spacing_mm) = (count.unwrap_or(BINS), spacing_mm.unwrap_or(SPACING_MM));
        if count.iter().any(|n| !(1..=MOST_BINS).contains(n)) {
            let permitted = format!("1 to {MOST_BINS}");
            return Err(Error::invalid(format!("{at}/detector/count"), "no such detector", permitted));
        }
        if spacing_mm.iter().any(|mm| !(LEAST_MM..=MOST_MM).contains(mm)) {
            let permitted = format!("{LEAST_MM:e} to {MOST_MM:e}");
            return Err(Error::invalid(format!("{at}/detector/spacing_mm"), "no such distance of bins", permitted));
        }
        if offset_mm.iter().any(|mm| !(-MOST_MM..=MOST_MM).contains(mm)) {
            let permitted = format!("-{MOST_MM:e} to {MOST_MM:e}");
            return Err(Error::invalid(format!("{at}/detector/offset_mm"), "no such place", permitted));
        }
        let data = count[0].saturating_mul(count[1]).saturating_mul(degrees.len());
        if data > MOST_DATA {
            return Err(Error::TooLarge {
                what: format!("a sinogram of {data} bins"),
                limit: format!("{MOST_DATA} bins"),
            });
        }
        let angles = degrees.into_iter().map(f64::to_radians).collect();
        Ok(Geometry::new(angles, count, spacing_mm, offset_mm))
    }
}
