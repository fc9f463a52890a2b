//! The geometry of a measurement: where each bin of each view looks.
//!
//! A ray of a parallel view at the angle θ has x cosθ + y sinθ = u and z = v; it points along (−sinθ, cosθ, 0). Bin i of a side is at (i − (n − 1)/2) ·
//! spacing + offset. Data are u fastest, then v, then the view.

use glam::DVec3;

use super::Ray;

/// A valid geometry.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    angles: Vec<f64>,
    count: [usize; 2],
    spacing_mm: [f64; 2],
    offset_mm: [f64; 2],
}

impl Geometry {
    /// Views at `angles`, radians, of bins along u and v.
    pub(super) fn new(angles: Vec<f64>, count: [usize; 2], spacing_mm: [f64; 2], offset_mm: [f64; 2]) -> Self {
        Self { angles, count, spacing_mm, offset_mm }
    }

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

    /// What a bin along u, and one along v, add to a ray's place, mm.
    pub fn bin_steps(&self, view: usize) -> [DVec3; 2] {
        let (sin, cos) = self.angles[view].sin_cos();
        let [du, dv] = self.spacing_mm;
        [DVec3::new(du * cos, du * sin, 0.0), DVec3::new(0.0, 0.0, dv)]
    }

    /// True if the detector sees a part of the body between some points, mm, in a view: if the points' places on it reach its bins on both sides.
    pub fn sees(&self, view: usize, points: &[DVec3]) -> bool {
        let (sin, cos) = self.angles[view].sin_cos();
        (0..2).all(|side| {
            let place = |p: &DVec3| self.bin(side, if side == 0 { p.x * cos + p.y * sin } else { p.z });
            let low = points.iter().map(place).fold(f64::INFINITY, f64::min);
            let high = points.iter().map(place).fold(f64::NEG_INFINITY, f64::max);
            low <= self.count[side] as f64 - 0.5 && high >= -0.5
        })
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
    use crate::tomography::GeometryRequest;

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
