//! The grid of cells: least and greatest value of every block of 4³ voxels, from which empty space is skipped and
//! majorants are taken.

use super::parallel;
use super::voxels::{Sample, Voxels, with_slice};
use std::ops::Range;

/// Voxels along an edge of a cell.
pub const CELL: usize = 4;

/// Least and greatest value in each cell.
///
/// Cell `c` covers the samples with `u` in `[4c, 4c + 4)`. Trilinear interpolation there reads the voxels
/// `4c − 1 ..= 4c + 4` (clamped to the grid), and `min_max` spans exactly those. The ends are rounded to `f32` but not
/// padded: a kernel's interpolation may leave them by a rounding error.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    dims: [usize; 3],
    min_max: Vec<[f32; 2]>,
}

/// Offsets of the 13 neighbours that come before a cell in memory order; the others are their negatives.
#[rustfmt::skip]
const BEFORE: [[isize; 3]; 13] = [
    [-1, -1, -1], [0, -1, -1], [1, -1, -1], [-1, 0, -1], [0, 0, -1], [1, 0, -1], [-1, 1, -1], [0, 1, -1], [1, 1, -1],
    [-1, -1, 0], [0, -1, 0], [1, -1, 0], [-1, 0, 0],
];

impl Cells {
    /// The cells of a grid, and the range of its raw values if any is a number.
    pub(super) fn new(voxels: &Voxels, voxel_dims: [usize; 3], slope: f64, inter: f64) -> (Self, Option<[f64; 2]>) {
        let dims = voxel_dims.map(|n| n.div_ceil(CELL));
        let raw = with_slice!(voxels, raw_min_max, voxel_dims, dims);
        let mut range: Option<[f64; 2]> = None;
        let mut min_max = Vec::with_capacity(raw.len());
        for [low, high] in raw {
            if low > high {
                min_max.push([f32::INFINITY, f32::NEG_INFINITY]);
                continue;
            }
            range = Some(range.map_or([low, high], |[min, max]| [min.min(low), max.max(high)]));
            let ends = [low * slope + inter, high * slope + inter];
            min_max.push([ends[0].min(ends[1]) as f32, ends[0].max(ends[1]) as f32]);
        }
        (Self { dims, min_max }, range)
    }

    /// Cells along x, y, z: the voxels divided by [`CELL`], rounded up.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Least and greatest scaled value per cell, x fastest; `[inf, -inf]` where every voxel is NaN.
    pub fn min_max(&self) -> &[[f32; 2]] {
        &self.min_max
    }

    /// For each cell the Chebyshev distance in cells to the nearest one for which `occupied(min, max)` holds: 0 in
    /// such a cell itself, 255 for 255 or more. A ray in a cell of distance `d` may cross `d - 1` further cells in any
    /// direction without meeting anything. Cells of NaN only are never occupied.
    ///
    /// Two passes over the 26 neighbours, which is exact for this metric (Rosenfeld & Pfaltz 1968).
    pub fn empty_distance(&self, occupied: &dyn Fn(f32, f32) -> bool) -> Vec<u8> {
        let start = |&[min, max]: &[f32; 2]| if min <= max && occupied(min, max) { 0 } else { u8::MAX };
        let mut distance: Vec<u8> = self.min_max.iter().map(start).collect();
        let [nx, ny, nz] = self.dims;
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    self.relax(&mut distance, [x, y, z], 1);
                }
            }
        }
        for z in (0..nz).rev() {
            for y in (0..ny).rev() {
                for x in (0..nx).rev() {
                    self.relax(&mut distance, [x, y, z], -1);
                }
            }
        }
        distance
    }

    /// Lowers one cell's distance to one more than the least of the 13 neighbours on the side of `sign`.
    fn relax(&self, distance: &mut [u8], at: [usize; 3], sign: isize) {
        let [nx, ny, nz] = self.dims;
        let here = at[0] + nx * (at[1] + ny * at[2]);
        let mut least = distance[here];
        for offset in BEFORE {
            let neighbour = [0, 1, 2].map(|axis| at[axis].wrapping_add_signed(sign * offset[axis]));
            // A step below 0 wraps to a huge index, so one comparison catches both sides.
            if neighbour[0] < nx && neighbour[1] < ny && neighbour[2] < nz {
                let there = neighbour[0] + nx * (neighbour[1] + ny * neighbour[2]);
                least = least.min(distance[there].saturating_add(1));
            }
        }
        distance[here] = least;
    }
}

/// The voxels that a sample in cell `c` can read, along an axis of `n` voxels.
fn footprint(c: usize, n: usize) -> Range<usize> {
    (c * CELL).saturating_sub(1)..(c * CELL + CELL + 1).min(n)
}

fn raw_min_max<T: Sample>(voxels: &[T], voxel_dims: [usize; 3], cell_dims: [usize; 3]) -> Vec<[f64; 2]> {
    let layers = parallel::over_ranges(cell_dims[2], voxels.len(), |range| {
        range.flat_map(|cz| layer_min_max(voxels, voxel_dims, cell_dims, cz)).collect::<Vec<_>>()
    });
    layers.into_iter().flatten().map(|[low, high]| [low.to_f64(), high.to_f64()]).collect()
}

/// One layer of cells. Rows of voxels are merged voxel by voxel first, which vectorises, and along x once in the end.
fn layer_min_max<T: Sample>(
    voxels: &[T],
    [nx, ny, nz]: [usize; 3],
    [cells_x, cells_y, _]: [usize; 3],
    cz: usize,
) -> Vec<[T; 2]> {
    let mut layer = Vec::with_capacity(cells_x * cells_y);
    let (mut low, mut high) = (vec![T::HIGHEST; nx], vec![T::LOWEST; nx]);
    for cy in 0..cells_y {
        low.fill(T::HIGHEST);
        high.fill(T::LOWEST);
        for z in footprint(cz, nz) {
            for y in footprint(cy, ny) {
                let row = &voxels[nx * (y + ny * z)..][..nx];
                low.iter_mut().zip(row).for_each(|(low, &value)| *low = if value < *low { value } else { *low });
                high.iter_mut().zip(row).for_each(|(high, &value)| *high = if value > *high { value } else { *high });
            }
        }
        for cx in 0..cells_x {
            let lowest = low[footprint(cx, nx)].iter().fold(T::HIGHEST, |a, &b| if b < a { b } else { a });
            let highest = high[footprint(cx, nx)].iter().fold(T::LOWEST, |a, &b| if b > a { b } else { a });
            layer.push([lowest, highest]);
        }
    }
    layer
}
