//! Estimates with their standard errors, and the upper bounds that follow from them.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// The standard errors above an estimate which one in a hundred normal variables exceeds. A margin of 95 of 100 would cover 95 % of the pictures as
/// often as not, and an estimate from few pixels is not normal: it is low where it has missed what is rare.
pub(super) const UPPER: f64 = 2.326;

/// Of more pixels than these the margin is that of a normal estimate.
const MANY: f64 = 1e4;

/// An estimate and its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    /// The upper bound that 99 of 100 estimates keep.
    pub fn upper(&self) -> f64 {
        self.value.max(0.0) + UPPER * self.error
    }

    /// The estimate with no greater bound than this, unless its value is greater.
    pub(super) fn at_most(self, upper: f64) -> Self {
        Self { error: self.error.min((upper - self.value.max(0.0)).max(0.0) / UPPER), ..self }
    }

    /// The mean of numbers.
    pub fn mean(numbers: impl Iterator<Item = f64> + Clone) -> Self {
        let count = numbers.clone().count().max(1) as f64;
        let value = numbers.clone().sum::<f64>() / count;
        let squares: f64 = numbers.map(|x| (x - value).powi(2)).sum();
        Self { value, error: squares.sqrt() / count }
    }

    /// The ratio of the sums of two numbers each, if the second is above 0. Its error is that of the ratio estimator (Cochran, "Sampling
    /// Techniques", 1977, 6.4): √Σ(a − r b)² / Σ b.
    pub fn ratio(numbers: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Self> {
        let [a, b] = numbers.clone().fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        let value = (b > 0.0).then(|| a / b)?;
        let squares: f64 = numbers.map(|[x, y]| (x - value * y).powi(2)).sum();
        Some(Self { value, error: squares.sqrt() / b })
    }

    /// The mean of the first of two numbers each over all there are, where the mean of the second is 1: the linear regression estimator (Cochran, 7.1),
    /// ȳ + b (1 − x̄) with b = Σ(x − x̄) y / Σ(x − x̄)², and error √(Σ e² / (n (n − 2))). The first numbers are not negative: b is kept from 0, which is
    /// their mean, to ȳ / x̄, which is their ratio.
    pub(super) fn regressed(numbers: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let count = numbers.clone().count().max(1) as f64;
        let [y, x] = numbers.clone().fold([0.0; 2], |[y, x], [v, u]| [y + v / count, x + u / count]);
        let [both, square] =
            numbers.clone().fold([0.0; 2], |[b, s], [v, u]| [b + (u - x) * (v - y), s + (u - x).powi(2)]);
        let slope = if square > 0.0 && x > 0.0 { (both / square).clamp(0.0, y.max(0.0) / x) } else { 0.0 };
        let squares: f64 = numbers.map(|[v, u]| (v - y - slope * (u - x)).powi(2)).sum();
        Self { value: y + slope * (1.0 - x), error: (squares / (count * (count - 2.0).max(1.0))).sqrt() }
    }
}

/// The effective number of pixels that matter, (Σ |x|)² / Σ x².
pub(super) fn matter(numbers: impl Iterator<Item = f64>) -> f64 {
    let (sum, squares) = numbers.fold((0.0, 0.0), |(sum, squares), x| (sum + x.abs(), squares + x * x));
    if squares > 0.0 { sum * sum / squares } else { f64::INFINITY }
}

/// The factor by which the margin of an estimate from so many pixels is wider than that of a normal one: Student's, of one degree of freedom fewer.
pub(super) fn of_few(pixels: f64) -> f64 {
    if pixels.is_nan() || pixels > MANY {
        return 1.0;
    }
    StudentsT::new(0.0, 1.0, (pixels - 1.0).max(1.0)).map_or(1.0, |t| t.inverse_cdf(0.99) / UPPER).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_pixels_widen_the_margin() {
        assert!((matter([1.0, -1.0, 0.0, 0.0].into_iter()) - 2.0).abs() < 1e-12);
        // Student's 99 % points of 1, 5 and 30 degrees of freedom are 31.82, 3.365 and 2.457.
        for (pixels, point) in [(1.0, 31.82), (2.0, 31.82), (6.0, 3.365), (31.0, 2.457)] {
            assert!((UPPER * of_few(pixels) - point).abs() < 0.01, "{pixels}: {}", UPPER * of_few(pixels));
        }
        assert!(of_few(1e4) < 1.001 && (of_few(f64::INFINITY) - 1.0).abs() < 1e-12);
        let wide = Estimate { value: 1.0, error: 5.0 };
        assert!((wide.at_most(3.0).upper() - 3.0).abs() < 1e-12 && (wide.at_most(0.5).upper() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_regression_takes_from_the_mean_what_the_choice_of_the_pixels_added() {
        // Pixels that vary three times as much as the picture's do.
        let x = [0.0, 3.0, 6.0, 3.0, 0.0, 6.0];
        let of = |y: [f64; 6]| Estimate::regressed(y.into_iter().zip(x).map(|(y, x)| [y, x]));
        let (proportional, even) = (of(x.map(|x| 0.5 * x)), of([2.0; 6]));
        assert!((proportional.value - 0.5).abs() < 1e-12 && proportional.error < 1e-12, "{proportional:?}");
        assert!((even.value - 2.0).abs() < 1e-12 && even.error < 1e-12, "{even:?}");
        // 1 + x / 2, and what falls as x grows: no less than the mean.
        assert!((of(x.map(|x| 1.0 + 0.5 * x)).value - 1.5).abs() < 1e-12);
        assert!((of(x.map(|x| 6.0 - x)).value - 3.0).abs() < 1e-12);
        // Residuals of ±1 that go with no x: error √(6 / (6 · 4)).
        let noisy = of([1.0, 1.0, 1.0, -1.0, -1.0, -1.0].map(|e| 5.0 + e));
        assert!((noisy.error - 0.5).abs() < 1e-12, "{noisy:?}");
    }
}
