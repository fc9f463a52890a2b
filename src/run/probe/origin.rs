//! Where the grid of a probe begins in the picture. A grid that passes over what varies would say nothing of it.

use crate::device::variance::{self, VariancePass};
use crate::error::Result;
use crate::run::context::DeviceContext;
use crate::run::layer::Layer;

/// A grid that sees less than this part of the variance of an average one is moved.
const ENOUGH: f64 = 0.75;

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

impl Cells {
    /// The cluster of a cell at which the grid begins: the first one, unless that grid sees less than [`ENOUGH`] of the variance
    /// that an average one sees. Then it is the grid that sees the least above the average.
    pub fn origin(&self, context: &DeviceContext, main: &Layer) -> Result<Origin> {
        if self.side < 2 || self.cluster != 1 {
            return Ok(Origin { at: [0; 2], random: 0.0 });
        }
        // Of one sample the colours are looked at, else the squared deviations of the samples.
        let of_colours = main.samples < 2;
        let int = |n: usize| n as i32;
        let pass = VariancePass {
            width: int(main.width),
            height: int(main.height),
            side: int(self.side),
            cells: self.count.map(int),
            sparse: int(self.sparse),
            of_colours: i32::from(of_colours),
        };
        let sums = variance::of_clusters(&context.device, &main.buffer, &pass)?;
        let clusters = self.count.iter().product::<usize>() * self.side * self.side;
        let n = f64::from(main.samples);
        let per_sample = if of_colours { 1.0 } else { n * (n - 1.0) };
        let random = sum(&sums) / (4 * clusters) as f64 / per_sample;
        Ok(Origin { at: self.chosen(&sums).map(|n| n << self.cluster), random })
    }

    /// The place in a cell of the grid to take, in clusters.
    ///
    /// `sums` are those of [`variance::of_clusters`]: a sparse grid sees only the cells in their first half.
    fn chosen(&self, sums: &[f32]) -> [usize; 2] {
        let across = self.count[0] * self.side;
        let mut seen = vec![0.0; self.side * self.side];
        let of_seen = sums[..sums.len() / 2].iter().enumerate();
        for (i, sum) in of_seen.filter(|(i, _)| (i % across / self.side).is_multiple_of(self.sparse)) {
            seen[i / across * self.side + i % across % self.side] += f64::from(*sum);
        }
        let cells = |n: usize| n.div_ceil(self.sparse) as f64;
        let all = (self.count[0] * self.count[1] * self.side * self.side) as f64;
        let average = sum(sums) / all * self.count.map(cells).iter().product::<f64>();
        if seen[0] >= ENOUGH * average {
            return [0; 2];
        }
        let least = seen.iter().enumerate().filter(|(_, seen)| **seen >= average).min_by(|a, b| a.1.total_cmp(b.1));
        let most = || seen.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        least.or_else(most).map_or([0; 2], |(i, _)| [i % self.side, i / self.side])
    }
}

fn sum(of: &[f32]) -> f64 {
    of.iter().map(|v| f64::from(*v)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The place that is chosen for a picture of 3 × 2 cells of 4 × 4 clusters.
    fn chosen(sparse: usize, variance: impl Fn(usize, usize) -> f32) -> [usize; 2] {
        let mut sums = vec![0.0; 2 * 4 * 12];
        for (x, y) in (0..8).flat_map(|y| (0..12).map(move |x| (x, y))) {
            sums[(4 * usize::from(y / 4 % sparse != 0) + y % 4) * 12 + x] += variance(x, y);
        }
        Cells { side: 4, cluster: 1, count: [3, 2], sparse }.chosen(&sums)
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
    }

    #[test]
    fn a_sparse_grid_counts_what_it_sees_itself() {
        // The second cell is none of a sparse grid's: what is there is not seen, whatever the place.
        assert_eq!(chosen(2, |x, y| if (x, y) == (6, 1) { 1.0 } else { 0.0 }), [3, 3]);
        assert_eq!(chosen(2, |x, y| if (x, y) == (9, 1) { 1.0 } else { 0.0 }), [1, 1]);
    }
}
