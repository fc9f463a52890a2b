//! The Pareto front, and the fastest setting for an error.

/// True for the points that no other point beats in both: no faster point is as good, and no point that is as fast is better.
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
    fn the_front_is_what_nothing_beats() {
        let points = [(1.0, 9.0), (2.0, 5.0), (3.0, 6.0), (4.0, 1.0), (2.0, 5.0)];
        assert_eq!(pareto(&points), [true, true, false, true, true]);
        assert_eq!(fastest_within(&points, 5.0), Some(1));
        assert_eq!(fastest_within(&points, 0.5), None);
        assert_eq!(best_within(&points, 3.5), Some(1));
        assert_eq!(best_within(&points, 0.5), None);
    }
}
