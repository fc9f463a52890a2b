//! Where the grid of a probe begins in the picture. A grid that passes over what varies would say nothing of it.

use crate::error::Result;
use crate::film::luminance;
use crate::run::context::DeviceContext;
use crate::run::layer::Layer;

/// A grid that sees less than this part of the variance of an average one is moved.
const ENOUGH: f64 = 0.75;
/// Rows of clusters that are read at once.
const BAND: usize = 128;

/// The clusters of a picture, in cells: a probe has one of each `sparse`-th cell, at the same place in all of them.
pub struct Cells {
    /// A cell has `side` by `side` clusters of 2^`cluster` by 2^`cluster` pixels.
    pub side: usize,
    pub cluster: u32,
    /// Cells across and down.
    pub count: [usize; 2],
    pub sparse: usize,
}

/// The place at which a grid begins.
pub struct Origin {
    /// In pixels of the picture.
    pub at: [usize; 2],
    /// The mean over the picture's pixels of the square of the standard error that they would have if their samples were random; of one sample, of the
    /// variance of the cluster.
    pub random: f64,
}

/// The variances of a picture's clusters, summed over those above each other at the same place in a cell.
struct Columns {
    /// Of rows of cells that a sparse probe sees: for each row of a cell, each cluster across.
    seen: Vec<f64>,
    /// Of the other rows of cells.
    others: Vec<f64>,
}

impl Columns {
    fn sum(&self) -> f64 {
        self.seen.iter().chain(&self.others).sum()
    }
}

impl Cells {
    /// The cluster of a cell at which the grid begins: the first one, unless that grid sees less than [`ENOUGH`] of the variance
    /// that an average one sees. Then it is the grid that sees the least above the average.
    pub fn origin(&self, context: &DeviceContext, main: &Layer) -> Result<Origin> {
        if self.side < 2 || self.cluster != 1 {
            return Ok(Origin { at: [0; 2], random: 0.0 });
        }
        let across = self.count[0] * self.side;
        let mut columns = Columns { seen: vec![0.0; self.side * across], others: vec![0.0; across] };
        // Of one sample the colours are read, else the squared deviations behind them.
        let is_light = main.samples < 2;
        let (first, channels) = if is_light { (0, 4) } else { (16 * main.width * main.height, 1) };
        let row = 2 * main.width;
        let mut variances = vec![0.0; across];
        let (mut read, mut light) = (vec![0.0f32; channels * row * BAND], vec![0.0; row]);
        let rows = self.count[1] * self.side;
        for from in (0..rows).step_by(BAND) {
            let band = &mut read[..channels * row * BAND.min(rows - from)];
            context.device.read(&main.buffer, first + 4 * channels * row * from, band)?;
            for (y, pixels) in (from..).zip(band.chunks(channels * row)) {
                for (light, rgba) in light.iter_mut().zip(pixels.chunks_exact(4)).filter(|_| is_light) {
                    *light = luminance(rgba) as f32;
                }
                self.variances(if is_light { &light } else { pixels }, is_light, &mut variances);
                self.add(y, &variances, &mut columns);
            }
        }
        let n = f64::from(main.samples);
        let random = columns.sum() / (4 * across * rows) as f64 / if is_light { 1.0 } else { n * (n - 1.0) };
        Ok(Origin { at: self.chosen(&columns).map(|n| n << self.cluster), random })
    }

    /// The variance of each cluster of a row of them, times a constant: that of its pixels' samples, or of one sample that among its pixels.
    fn variances(&self, row: &[f32], is_light: bool, out: &mut [f32]) {
        let (upper, lower) = row.split_at(row.len() / 2);
        for ((out, a), b) in out.iter_mut().zip(upper.chunks_exact(2)).zip(lower.chunks_exact(2)) {
            // Deviations from a pixel: no digits are lost in an even picture.
            let [x, y, z] = [a[1] - a[0], b[0] - a[0], b[1] - a[0]];
            let mean = 0.25 * (x + y + z);
            *out = if is_light { x * x + y * y + z * z - 4.0 * mean * mean } else { a[0] + a[1] + b[0] + b[1] };
        }
    }

    /// Adds a row of clusters.
    fn add(&self, y: usize, variances: &[f32], columns: &mut Columns) {
        let is_seen = (y / self.side).is_multiple_of(self.sparse);
        let from = if is_seen { y % self.side * variances.len() } else { 0 };
        let sums = if is_seen { &mut columns.seen[from..] } else { &mut columns.others[..] };
        for (sum, variance) in sums.iter_mut().zip(variances) {
            *sum += f64::from(if variance.is_finite() { *variance } else { 0.0 });
        }
    }

    /// The place in a cell of the grid to take, in clusters.
    fn chosen(&self, columns: &Columns) -> [usize; 2] {
        let across = self.count[0] * self.side;
        let mut seen = vec![0.0; self.side * self.side];
        for (i, sum) in
            columns.seen.iter().enumerate().filter(|(i, _)| (i % across / self.side).is_multiple_of(self.sparse))
        {
            seen[i / across * self.side + i % across % self.side] += sum;
        }
        let cells = |n: usize| n.div_ceil(self.sparse) as f64;
        let all = (self.count[0] * self.count[1] * self.side * self.side) as f64;
        let average = columns.sum() / all * self.count.map(cells).iter().product::<f64>();
        if seen[0] >= ENOUGH * average {
            return [0; 2];
        }
        let least = seen.iter().enumerate().filter(|(_, seen)| **seen >= average).min_by(|a, b| a.1.total_cmp(b.1));
        let most = || seen.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        least.or_else(most).map_or([0; 2], |(i, _)| [i % self.side, i / self.side])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place that is chosen for a picture of 3 × 2 cells of 4 × 4 clusters.
    fn chosen(sparse: usize, variance: impl Fn(usize, usize) -> f32) -> [usize; 2] {
        let cells = Cells { side: 4, cluster: 1, count: [3, 2], sparse };
        let mut columns = Columns { seen: vec![0.0; 4 * 12], others: vec![0.0; 12] };
        for row in 0..8 {
            let variances: Vec<f32> = (0..12).map(|x| variance(x, row)).collect();
            cells.add(row, &variances, &mut columns);
        }
        cells.chosen(&columns)
    }

    #[test]
    fn a_grid_is_moved_only_if_it_passes_over_what_varies() {
        assert_eq!(chosen(1, |_, _| 0.0), [0, 0]);
        assert_eq!(chosen(1, |_, _| 1.0), [0, 0]);
        // The grid sees 0.8 of what the others see.
        assert_eq!(chosen(1, |x, y| if x % 4 == 0 && y % 4 == 0 { 0.8 } else { 1.0 }), [0, 0]);
        // All is in one cluster.
        assert_eq!(chosen(1, |x, y| if (x, y) == (6, 5) { 1.0 } else { 0.0 }), [2, 1]);
        // Of two that see more than the average, the one that sees less.
        assert_eq!(chosen(1, |x, y| [0.0, 3.0, 2.0, 0.0][x % 4] * f32::from(u8::from(y % 4 == 3))), [2, 3]);
        // A value that is not finite is left out.
        assert_eq!(chosen(1, |x, y| if (x, y) == (6, 5) { f32::NAN } else { 0.5 }), [0, 0]);
    }

    #[test]
    fn a_sparse_grid_counts_what_it_sees_itself() {
        // The second cell is none of a sparse grid's: what is there is not seen, whatever the place.
        assert_eq!(chosen(2, |x, y| if (x, y) == (6, 1) { 1.0 } else { 0.0 }), [3, 3]);
        assert_eq!(chosen(2, |x, y| if (x, y) == (9, 1) { 1.0 } else { 0.0 }), [1, 1]);
    }
}
