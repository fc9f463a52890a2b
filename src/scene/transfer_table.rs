//! The device's table of a transfer function. Its entries are even over the values unless the function needs more of them in some places: a peak of
//! a few values of 16 bits, or a step.

use super::transfer::{TABLE_SIZE, TransferFunction};
use super::transfer_layout::{LAST, Run, domain, is_step, runs};

/// The most knots between which entries are even: `KNOTS` of the kernel. Two control points at one value are a step, which has two ends.
pub const KNOTS: usize = 512;

/// A transfer function as the device has it, over the values of a volume.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferTable {
    function: TransferFunction,
    runs: Vec<Run>,
}

impl TransferTable {
    /// The table of a function for a volume whose samples are in `values`, for looking them up.
    pub fn new(function: TransferFunction, values: [f64; 2]) -> Self {
        let domain = domain(&function, values);
        Self::over(function, domain)
    }

    /// The table of a function for its integrals between values, which must be known beyond its own domain.
    pub fn of_integrals(function: TransferFunction, values: [f64; 2]) -> Self {
        let domain = if values[1] > values[0] { values } else { domain(&function, values) };
        Self::over(function, domain)
    }

    fn over(function: TransferFunction, domain: [f64; 2]) -> Self {
        let runs = runs(&function, domain);
        Self { function, runs }
    }

    /// The values of the first and the last entry, which stand for all values beyond.
    pub fn domain(&self) -> [f64; 2] {
        [self.runs.first().map_or(0.0, |run| run.from), self.runs.last().map_or(1.0, |run| run.to)]
    }

    /// The value of an entry, or between two entries.
    fn value(&self, entry: f64) -> f64 {
        let mut before = 0.0;
        for run in &self.runs {
            if entry <= before + run.entries() {
                return run.from + (entry - before) / run.density;
            }
            before += run.entries();
        }
        self.domain()[1]
    }

    /// The places of a value's position on an even table where the entries' density changes: the starts, the widths, and the entries per position,
    /// in columns of [`KNOTS`], all as floats. A table that is even has none.
    pub fn knots(&self) -> (usize, Vec<u32>) {
        let [low, high] = self.domain();
        let count = if self.runs.len() > 1 { self.runs.len() } else { 0 };
        let column = |of: &dyn Fn(&Run) -> f64| -> Vec<u32> {
            (0..KNOTS).map(|i| (self.runs.get(i).map_or(0.0, of) as f32).to_bits()).collect()
        };
        let per_value = LAST / (high - low);
        let mut words = column(&|run| (run.from - low) * per_value);
        words.extend(column(&|run| (run.to - run.from) * per_value));
        words.extend(column(&|run| run.density / per_value));
        (count, words)
    }

    /// The difference of values that has no effect: half an entry where entries are densest, but for steps.
    pub fn resolution(&self) -> f64 {
        let [low, high] = self.domain();
        let wide = self.runs.iter().filter(|run| !is_step(run, high - low));
        0.5 / wide.map(|run| run.density).fold(0.0, f64::max)
    }

    /// The greatest derivative of the opacity per unit of length by the value. A step counts as wide as an entry of an even table.
    pub fn steepest_slope(&self) -> f64 {
        let [low, high] = self.domain();
        let least = (high - low) / LAST;
        let at: Vec<[f64; 2]> =
            (0..TABLE_SIZE).map(|i| self.value(i as f64)).map(|v| [v, self.function.evaluate(v).1]).collect();
        at.windows(2)
            .map(|pair| (pair[1][1] - pair[0][1]).abs() / (pair[1][0] - pair[0][0]).max(least))
            .fold(0.0, f64::max)
    }

    /// The table for pre-integrated steps, all as floats. Each entry has the integrals from the first entry of extinction and of extinction times
    /// red, green and blue over positions on an even table, then the integrands.
    pub fn integrals(&self, opacity_scale: f64) -> Vec<u32> {
        let [low, high] = self.domain();
        let integrand = |i: usize| {
            let value = self.value(i as f64);
            let (c, sigma) = self.function.evaluate(value);
            ((value - low) * LAST / (high - low), [1.0, c[0], c[1], c[2]].map(|part| part * sigma * opacity_scale))
        };
        let (mut sum, mut before) = ([0.0; 4], integrand(0));
        let mut table = Vec::with_capacity(8 * TABLE_SIZE);
        for i in 0..TABLE_SIZE {
            let here = integrand(i);
            for (part, sum) in sum.iter_mut().enumerate() {
                *sum += 0.5 * (before.1[part] + here.1[part]) * (here.0 - before.0);
            }
            table.extend(sum.iter().chain(&here.1).map(|v| (*v as f32).to_bits()));
            before = here;
        }
        table
    }

    /// The intervals of values that have an opacity in the table, in rising order.
    pub fn opaque(&self) -> Vec<[f64; 2]> {
        let mut intervals: Vec<[f64; 2]> = Vec::new();
        for i in 0..TABLE_SIZE {
            if self.function.evaluate(self.value(i as f64)).1 <= 0.0 {
                continue;
            }
            // Opacity begins at the entry before and ends at the entry after, less a small margin. The first and the last entry stand for
            // all values beyond them.
            let from = if i == 0 { f64::NEG_INFINITY } else { self.value(i as f64 - 0.999) };
            let to = if i == TABLE_SIZE - 1 { f64::INFINITY } else { self.value(i as f64 + 0.999) };
            match intervals.last_mut() {
                Some(last) if last[1] >= from => last[1] = to,
                _ => intervals.push([from, to]),
            }
        }
        intervals
    }

    /// The entries: linear colour and the opacity of `step` world units.
    pub fn entries(&self, opacity_scale: f64, step: f64) -> Vec<([f64; 3], f64)> {
        let entry = |i: usize| {
            let (color, sigma) = self.function.evaluate(self.value(i as f64));
            (color, -(-sigma * opacity_scale * step).exp_m1())
        };
        (0..TABLE_SIZE).map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::transfer::ControlPoint;
    use super::*;

    fn function(points: &[(f64, f64)]) -> TransferFunction {
        let point = |&(value, opacity_per_unit)| ControlPoint { value, color: [1.0; 3], opacity_per_unit };
        TransferFunction::Points(points.iter().map(point).collect())
    }

    /// The entry of a value as the device finds it.
    fn entry(table: &TransferTable, value: f64) -> usize {
        let [low, high] = table.domain();
        let x = ((value - low) * LAST / (high - low)).clamp(0.0, LAST) as f32;
        let (count, words) = table.knots();
        let column = |c: usize, i: usize| f32::from_bits(words[c * KNOTS + i]);
        let warped = (0..count).map(|i| (x - column(0, i)).clamp(0.0, column(1, i)) * column(2, i)).sum();
        (if count == 0 { x } else { warped } + 0.5) as usize
    }

    #[test]
    fn what_is_wide_has_even_entries() {
        let wide = function(&[(0.0, 0.0), (30.0, 2.0), (90.0, 0.0), (100.0, 5.0)]);
        for values in [[0.0, 100.0], [-50.0, 20.0], [10.0, 1e6], [200.0, 300.0], [7.0, 7.0]] {
            let table = TransferTable::new(wide.clone(), values);
            assert_eq!(table.knots().0, 0, "{values:?}");
            let [low, high] = table.domain();
            assert!(high > low && (0.0..=100.0).contains(&low) && high <= 100.0, "{low} to {high}");
            let apart = (0..TABLE_SIZE).map(|i| (table.value(i as f64) - low - (high - low) * i as f64 / LAST).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-9 * (high - low));
        }
    }

    #[test]
    fn a_thin_peak_and_a_step_are_as_they_were_given() {
        let far =
            [(-1e9, 0.0), (30003.0, 0.0), (30004.0, 0.5), (30005.0, 0.0), (30050.0, 0.0), (30050.0, 0.7), (1e9, 0.7)];
        let comb: Vec<(f64, f64)> = (0..256).map(|i| (f64::from(i) * 256.0, f64::from(i % 2))).collect();
        for (points, values, within) in [(&far[..], [0.0, 65535.0], 0.5 / 32.0), (&comb, [0.0, 65535.0], 0.5 / 15.0)] {
            let function = function(points);
            let table = TransferTable::new(function.clone(), values);
            let (entries, opaque) = (table.entries(1.0, 1e-3), table.opaque());
            for value in (0..65536).map(f64::from) {
                let sigma = -(-entries[entry(&table, value)].1).ln_1p() * 1e3;
                let due = function.evaluate(value).1;
                assert!((sigma - due).abs() <= within, "{sigma} for {due} at {value}");
                let opaque = opaque.iter().any(|[from, to]| (*from..=*to).contains(&value));
                assert!(opaque || due == 0.0, "{due} at {value}");
            }
        }
    }

    #[test]
    fn the_integral_is_that_of_the_function_however_its_entries_lie() {
        let function = function(&[(3.0, 0.0), (3.0001, 8.0), (3.0002, 0.0), (7.0, 2.0)]);
        for (values, due) in
            [([0.0, 10.0], 8.0 * 1e-4 + 0.5 * (7.0 - 3.0002) * 2.0 + 3.0 * 2.0), ([7.0, 9.0], 2.0 * 2.0)]
        {
            let table = TransferTable::of_integrals(function.clone(), values);
            assert_eq!((table.knots().0 > 1, table.domain()), (values[0] < 7.0, values));
            let words = table.integrals(1.0);
            let whole = f64::from(f32::from_bits(words[8 * (TABLE_SIZE - 1)])) * (values[1] - values[0]) / LAST;
            assert!((whole / due - 1.0).abs() < 1e-6, "{whole} for {due}");
        }
    }
}
