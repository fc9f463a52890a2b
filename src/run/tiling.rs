//! The tiles that the next pass samples, and the samples of each. Every tile is sampled once, or, if a render is adaptive, tiles with more error
//! are sampled more often.
//!
//! Let a tile have n_i samples of deviation σ_i and of cost c_i each. Then Σ σ_i² / n_i is least for a given Σ n_i c_i if n_i ∝ σ_i / √c_i (Neyman,
//! JRSS 97, 1934). The cost is counted in steps of the kernel, not in time, which depends on the load. The deviations are read after 16, 24, 32,
//! 48, 64, … samples on average, and every pass is one sample on average, so that the choice depends on nothing but the samples. A choice by the
//! samples themselves is biased: a tile that happens to look calm is sampled less often. A part of the mean deviation is added to each deviation,
//! which keeps the bias small.

use crate::film::Tiles;
use crate::technique::{Random, TILE, TILES_HEADER};

/// The part of the mean deviation that is added to every tile's.
const FLOOR: f64 = 0.25;
/// The approximate number of samples that a tile gets in a pass at most. Its samples are taken one after the other, and a pass must not take long.
const MOST: f64 = 16.0;

/// The tiles of one layer.
pub(super) struct Tiling {
    wide: usize,
    /// The samples of each tile's pixels so far.
    counts: Vec<u32>,
    /// The samples of each tile in the round under way, and the number of its passes.
    round: Option<(Vec<u32>, u32)>,
    passes: u32,
    /// The cost of a sample of each tile, in steps, once it is known.
    costs: Option<Vec<f64>>,
    /// The entries and the samples of the pass under way.
    size: (usize, usize),
}

impl Tiling {
    pub fn new(width: usize, height: usize) -> Self {
        let (wide, high) = (width.div_ceil(TILE), height.div_ceil(TILE));
        Self { wide, counts: vec![0; wide * high], round: None, passes: 0, costs: None, size: (0, 0) }
    }

    pub fn restart(&mut self) {
        self.counts.fill(0);
        (self.round, self.passes, self.costs) = (None, 0, None);
    }

    /// True if an adaptive render should read the deviations now.
    pub fn is_due(&self, samples: u32) -> bool {
        let done = self.round.as_ref().is_none_or(|(_, passes)| self.passes == *passes);
        samples >= Random::LEAST_SAMPLES && done
    }

    /// True if the cost of a sample is not known yet.
    pub fn wants_costs(&self) -> bool {
        self.costs.is_none()
    }

    /// Learns the cost of a sample from the cost of all samples so far.
    pub fn learn_costs(&mut self, costs: &[u32]) {
        let each = costs.iter().zip(&self.counts).map(|(c, n)| f64::from((*c).max(1)) / f64::from((*n).max(1)));
        self.costs = Some(each.collect());
    }

    /// Plans the samples up to the next reading of the deviations, from the deviation of each tile's samples.
    pub fn plan(&mut self, samples: u32, deviations: &[f64]) {
        let passes = if samples.is_power_of_two() { samples / 2 } else { samples / 3 }.max(1);
        let tiles = self.counts.len() as f64;
        let mean = deviations.iter().sum::<f64>() / tiles;
        let cost = |i: usize| self.costs.as_ref().map_or(1.0, |c| c[i]);
        let weight = |(i, d): (usize, &f64)| if mean > 0.0 { (d + FLOOR * mean) / cost(i).sqrt() } else { 1.0 };
        let weights: Vec<f64> = deviations.iter().enumerate().map(weight).collect();
        let scale = f64::from(samples + passes) * tiles / weights.iter().sum::<f64>();
        let most = MOST * f64::from(passes);
        let wanted: Vec<f64> =
            weights.iter().zip(&self.counts).map(|(w, n)| (w * scale - f64::from(*n)).clamp(0.0, most)).collect();
        let scale = f64::from(passes) * tiles / wanted.iter().sum::<f64>().max(1e-30);
        let mut sum = 0.0f64;
        let share = |w: &f64| {
            let before = sum.round();
            sum += w * scale;
            (sum.round() - before) as u32
        };
        self.round = Some((wanted.iter().map(share).collect(), passes));
        self.passes = 0;
    }

    /// The tiles of the next pass, as `kernels/shared/tile.h` reads them: the number of tiles, the number of their next sample, and 1 if a list
    /// follows instead. An entry of the list is a tile, the number of its next sample, and its samples in the pass.
    pub fn pass(&mut self, samples: u32) -> Vec<u32> {
        if self.round.is_none() {
            self.size = (self.tiles(), self.tiles());
            return vec![self.tiles() as u32, samples, 0];
        }
        let mut list = vec![0, 0, 1];
        self.size = (0, 0);
        for (tile, &count) in self.counts.iter().enumerate() {
            let times = self.times(tile);
            if times > 0 {
                list.extend([tile as u32, count, times]);
                self.size = (self.size.0 + 1, self.size.1 + times as usize);
            }
        }
        list[0] = self.size.0 as u32;
        list
    }

    /// The number of samples of a tile in the next pass. A round's samples are spread evenly over its passes.
    fn times(&self, tile: usize) -> u32 {
        let Some((samples, passes)) = &self.round else { return 1 };
        let upto = |pass: u32| u64::from(samples[tile]) * u64::from(pass) / u64::from(*passes);
        (upto(self.passes + 1) - upto(self.passes)) as u32
    }

    /// Notes that a pass is over.
    pub fn passed(&mut self) {
        let times: Vec<u32> = (0..self.counts.len()).map(|tile| self.times(tile)).collect();
        for (count, times) in self.counts.iter_mut().zip(times) {
            *count += times;
        }
        self.passes += 1;
    }

    /// The samples by tile, if the tiles differ.
    pub fn counts(&self) -> Option<Tiles> {
        self.round.as_ref().map(|_| Tiles { side: TILE, wide: self.wide, counts: self.counts.clone() })
    }

    /// The work-items of the pass under way on `lanes` lanes, and the approximate number of pixel samples of each.
    pub fn items(&self, lanes: usize) -> (usize, usize) {
        let (entries, samples) = self.size;
        let items = entries * if lanes > 1 { 1 } else { TILE * TILE };
        (items, (samples * TILE * TILE / items.max(1)).max(1))
    }

    /// The number of tiles.
    pub fn tiles(&self) -> usize {
        self.counts.len()
    }

    /// The bytes of the list with an entry for every tile, and of the cost of each tile behind it.
    pub fn room(&self) -> usize {
        self.costs_at() + 4 * self.tiles()
    }

    /// The offset of the costs, bytes.
    pub fn costs_at(&self) -> usize {
        4 * (TILES_HEADER + 3 * self.tiles())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_is_sampled_once_a_pass_until_deviations_are_known() {
        let mut tiling = Tiling::new(40, 16);
        assert_eq!((tiling.tiles(), tiling.pass(0)), (3, vec![3, 0, 0]));
        assert_eq!((tiling.items(16), tiling.items(1)), ((3, 256), (768, 1)));
        tiling.passed();
        assert_eq!(tiling.pass(1), vec![3, 1, 0]);
        assert!(!tiling.is_due(1) && tiling.counts().is_none());
    }

    #[test]
    fn samples_go_where_the_deviation_is_and_none_is_lost() {
        let mut tiling = Tiling::new(64, 16);
        (0..16).for_each(|_| tiling.passed());
        let mut samples = 16;
        while samples < 768 {
            if tiling.is_due(samples) {
                // The costs of a sample are 1, 1, 1 and 4.
                if tiling.wants_costs() {
                    tiling.learn_costs(&[16, 16, 16, 64]);
                }
                tiling.plan(samples, &[0.0, 1.0, 2.0, 10.0]);
            }
            let list = tiling.pass(samples);
            assert_eq!((list.len(), list[2]), (TILES_HEADER + 3 * list[0] as usize, 1));
            tiling.passed();
            samples += 1;
        }
        let counts = tiling.counts().unwrap_or_default().counts;
        assert_eq!(counts.iter().sum::<u32>(), 4 * 768, "{counts:?}");
        // The deviations with a quarter of their mean added, over the roots of the costs, are 0.8125, 1.8125, 2.8125, 5.40625 of 10.84375.
        for (count, part) in counts.iter().zip([0.0749, 0.1672, 0.2594, 0.4985]) {
            assert!((f64::from(*count) / 3072.0 - part).abs() < 0.002, "{counts:?}");
        }
    }
}
