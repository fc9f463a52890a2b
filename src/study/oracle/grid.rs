//! A grid of values around the origin, followed cell by cell: the exact optical depth of piecewise constant media.

use glam::{DVec3, UVec3, dvec3};

use super::inside;
use crate::error::Result;
use crate::volume::Volume;

/// Values in equal cells of a box around the origin, x the fastest.
#[derive(Debug, Clone)]
pub struct Grid {
    dims: [usize; 3],
    /// Half of the box's sides.
    pub half: DVec3,
    values: Vec<f64>,
}

impl Grid {
    /// A grid with `value` at the cells' centres.
    pub fn of(dims: [usize; 3], half: DVec3, value: impl Fn(DVec3) -> f64) -> Self {
        let count = DVec3::from(dims.map(|n| n as f64));
        let cells = (0..dims.iter().product()).map(|i: usize| {
            let cell = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
            value((DVec3::from(cell.map(|c| c as f64 + 0.5)) / count * 2.0 - 1.0) * half)
        });
        Self { dims, half, values: cells.collect() }
    }

    /// A grid of a volume's voxels, if the volume's axes are the world's.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn of_volume(volume: &Volume) -> Result<Self> {
        let (dims, values) = (volume.dims(), volume.values()?);
        let to_index = volume.index_from_world();
        let at = |p: DVec3| {
            let index = to_index.transform_point3(p).floor().max(DVec3::ZERO).as_uvec3();
            let last = UVec3::from(dims.map(|n| n as u32 - 1));
            let [x, y, z] = index.min(last).to_array().map(|i| i as usize);
            values.at(x, y, z)
        };
        Ok(Self::of(dims, volume.world_half_size(), at))
    }

    /// The grid with all values times `by`.
    pub fn scaled(mut self, by: f64) -> Self {
        self.values.iter_mut().for_each(|v| *v *= by);
        self
    }

    /// The value at a place: linear between the cells' centres, constant beyond the outermost.
    pub fn trilinear(&self, p: DVec3) -> f64 {
        let count = DVec3::from(self.dims.map(|n| n as f64));
        let at = ((p / self.half + 1.0) * 0.5 * count - 0.5).clamp(DVec3::ZERO, count - 1.0);
        let low = at.floor().min((count - 2.0).max(DVec3::ZERO));
        let part = at - low;
        let [x, y, z] = low.to_array().map(|n| n as usize);
        let [right, below, behind] = [x + 1, y + 1, z + 1];
        let last = self.dims.map(|n| n - 1);
        let mix = |a: f64, b: f64, part: f64| a + part * (b - a);
        let along_x = |y: usize, z: usize| mix(self.value([x, y, z]), self.value([right.min(last[0]), y, z]), part.x);
        let along_y = |z: usize| mix(along_x(y, z), along_x(below.min(last[1]), z), part.y);
        mix(along_y(z), along_y(behind.min(last[2])), part.z)
    }

    fn value(&self, [x, y, z]: [usize; 3]) -> f64 {
        self.values[x + self.dims[0] * (y + self.dims[1] * z)]
    }

    /// The distance from `p` along the unit vector `d` at which the integral of the values reaches `depth`; `None` if it leaves the box
    /// before.
    pub fn free_path(&self, p: DVec3, d: DVec3, depth: f64) -> Option<f64> {
        self.along(p, d, depth).ok()
    }

    /// The integral of the values from `p` along the unit vector `d` to the end of the box.
    pub fn depth(&self, p: DVec3, d: DVec3) -> f64 {
        self.along(p, d, f64::INFINITY).unwrap_or_else(|whole| whole)
    }

    /// The distance at which the integral reaches `limit`, or as an error the whole integral.
    fn along(&self, p: DVec3, d: DVec3, limit: f64) -> Result<f64, f64> {
        let Some((near, far)) = inside(p, d, self.half) else { return Err(0.0) };
        let count = DVec3::from(self.dims.map(|n| n as f64));
        let scale = 0.5 * count / self.half;
        let start = (p + d * near + self.half) * scale;
        let mut cell: [i64; 3] = std::array::from_fn(|a| (start[a].floor() as i64).clamp(0, self.dims[a] as i64 - 1));
        let wall = |cell: &[i64; 3], a: usize| {
            let at = (cell[a] + i64::from(d[a] > 0.0)) as f64 / scale[a] - self.half[a];
            if d[a] == 0.0 { f64::INFINITY } else { (at - p[a]) / d[a] }
        };
        let (mut t, mut sum) = (near, 0.0);
        while t < far {
            let walls = dvec3(wall(&cell, 0), wall(&cell, 1), wall(&cell, 2));
            let axis = if walls.x <= walls.y && walls.x <= walls.z { 0 } else { 1 + usize::from(walls.z < walls.y) };
            let next = walls[axis].clamp(t, far);
            let value = self.value(cell.map(|c| c as usize));
            let more = value * (next - t);
            if sum + more >= limit {
                return Ok(t + (limit - sum) / value);
            }
            sum += more;
            t = next;
            cell[axis] += if d[axis] > 0.0 { 1 } else { -1 };
            if cell[axis] < 0 || cell[axis] >= self.dims[axis] as i64 {
                break;
            }
        }
        Err(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Random;
    use super::*;

    #[test]
    fn depth_and_free_path_are_those_of_small_steps() {
        let grid = Grid::of([5, 7, 3], dvec3(1.0, 0.6, 1.4), |p| 3.0 + p.x + (3.0 * p.y).sin() * p.z);
        let nearest = |p: DVec3| {
            let at = (p / grid.half + 1.0) * 0.5 * dvec3(5.0, 7.0, 3.0);
            grid.value([(at.x as usize).min(4), (at.y as usize).min(6), (at.z as usize).min(2)])
        };
        let mut random = Random::new(5);
        for _ in 0..50 {
            let p = dvec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
            let d = random.direction();
            let far = inside(p, d, grid.half).map_or(0.0, |r| r.1);
            let n = 20_000;
            let step = far / f64::from(n);
            let sum: f64 = (0..n).map(|i| nearest(p + d * (f64::from(i) + 0.5) * step) * step).sum();
            let depth = grid.depth(p, d);
            assert!((depth - sum).abs() < 1e-3, "{depth} for {sum}");
            let half_way = grid.free_path(p, d, 0.5 * depth).expect("within the box");
            let first: f64 = (0..n).map(|i| nearest(p + d * (f64::from(i) + 0.5) * half_way / f64::from(n))).sum();
            assert!((first * half_way / f64::from(n) - 0.5 * depth).abs() < 1e-3);
            assert_eq!(grid.free_path(p, d, 1.001 * depth), None);
        }
    }
}
