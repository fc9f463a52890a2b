//! Which tiles of a picture the next pass samples, and how often: all of them once, or, where a render is adaptive, those with the more
//! error the more often.
//!
//! With n_i samples of a tile whose samples have the deviation σ_i and cost c_i each, Σ σ_i² / n_i is least for a given Σ n_i c_i where
//! n_i ∝ σ_i / √c_i (Neyman, JRSS 97, 1934). The cost is counted in steps of the kernel, not in time, which depends on the weather. The
//! deviations are looked at after 16, 24, 32, 48, 64, … samples on average, and every pass is one sample on average, so that what is sampled
//! depends on nothing but the samples. To choose by the samples themselves is biased: a tile that happens to look
//! calm is looked at less often. A part of the mean deviation is added to each, which keeps the bias small.

use crate::film::Tiles;
use crate::technique::{Random, TILE, TILES_HEADER};

/// The part of the mean deviation that every tile has at least.
const FLOOR: f64 = 0.25;
/// About how many samples a tile gets in a pass at most: its samples are taken one after the other, and a pass must not wait for long.
const MOST: f64 = 16.0;

/// The tiles of one layer.
pub(super) struct Tiling {
    wide: usize,
    /// Samples of each tile's pixels so far.
    counts: Vec<u32>,
    /// Samples that each tile gets in the round under way, and how many passes it has.
    round: Option<(Vec<u32>, u32)>,
    passes: u32,
    /// What a sample of each costs, in steps, once that is known.
    costs: Option<Vec<f64>>,
    /// Entries and samples of the pass under way.
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

    /// True if an adaptive render should look at the deviations now.
    pub fn is_due(&self, samples: u32) -> bool {
        let done = self.round.as_ref().is_none_or(|(_, passes)| self.passes == *passes);
        samples >= Random::LEAST_SAMPLES && done
    }

    /// True if what a sample costs is yet to be learnt.
    pub fn wants_costs(&self) -> bool {
        self.costs.is_none()
    }

    /// Learns what a sample costs from what all so far have.
    pub fn learn_costs(&mut self, costs: &[u32]) {
        let each = costs.iter().zip(&self.counts).map(|(c, n)| f64::from((*c).max(1)) / f64::from((*n).max(1)));
        self.costs = Some(each.collect());
    }

    /// Plans the samples up to the next look, from the deviation of each tile's samples.
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

    /// What the next pass samples, as `kernels/shared/tile.h` reads it: how many tiles, the number of their next sample, and whether a list
    /// follows instead, for each the tile, the number of its next sample, and how many it gets.
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

    /// How often the next pass samples a tile: a round's samples are spread evenly over its passes.
    fn times(&self, tile: usize) -> u32 {
        let Some((samples, passes)) = &self.round else { return 1 };
        let upto = |pass: u32| u64::from(samples[tile]) * u64::from(pass) / u64::from(*passes);
        (upto(self.passes + 1) - upto(self.passes)) as u32
    }

    /// A pass is over.
    pub fn passed(&mut self) {
        let times: Vec<u32> = (0..self.counts.len()).map(|tile| self.times(tile)).collect();
        for (count, times) in self.counts.iter_mut().zip(times) {
            *count += times;
        }
        self.passes += 1;
    }

    /// Samples by tile, where they differ.
    pub fn counts(&self) -> Option<Tiles> {
        self.round.as_ref().map(|_| Tiles { side: TILE, wide: self.wide, counts: self.counts.clone() })
    }

    /// Work-items of the pass under way on so many lanes, and about how many pixels' samples each has.
    pub fn items(&self, lanes: usize) -> (usize, usize) {
        let (entries, samples) = self.size;
        let items = entries * if lanes > 1 { 1 } else { TILE * TILE };
        (items, (samples * TILE * TILE / items.max(1)).max(1))
    }

    /// How many tiles there are.
    pub fn tiles(&self) -> usize {
        self.counts.len()
    }

    /// Bytes of what the device is told and tells: an entry of every tile, and behind them what each has cost.
    pub fn room(&self) -> usize {
        self.costs_at() + 4 * self.tiles()
    }

    /// Where the costs start, in bytes.
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
                // Costs of 1, 1, 1 and 4 a sample.
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
        // Deviations with a quarter of their mean added, over the roots of the costs: 0.8125, 1.8125, 2.8125, 5.40625 of 10.84375.
        for (count, part) in counts.iter().zip([0.0749, 0.1672, 0.2594, 0.4985]) {
            assert!((f64::from(*count) / 3072.0 - part).abs() < 0.002, "{counts:?}");
        }
    }
}
