//! The geometry of a measurement: where each bin of each view looks.
//!
//! A ray of a parallel view at the angle θ has x cosθ + y sinθ = u and z = v; it points along (−sinθ, cosθ, 0). Bin i of a side is at (i − (n − 1)/2) ·
//! spacing + offset. Data are u fastest, then v, then the view.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Ray;
use crate::error::{Error, Result};

/// The most bins of a side of the detector, and the most views.
const MOST_BINS: usize = 8192;
const MOST_VIEWS: usize = 65_536;
/// The most bins of all views together.
const MOST_DATA: usize = 1 << 28;

/// The geometry in a request.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AnglesRequest {
    /// Each on its own. It stands before the other, which would take three numbers for its fields.
    Each(#[schemars(length(min = 1, max = 65_536), inner(range(min = -36_000, max = 36_000)))] Vec<f64>),
    /// Evenly spread ones.
    Even(EvenAngles),
}

impl Default for AnglesRequest {
    fn default() -> Self {
        Self::Even(EvenAngles { from: 0.0, to: default_to(), count: default_views() })
    }
}

/// Evenly spread angles.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
    /// The number of views.
    #[serde(default = "default_views")]
    #[schemars(range(min = 1, max = 65_536))]
    count: usize,
}

fn default_to() -> f64 {
    180.0
}

fn default_views() -> usize {
    360
}

/// The detector in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct DetectorRequest {
    /// Bins along u and v.
    #[serde(default = "default_count")]
    #[schemars(inner(range(min = 1, max = 8192)))]
    count: [usize; 2],
    /// Their distances, mm.
    #[serde(default = "default_spacing")]
    #[schemars(inner(range(min = 1e-6, max = 1e6)))]
    spacing_mm: [f64; 2],
    /// The place of the detector's centre, mm.
    #[serde(default)]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    offset_mm: [f64; 2],
}

impl Default for DetectorRequest {
    fn default() -> Self {
        Self { count: default_count(), spacing_mm: default_spacing(), offset_mm: [0.0; 2] }
    }
}

fn default_count() -> [usize; 2] {
    [256, 1]
}

fn default_spacing() -> [f64; 2] {
    [1.0; 2]
}

/// A valid geometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    angles: Vec<f64>,
    count: [usize; 2],
    spacing_mm: [f64; 2],
    offset_mm: [f64; 2],
}

impl GeometryRequest {
    /// Checks the geometry.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`; [`Error::TooLarge`] for more bins than a sinogram may have.
    pub fn resolve(&self, at: &str) -> Result<Geometry> {
        let Kind::Parallel = self.kind;
        let degrees: Vec<f64> = match &self.angles_deg {
            AnglesRequest::Each(angles) => angles.clone(),
            AnglesRequest::Even(even) => {
                if even.count > 1 && even.from == even.to {
                    let detail = format!("all {} views have one angle", even.count);
                    return Err(Error::invalid(format!("{at}/angles_deg/to"), detail, "another angle than from"));
                }
                (0..even.count).map(|i| even.from + (even.to - even.from) * i as f64 / even.count as f64).collect()
            }
        };
        if degrees.is_empty() || degrees.len() > MOST_VIEWS || degrees.iter().any(|angle| !angle.is_finite()) {
            let permitted = format!("1 to {MOST_VIEWS} finite angles");
            return Err(Error::invalid(format!("{at}/angles_deg"), "these are no views", permitted));
        }
        let DetectorRequest { count, spacing_mm, offset_mm } = self.detector;
        if count.iter().any(|n| !(1..=MOST_BINS).contains(n)) {
            let permitted = format!("1 to {MOST_BINS}");
            return Err(Error::invalid(format!("{at}/detector/count"), "no such detector", permitted));
        }
        let data = count[0].saturating_mul(count[1]).saturating_mul(degrees.len());
        if data > MOST_DATA {
            return Err(Error::TooLarge {
                what: format!("a sinogram of {data} bins"),
                limit: format!("{MOST_DATA} bins"),
            });
        }
        let angles = degrees.into_iter().map(f64::to_radians).collect();
        Ok(Geometry { angles, count, spacing_mm, offset_mm })
    }
}

impl Geometry {
    /// The angles of the views, radians.
    pub fn angles(&self) -> &[f64] {
        &self.angles
    }

    /// The number of views.
    pub fn views(&self) -> usize {
        self.angles.len()
    }

    /// Bins along u and v.
    pub fn count(&self) -> [usize; 2] {
        self.count
    }

    /// The distances of bins, mm.
    pub fn spacing_mm(&self) -> [f64; 2] {
        self.spacing_mm
    }

    /// The place of a bin, or between bins, along a side, mm.
    pub fn place_mm(&self, side: usize, bin: f64) -> f64 {
        (bin - 0.5 * (self.count[side] as f64 - 1.0)) * self.spacing_mm[side] + self.offset_mm[side]
    }

    /// The bin at a place along a side: the inverse of [`Self::place_mm`].
    pub fn bin(&self, side: usize, place_mm: f64) -> f64 {
        (place_mm - self.offset_mm[side]) / self.spacing_mm[side] + 0.5 * (self.count[side] as f64 - 1.0)
    }

    /// The ray of a bin.
    pub fn ray(&self, view: usize, [u, v]: [usize; 2]) -> Ray {
        let (sin, cos) = self.angles[view].sin_cos();
        let [u, v] = [self.place_mm(0, u as f64), self.place_mm(1, v as f64)];
        Ray { origin: DVec3::new(u * cos, u * sin, v), direction: DVec3::new(-sin, cos, 0.0) }
    }

    /// The weights Δθ of the views in an integral over half a turn, and the widest gap that no view covers, radians.
    ///
    /// A ray is the same from both sides, so angles count modulo π. A view stands for half of both gaps to its neighbours. A gap of more than
    /// twice the median one is missing data: its views stand for half a median gap there.
    pub fn weights(&self) -> (Vec<f64>, f64) {
        const PI: f64 = std::f64::consts::PI;
        let turned: Vec<f64> = self.angles.iter().map(|angle| angle.rem_euclid(PI)).collect();
        let mut order: Vec<usize> = (0..turned.len()).collect();
        order.sort_by(|a, b| turned[*a].total_cmp(&turned[*b]));
        let after = |i: usize| match order.get(i + 1) {
            Some(next) => turned[*next] - turned[order[i]],
            None => turned[order[0]] + PI - turned[order[i]],
        };
        let gaps: Vec<f64> = (0..order.len()).map(after).collect();
        // Views from both sides have gaps of nearly 0 between them, which say nothing of the others.
        let mut wide: Vec<f64> = gaps.iter().copied().filter(|gap| *gap > 1e-6 * PI / gaps.len() as f64).collect();
        wide.sort_by(f64::total_cmp);
        let median = wide.get(wide.len() / 2).copied().unwrap_or(PI);
        let kept: Vec<f64> = gaps.iter().map(|gap| if *gap > 2.0 * median { median } else { *gap }).collect();
        let mut weights = vec![0.0; order.len()];
        for (i, view) in order.iter().enumerate() {
            weights[*view] = 0.5 * (kept[i] + kept[(i + kept.len() - 1) % kept.len()]);
        }
        let missing = gaps.iter().filter(|gap| **gap > 2.0 * median).copied().fold(0.0, f64::max);
        (weights, missing)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn geometry(angles: serde_json::Value) -> Geometry {
        let request: GeometryRequest = serde_json::from_value(json!({"angles_deg": angles})).expect("a geometry");
        request.resolve("").expect("a valid geometry")
    }

    #[test]
    fn weights_add_up_to_half_a_turn_however_often_it_is_covered() {
        let pi = std::f64::consts::PI;
        for (to, count) in [(180.0, 180), (360.0, 180), (360.0, 181), (-180.0, 7), (720.0, 90)] {
            let (weights, missing) = geometry(json!({"to": to, "count": count})).weights();
            let sum: f64 = weights.iter().sum();
            assert!((sum - pi).abs() < 1e-9 && missing == 0.0, "{to} {count}: {sum}, {missing}");
        }
        let (weights, missing) = geometry(json!({"to": 120.0, "count": 120})).weights();
        assert!(
            (weights.iter().sum::<f64>() - pi * 2.0 / 3.0).abs() < 1e-9 && (missing - pi / 180.0 * 61.0).abs() < 1e-9
        );
        assert_eq!(geometry(json!([30])).weights().0, [pi], "one view stands for all");
    }

    #[test]
    fn bins_are_where_they_are_said_to_be() {
        let request =
            json!({"angles_deg": [30], "detector": {"count": [4, 3], "spacing_mm": [2, 5], "offset_mm": [1, -1]}});
        let geometry =
            serde_json::from_value::<GeometryRequest>(request).expect("one").resolve("").expect("a valid one");
        assert_eq!(
            [geometry.place_mm(0, 0.0), geometry.place_mm(0, 3.0), geometry.place_mm(1, 1.0)],
            [-2.0, 4.0, -1.0]
        );
        assert!((geometry.bin(0, geometry.place_mm(0, 1.7)) - 1.7).abs() < 1e-12);
        let Ray { origin, direction } = geometry.ray(0, [3, 2]);
        let normal = DVec3::new(0.75f64.sqrt(), 0.5, 0.0);
        assert!((origin.dot(normal) - 4.0).abs() < 1e-12 && (origin.z - 4.0).abs() < 1e-12);
        assert!(direction.dot(normal).abs() < 1e-12 && (direction.length() - 1.0).abs() < 1e-12);
    }
}
