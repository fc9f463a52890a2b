//! From readings of a detector to line integrals: −ln of the transmitted part (Beer and Lambert).
//!
//! A reading I with the detector's answer to no light, `dark`, and to the open beam, `flat`, has the transmission T = (I − dark) / (flat − dark). Of
//! counts the open beam may be one number, the photons per ray. The logarithm of a Poisson variable is biased by about 1 / 2N and is not defined at 0:
//! what is not above the dark frame counts as half a photon, or as half of the least transmission, and is counted.

use rayon::prelude::*;

use crate::error::{Error, Result};

/// The open beam and the dark frame, for each bin of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenBeam {
    dark: Vec<f32>,
    /// flat − dark.
    span: Vec<f32>,
}

/// Line integrals, and what was assumed.
pub struct LineIntegrals {
    /// One a reading.
    pub values: Vec<f32>,
    /// In words, if anything was.
    pub note: Option<String>,
}

impl OpenBeam {
    /// The beam of bins with a frame each, or of one number of photons per ray. Frames are means over those that were taken.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `/flat` if a bin of the open beam is not brighter than the dark frame.
    pub fn new(bins: usize, flat: Option<Vec<f32>>, dark: Option<Vec<f32>>, photons: Option<f64>) -> Result<Self> {
        let dark = dark.unwrap_or_else(|| vec![0.0; bins]);
        let flat = flat.unwrap_or_else(|| vec![photons.unwrap_or(1.0) as f32; bins]);
        let span: Vec<f32> = flat.iter().zip(&dark).map(|(flat, dark)| flat - dark).collect();
        let is_singular = |span: &f32| !(*span > 0.0 && span.is_finite());
        if let Some(bin) = span.iter().position(is_singular) {
            let count = span.iter().filter(|span| is_singular(span)).count();
            let detail =
                format!("{count} of {bins} bins are not above the dark frame, the first is bin {bin} of a view");
            return Err(Error::invalid(
                "/flat",
                detail,
                "an open beam that is brighter than the dark frame in every bin",
            ));
        }
        Ok(Self { dark, span })
    }

    /// The line integrals of readings, view by view. `are_counts` if they are photons.
    pub fn line_integrals(&self, readings: &[f32], are_counts: bool) -> LineIntegrals {
        let bins = self.span.len();
        // In double precision no quotient of floats is infinite, so that all logarithms are finite.
        let transmission =
            |i: usize| (f64::from(readings[i]) - f64::from(self.dark[i % bins])) / f64::from(self.span[i % bins]);
        let lost = (0..readings.len()).into_par_iter().filter(|i| transmission(*i) <= 0.0).count();
        let least = (0..readings.len()).into_par_iter().map(transmission).filter(|t| *t > 0.0);
        let least = if lost > 0 { least.min_by(f64::total_cmp).unwrap_or(1.0) } else { 1.0 };
        let floor = |i: usize| if are_counts { 0.5 / f64::from(self.span[i % bins]) } else { 0.5 * least };
        let value = |i: usize| {
            let t = transmission(i);
            -(if t > 0.0 { t } else { floor(i) }).ln() as f32
        };
        let values = (0..readings.len()).into_par_iter().map(value).collect();
        let taken = if are_counts { "half a photon" } else { "half of the least transmission" };
        let note = (lost > 0).then(|| {
            let part = 100.0 * lost as f64 / readings.len() as f64;
            format!("{lost} of {} readings ({part:.2} %) are not above the dark frame and were taken for {taken}: their line integrals are not known", readings.len())
        });
        LineIntegrals { values, note }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_become_line_integrals_bin_by_bin() {
        let beam = OpenBeam::new(2, Some(vec![110.0, 20.0]), Some(vec![10.0, 0.0]), None).expect("a beam");
        let found = beam.line_integrals(&[60.0, 20.0, 10.0, 5.0, 35.0, 2.0], false);
        // Reading 2 is dark: half of the least transmission, which is 0.1.
        let truth = [2f64.ln(), 0.0, 20f64.ln(), 4f64.ln(), 4f64.ln(), 10f64.ln()];
        for (found, truth) in found.values.iter().zip(truth) {
            assert!((f64::from(*found) - truth).abs() < 1e-6, "{found} for {truth}");
        }
        assert!(found.note.is_some_and(|note| note.starts_with("1 of 6")));
        let counts = OpenBeam::new(1, None, None, Some(1000.0)).expect("a beam");
        let found = counts.line_integrals(&[500.0, 0.0], true);
        assert!((f64::from(found.values[0]) - 2f64.ln()).abs() < 1e-6);
        assert!((f64::from(found.values[1]) - 2000f64.ln()).abs() < 1e-6);
        assert!(counts.line_integrals(&[1.0], true).note.is_none());
        let faint = OpenBeam::new(1, Some(vec![1e-40]), None, None).expect("a beam");
        assert!(faint.line_integrals(&[3e38], false).values[0].is_finite());
    }

    #[test]
    fn a_dead_bin_of_the_open_beam_is_refused() {
        for flat in [vec![1.0, 5.0], vec![f32::NAN, 6.0]] {
            let refused = OpenBeam::new(2, Some(flat), Some(vec![1.0, 2.0]), None);
            assert!(format!("{refused:?}").contains("1 of 2 bins"), "{refused:?}");
        }
    }
}
