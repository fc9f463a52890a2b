//! Filters of filtered backprojection.

use std::f64::consts::PI;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The filter of the views: the ramp |ω| times a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// The ramp alone (Ramachandran & Lakshminarayanan, 1971).
    #[default]
    RamLak,
    /// The ramp times sinc (Shepp & Logan, 1974).
    SheppLogan,
    /// The ramp times cosine.
    Cosine,
    /// The ramp times 0.54 + 0.46 cos.
    Hamming,
    /// The ramp times ½ + ½ cos.
    Hann,
}

impl Filter {
    /// The window at a frequency, in parts of the cut-off; 0 beyond that.
    fn window(self, part: f64) -> f64 {
        let quarter = 0.5 * PI * part;
        match self {
            _ if part > 1.0 => 0.0,
            Self::RamLak => 1.0,
            Self::SheppLogan if part == 0.0 => 1.0,
            Self::SheppLogan => quarter.sin() / quarter,
            Self::Cosine => quarter.cos(),
            Self::Hamming => 0.54 + 0.46 * (PI * part).cos(),
            Self::Hann => 0.5 + 0.5 * (PI * part).cos(),
        }
    }
}

/// A filter for rows of some length. It may be used by many threads.
pub struct Filtering {
    bins: usize,
    /// The filter's values at the frequencies of a padded row, over its length.
    spectrum: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Filtering {
    /// The filter for rows of `bins` bins at a distance of `spacing_mm`, with its cut-off as a part of the highest frequency.
    ///
    /// The ramp is that of its spatial kernel, h₀ = 1/4τ², h_n = −1/(π²n²τ²) for odd n, else 0 (Kak & Slaney, 1988, 3.3.3): values of |ω| at the
    /// frequencies of a finite row would have no constant part.
    pub fn new(filter: Filter, cutoff: f64, bins: usize, spacing_mm: f64) -> Self {
        let length = (2 * bins).next_power_of_two();
        let mut planner = RealFftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
        let mut kernel = vec![0.0; length];
        kernel[0] = 0.25;
        for n in (1..bins).step_by(2) {
            let value = -1.0 / (PI * n as f64).powi(2);
            (kernel[n], kernel[length - n]) = (value, value);
        }
        let mut spectrum = forward.make_output_vec();
        // The lengths are those of the plan.
        let _ = forward.process(&mut kernel, &mut spectrum);
        let highest = (length / 2) as f64;
        let value = |(i, value): (usize, &Complex<f64>)| {
            value.re * filter.window(i as f64 / highest / cutoff) / (spacing_mm * length as f64)
        };
        Self { bins, spectrum: spectrum.iter().enumerate().map(value).collect(), forward, inverse }
    }

    /// A filtered row, value · mm per mm² of a row of value · mm.
    ///
    /// # Errors
    /// [`Error::Internal`] if the row has another length.
    pub fn of(&self, row: &[f64]) -> Result<Vec<f64>> {
        if row.len() != self.bins {
            return Err(Error::internal(format!("a row of {} bins for a filter of {}", row.len(), self.bins)));
        }
        let (mut padded, mut spectrum) = (self.forward.make_input_vec(), self.forward.make_output_vec());
        padded[..row.len()].copy_from_slice(row);
        self.forward.process(&mut padded, &mut spectrum).map_err(Error::internal)?;
        spectrum.iter_mut().zip(&self.spectrum).for_each(|(value, filter)| *value *= filter);
        self.inverse.process(&mut spectrum, &mut padded).map_err(Error::internal)?;
        padded.truncate(self.bins);
        Ok(padded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row with a single 1.
    fn response(filter: Filter, cutoff: f64, bins: usize, at: usize) -> Vec<f64> {
        let mut row = vec![0.0; bins];
        row[at] = 1.0;
        Filtering::new(filter, cutoff, bins, 1.0).of(&row).expect("a row")
    }

    #[test]
    fn the_ramp_is_that_of_its_spatial_kernel() {
        let bins = 513;
        let found = response(Filter::RamLak, 1.0, bins, 256);
        assert!((found[256] - 0.25).abs() < 1e-12);
        for n in 1..256usize {
            let truth = if n % 2 == 0 { 0.0 } else { -1.0 / (PI * n as f64).powi(2) };
            assert!((found[256 + n] - truth).abs() < 1e-12 && (found[256 - n] - truth).abs() < 1e-12, "{n}");
        }
        // Cut at M = 256 taps, the sum of the kernel leaves 1/(π²M).
        let sum: f64 = found.iter().sum();
        assert!((sum / 3.9578e-4 - 1.0).abs() < 1e-3, "{sum}");
    }

    #[test]
    fn windows_damp_and_bins_have_their_width() {
        let peak = |filter, cutoff| response(filter, cutoff, 255, 127)[127];
        let ramp = peak(Filter::RamLak, 1.0);
        // ∫₀¹ f w(f) df / 2 for each window.
        for (filter, truth) in [
            (Filter::SheppLogan, 2.0 / (PI * PI)),
            (Filter::Cosine, 0.5 * (2.0 / PI - 4.0 / (PI * PI))),
            (Filter::Hann, 0.25 * (0.5 - 2.0 / (PI * PI))),
        ] {
            let found = peak(filter, 1.0);
            assert!((found / truth - 1.0).abs() < 2e-3 && found < ramp, "{filter:?}: {found}, {truth}");
        }
        assert!(
            (peak(Filter::RamLak, 0.5) / (0.25 * ramp) - 1.0).abs() < 0.02,
            "half of the band has a quarter of the ramp"
        );
        let row: Vec<f64> = (0..64).map(|i| f64::from(i % 7)).collect();
        let of = |spacing| Filtering::new(Filter::RamLak, 1.0, 64, spacing).of(&row).expect("a row")[20];
        assert!((of(0.5) / of(1.0) - 2.0).abs() < 1e-9);
    }
}
