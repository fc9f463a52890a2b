//! The chance by which mean squares exceed their estimates.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// The most degrees of freedom. With more of them their number does not matter.
const MOST_FREEDOM: f64 = 1e4;

/// The factor by which a root mean square of `freedom` degrees of freedom may exceed an estimate of `times` as many, in 19 of 20 cases: the ratio of their
/// squares has Fisher's distribution. NaN stands for many degrees of freedom.
pub fn by_chance(freedom: f64, times: f64) -> f64 {
    let freedom = if freedom.is_finite() { freedom.clamp(1.0, MOST_FREEDOM) } else { MOST_FREEDOM };
    let ratio = FisherSnedecor::new(freedom, times * freedom);
    ratio.map_or(1.0, |ratio| ratio.inverse_cdf(0.95)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_that_of_tables() {
        // F of 1 and 8 degrees of freedom at 0.95 is 5.318, of 4 and 32 it is 2.668, of 10 and 10 it is 2.978.
        for (freedom, times, ratio) in [(1.0, 8.0, 5.318), (4.0, 8.0, 2.668), (10.0, 1.0, 2.978)] {
            assert!((by_chance(freedom, times).powi(2) - ratio).abs() < 1e-3, "{}", by_chance(freedom, times).powi(2));
        }
        assert!(by_chance(1e9, 8.0) < 1.02 && by_chance(f64::NAN, 8.0) < 1.02);
        assert_eq!(by_chance(0.0, 8.0), by_chance(1.0, 8.0));
    }
}
