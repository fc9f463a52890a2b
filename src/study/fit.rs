//! Slopes on logarithmic axes, the Pareto front, and the fastest setting for an error.

/// The least-squares slope of ln y over ln x; none of fewer than three points, or of points that are not above 0.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 || points.iter().any(|(x, y)| !(*x > 0.0 && *y > 0.0)) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let found = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread;
    found.is_finite().then_some(found)
}

/// Which points no other beats in both: none that is faster is as good, none that is as fast is better.
pub fn pareto(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    points.iter().map(|p| !points.iter().any(|other| beats(other, p))).collect()
}

/// The index of the fastest point whose error is at most `bound`.
pub fn fastest_within(points: &[(f64, f64)], bound: f64) -> Option<usize> {
    let good = points.iter().enumerate().filter(|(_, p)| p.1 <= bound);
    good.min_by(|a, b| a.1.0.total_cmp(&b.1.0)).map(|(i, _)| i)
}

/// The index of the point of the least error that takes at most `time`.
pub fn best_within(points: &[(f64, f64)], time: f64) -> Option<usize> {
    let fast = points.iter().enumerate().filter(|(_, p)| p.0 <= time);
    fast.min_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_slope_is_found_and_a_wrong_one_too() {
        let law =
            |power: f64| -> Vec<(f64, f64)> { [1.0, 3.0, 10.0, 40.0].map(|x| (x, 7.0 * f64::powf(x, power))).to_vec() };
        for power in [-0.5, 1.0, 2.0, -0.3] {
            assert!((slope(&law(power)).unwrap_or(9.0) - power).abs() < 1e-12);
        }
        // A floor that noise does not fall below: no slope of a half any more.
        let floored: Vec<(f64, f64)> = law(-0.5).iter().map(|p| (p.0, p.1.max(3.0))).collect();
        assert!(slope(&floored).unwrap_or(0.0) > -0.4);
        assert_eq!(slope(&law(1.0)[..2]), None);
        assert_eq!(slope(&[(1.0, 0.0), (2.0, 1.0), (3.0, 1.0)]), None);
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(1.0, 9.0), (2.0, 5.0), (3.0, 6.0), (4.0, 1.0), (2.0, 5.0)];
        assert_eq!(pareto(&points), [true, true, false, true, true]);
        assert_eq!(fastest_within(&points, 5.0), Some(1));
        assert_eq!(fastest_within(&points, 0.5), None);
        assert_eq!(best_within(&points, 3.5), Some(1));
        assert_eq!(best_within(&points, 0.5), None);
    }
}
