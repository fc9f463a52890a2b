//! Power laws through measured points: lines on logarithmic axes.

/// The law y = factor x^power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// The value of y at x = 1.
    pub factor: f64,
    /// The slope on logarithmic axes.
    pub power: f64,
}

impl PowerLaw {
    /// The least-squares line of ln y over ln x; `None` for fewer than three points, or if a coordinate is not above 0.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 3 || points.iter().any(|(x, y)| !(*x > 0.0 && *y > 0.0)) {
            return None;
        }
        let n = points.len() as f64;
        let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
        let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        let spread: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
        let power = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread;
        power.is_finite().then_some(Self { factor: (my - power * mx).exp(), power })
    }

    /// The value of y at x.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(points: &[(f64, f64)]) -> Option<f64> {
        PowerLaw::through(points).map(|l| l.power)
    }

    #[test]
    fn a_planted_slope_is_found_and_a_wrong_one_too() {
        let law =
            |power: f64| -> Vec<(f64, f64)> { [1.0, 3.0, 10.0, 40.0].map(|x| (x, 7.0 * f64::powf(x, power))).to_vec() };
        for power in [-0.5, 1.0, 2.0, -0.3] {
            assert!((slope(&law(power)).unwrap_or(9.0) - power).abs() < 1e-12);
        }
        assert!((PowerLaw::through(&law(-0.5)).map_or(0.0, |l| l.at(100.0)) - 0.7).abs() < 1e-12);
        // With a floor that noise does not fall below, the slope is not a half any more.
        let floored: Vec<(f64, f64)> = law(-0.5).iter().map(|p| (p.0, p.1.max(3.0))).collect();
        assert!(slope(&floored).unwrap_or(0.0) > -0.4);
        assert_eq!(slope(&law(1.0)[..2]), None);
        assert_eq!(slope(&[(1.0, 0.0), (2.0, 1.0), (3.0, 1.0)]), None);
    }
}
