//! A check of a sinogram by its moments (Helgason, "The Radon Transform", 1980; Ludwig, CPAM 19, 1966): the sum of a parallel view is the same for all
//! angles, and its centroid moves as a cosine about the axis.

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Geometry;

/// The moments of a view: the sum of its values, and of its values times their place, mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// Σ p, value · mm.
    pub sum: f64,
    /// Σ u p, value · mm².
    pub first: f64,
    /// The greatest magnitude of a value, and that of the outermost bins.
    pub greatest: [f64; 2],
}

impl Moments {
    /// The moments of a row of bins.
    pub fn of_row(geometry: &Geometry, values: &[f64]) -> Self {
        let ends = [values.first(), values.last()].into_iter().flatten();
        Self {
            sum: values.iter().sum(),
            first: values.iter().enumerate().map(|(u, p)| geometry.place_mm(0, u as f64) * p).sum(),
            greatest: [
                values.iter().fold(0.0, |most, p| p.abs().max(most)),
                ends.fold(0.0, |most, p| p.abs().max(most)),
            ],
        }
    }

    /// Adds the moments of another row of the same view.
    pub fn add(&mut self, row: &Self) {
        self.sum += row.sum;
        self.first += row.first;
        for (greatest, of_row) in self.greatest.iter_mut().zip(row.greatest) {
            *greatest = greatest.max(of_row);
        }
    }
}

/// What the moments of all views say.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DataCheck {
    /// The standard deviation of the sums of views, as a part of their mean.
    pub sum_deviation: f64,
    /// The view whose sum is farthest from the others', from 0.
    pub farthest_view: usize,
    /// Its distance from the median, as a part of it.
    pub farthest: f64,
    /// The object's centroid by the views' centroids, mm.
    pub centroid_mm: [f64; 2],
    /// The place of the axis on the detector by the views' centroids, mm. It is 0 if the geometry is right.
    pub axis_mm: f64,
    /// The greatest value at the detector's edges as a part of the greatest of all.
    pub at_edges: f64,
}

/// A sum may differ by this part before it is worth a word.
const SUMS_DIFFER: f64 = 0.02;
/// The axis may be off by this part of a bin.
const OFF_AXIS: f64 = 0.25;
/// Edges may have this part of the greatest value.
const AT_EDGES: f64 = 0.02;

impl DataCheck {
    /// Checks views at `angles`, radians. `None` without anything in them.
    pub fn of(angles: &[f64], moments: &[Moments]) -> Option<Self> {
        let greatest = |i: usize| moments.iter().map(|m| m.greatest[i]).fold(0.0, f64::max);
        let mut sums: Vec<f64> = moments.iter().map(|m| m.sum).collect();
        sums.sort_by(f64::total_cmp);
        let median = *sums.get(sums.len() / 2)?;
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        if median == 0.0 || mean == 0.0 {
            return None;
        }
        let deviation = (sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / sums.len() as f64).sqrt();
        let off = |m: &Moments| (m.sum / median - 1.0).abs();
        let farthest_view = (0..moments.len()).max_by(|a, b| off(&moments[*a]).total_cmp(&off(&moments[*b])))?;
        // Least squares of c = x cosθ + y sinθ + axis.
        let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for (angle, m) in angles.iter().zip(moments).filter(|(_, m)| m.sum != 0.0) {
            let row = DVec3::new(angle.cos(), angle.sin(), 1.0);
            normal += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            right += row * (m.first / m.sum);
        }
        let is_known = normal.determinant().abs() > 1e-9 * (moments.len() as f64).powi(3);
        let found = if is_known { normal.inverse() * right } else { DVec3::ZERO };
        Some(Self {
            sum_deviation: (deviation / mean).abs(),
            farthest_view,
            farthest: moments[farthest_view].sum / median - 1.0,
            centroid_mm: [found.x, found.y],
            axis_mm: found.z,
            at_edges: if greatest(0) > 0.0 { greatest(1) / greatest(0) } else { 0.0 },
        })
    }

    /// What is wrong, as codes with words.
    pub fn warnings(&self, spacing_mm: f64) -> Vec<(&'static str, String)> {
        let mut warnings = Vec::new();
        if self.at_edges > AT_EDGES {
            let part = 100.0 * self.at_edges;
            warnings.push(("truncation", format!("the outermost bins have {part:.0} % of the greatest value: the object is wider than the detector, so values near its rim are wrong")));
        } else if self.farthest.abs() > SUMS_DIFFER {
            let (view, part) = (self.farthest_view, 100.0 * self.farthest);
            warnings.push(("views_differ", format!("view {view} (from 0) has a sum {part:+.0} % off the median, and all views of one object have the same: it is lost, or its geometry is wrong")));
        }
        if self.at_edges <= AT_EDGES && self.axis_mm.abs() > OFF_AXIS * spacing_mm {
            warnings.push((
                "off_axis",
                format!(
                    "the centroids of the views turn about u = {:.4} mm in place of 0: subtract that from offset_mm",
                    self.axis_mm
                ),
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views(count: usize, change: impl Fn(usize, &mut Moments)) -> (Vec<f64>, Vec<Moments>) {
        let angles: Vec<f64> = (0..count).map(|i| std::f64::consts::PI * i as f64 / count as f64).collect();
        let view = |(i, angle): (usize, &f64)| {
            let centroid = 3.0 * angle.cos() - 2.0 * angle.sin();
            let mut moments = Moments { sum: 5.0, first: 5.0 * centroid, greatest: [1.0, 0.0] };
            change(i, &mut moments);
            moments
        };
        let moments = angles.iter().enumerate().map(view).collect();
        (angles, moments)
    }

    fn codes(count: usize, change: impl Fn(usize, &mut Moments)) -> Vec<&'static str> {
        let (angles, moments) = views(count, change);
        DataCheck::of(&angles, &moments).expect("data").warnings(1.0).into_iter().map(|(code, _)| code).collect()
    }

    #[test]
    fn moments_tell_what_is_wrong_with_views() {
        let (angles, moments) = views(90, |_, _| ());
        let check = DataCheck::of(&angles, &moments).expect("data");
        assert!((check.centroid_mm[0] - 3.0).abs() < 1e-9 && (check.centroid_mm[1] + 2.0).abs() < 1e-9);
        assert!(check.axis_mm.abs() < 1e-9 && check.sum_deviation < 1e-12 && check.warnings(1.0).is_empty());
        assert_eq!(
            codes(90, |i, m| if i == 17 {
                (m.sum, m.first) = (0.0, 0.0)
            }),
            ["views_differ"]
        );
        assert_eq!(codes(90, |_, m| m.first += 5.0 * 0.8), ["off_axis"]);
        assert_eq!(codes(90, |_, m| m.greatest[1] = 0.2), ["truncation"]);
        assert_eq!(DataCheck::of(&angles, &vec![Moments::default(); 90]), None);
        assert!(
            DataCheck::of(&angles[..1], &moments[..1]).is_some_and(|one| one.axis_mm == 0.0),
            "one view tells no axis"
        );
    }
}
