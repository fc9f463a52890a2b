//! The places of a table's entries over the values of a transfer function.

use super::transfer::{ControlPoint, TABLE_SIZE, TransferFunction};

/// The entries of a piece in which a function rises from nothing to its most. A value is rounded to the nearest entry.
const FINE: f64 = 32.0;
/// The width of a step as a part of the domain: four units in the last place of the greatest float position.
const STEP: f64 = 2.4e-7;
/// The last entry.
pub(super) const LAST: f64 = (TABLE_SIZE - 1) as f64;

/// Values between which entries are even.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Run {
    /// The least value.
    pub from: f64,
    /// The greatest value.
    pub to: f64,
    /// Entries per value that the function needs; what they are once the table is laid out.
    pub density: f64,
}

impl Run {
    /// The number of its entries.
    pub fn entries(&self) -> f64 {
        (self.to - self.from) * self.density
    }

    fn and(&self, next: &Self) -> Self {
        Self { from: self.from, to: next.to, density: self.density.max(next.density) }
    }
}

/// True if a run of a domain of this width is a step.
pub(super) fn is_step(run: &Run, width: f64) -> bool {
    run.to - run.from <= 1.5 * STEP * width
}

/// The runs of a function over a domain, from one end to the other, each of which ends at an entry.
pub(super) fn runs(function: &TransferFunction, domain: [f64; 2]) -> Vec<Run> {
    let mut runs = pieces(function, domain);
    let [needed, most]: [f64; 2] = [runs.iter().map(Run::entries).sum(), room(runs.len())];
    // What does not fit is less fine.
    runs.iter_mut().for_each(|run| run.density *= (most / needed.max(most)).min(1.0));
    while let Some((at, one)) = cheapest(&runs) {
        runs.splice(at..at + 2, [one]);
    }
    // Each run ends at an entry. What is left goes to all values alike.
    let width = |run: &Run| run.to - run.from;
    let least = |run: &Run| (run.entries() - 1e-6).ceil().max(1.0);
    let (all, mut left) = (runs.iter().map(width).sum::<f64>(), LAST - runs.iter().map(least).sum::<f64>());
    let more = left;
    for run in &mut runs {
        let own = (more * width(run) / all).floor();
        left -= own;
        run.density = (least(run) + own) / width(run);
    }
    if let Some(widest) = runs.iter_mut().max_by(|a, b| width(a).total_cmp(&width(b))) {
        widest.density += left / width(widest);
    }
    runs
}

/// The values over which a function is laid out: those that it changes in and that the volume has.
pub(super) fn domain(function: &TransferFunction, values: [f64; 2]) -> [f64; 2] {
    let mut own = function.domain();
    let TransferFunction::Points(points) = function else {
        return if matches!(function, TransferFunction::Labels(_)) { own } else { common(own, values) };
    };
    // A step at an end has something beyond, which is shown by a few entries.
    let width = if own[1] > own[0] { own[1] - own[0] } else { (values[1] - values[0]).min(far(own[0])) };
    let steps = |pair: Option<&[ControlPoint]>| pair.is_some_and(|pair| pair[0].value == pair[1].value);
    if steps(points.windows(2).next()) {
        own[0] -= 1e-3 * width;
    }
    if steps(points.windows(2).last()) {
        own[1] += 1e-3 * width;
    }
    common(own, values)
}

/// The values that a function's domain and a volume have in common; the function's domain if that is nothing.
fn common(own: [f64; 2], values: [f64; 2]) -> [f64; 2] {
    let both = [own[0].max(values[0]), own[1].min(values[1])];
    let [low, high] = if both[1] > both[0] { both } else { own };
    if high > low { [low, high] } else { [low, low + if low == 0.0 { 1.0 } else { low.abs() }] }
}

/// A distance from a value that floats tell well.
fn far(value: f64) -> f64 {
    if value == 0.0 { f64::INFINITY } else { value.abs() }
}

/// The pieces of a function between its control points in a domain, each with the entries that it needs.
fn pieces(function: &TransferFunction, [low, high]: [f64; 2]) -> Vec<Run> {
    let thin = STEP * (high - low);
    let TransferFunction::Points(points) = function else {
        return vec![Run { from: low, to: high, density: LAST / (high - low) }];
    };
    let mut places = vec![low];
    for (i, point) in points.iter().enumerate().filter(|(_, point)| point.value > low && point.value < high) {
        let steps = points.get(i + 1).is_some_and(|next| next.value == point.value);
        let place = if steps { point.value - thin } else { point.value };
        // Points that are closer than floats tell are one.
        if place >= places[places.len() - 1] + 0.5 * thin {
            places.push(place);
        }
    }
    places.push(high);
    let piece = |ends: &[f64]| {
        let [a, b] = [function.evaluate(ends[0]), function.evaluate(ends[1])];
        let colour = (0..3).map(|c| (a.0[c] - b.0[c]).abs()).fold(0.0, f64::max);
        let most = a.1.max(b.1);
        let change = if most > 0.0 { colour.max((a.1 - b.1).abs() / most) } else { 0.0 };
        let width = ends[1] - ends[0];
        Run { from: ends[0], to: ends[1], density: (FINE * change).min((width / thin).round()) / width }
    };
    places.windows(2).map(piece).collect()
}

/// The entries that fit in a number of runs, each of which ends at an entry.
fn room(runs: usize) -> f64 {
    if runs > 1 { LAST - runs as f64 } else { LAST }
}

/// The two neighbours that cost the fewest entries if they become one, as long as all still fit.
fn cheapest(runs: &[Run]) -> Option<(usize, Run)> {
    let all: f64 = runs.iter().map(Run::entries).sum();
    let one = |(at, pair): (usize, &[Run])| {
        let one = pair[0].and(&pair[1]);
        (at, one, one.entries() - pair[0].entries() - pair[1].entries())
    };
    let (at, one, cost) = runs.windows(2).enumerate().map(one).min_by(|a, b| a.2.total_cmp(&b.2))?;
    (all + cost <= room(runs.len() - 1)).then_some((at, one))
}
