//! Rows of bins for the device: projected, checked by their moments, filtered and weighted, with zeros around.

use rayon::prelude::*;

use super::{MARGIN, Method, Reconstruction};
use crate::error::Result;
use crate::tomography::{Filtering, Moments};

/// What makes rows of a reconstruction's views.
pub(super) struct Rows {
    filtering: Option<Filtering>,
    /// The weight of each view.
    weights: Vec<f64>,
    /// The widest gap that no view covers, radians.
    pub missing: f64,
}

impl Rows {
    pub fn new(of: &Reconstruction) -> Self {
        let (geometry, (weights, missing)) = (&of.geometry, of.geometry.weights());
        let filtering = match of.method {
            Method::Filtered(filter, cutoff) => {
                Some(Filtering::new(filter, cutoff, geometry.count()[0], geometry.spacing_mm()[0]))
            }
            Method::Plain | Method::Deconvolved => None,
        };
        Self { filtering, weights, missing }
    }

    /// Floats from one row to the next.
    pub fn stride(of: &Reconstruction) -> usize {
        of.geometry.count()[0] + 2 * MARGIN
    }

    /// The rows `rows` of all views, numbered view by view, and their moments.
    pub fn make(&self, of: &Reconstruction, rows: std::ops::Range<usize>) -> Result<(Vec<f32>, Vec<Moments>)> {
        let made: Vec<(Vec<f32>, Moments)> =
            rows.into_par_iter().map(|row| self.row(of, row)).collect::<Result<_>>()?;
        let (rows, moments): (Vec<_>, Vec<_>) = made.into_iter().unzip();
        Ok((rows.concat(), moments))
    }

    fn row(&self, of: &Reconstruction, row: usize) -> Result<(Vec<f32>, Moments)> {
        let [bins, rows] = of.geometry.count();
        let (view, v) = (row / rows, row % rows);
        let values = of.data.row(&of.geometry, view, v);
        let moments = Moments::of_row(&of.geometry, &values);
        let filtered = self.filtering.as_ref().map_or(Ok(values.clone()), |filtering| filtering.of(&values))?;
        let mut padded = vec![0.0; bins + 2 * MARGIN];
        for (to, value) in padded[MARGIN..].iter_mut().zip(filtered) {
            *to = (self.weights[view] * value) as f32;
        }
        Ok((padded, moments))
    }
}
