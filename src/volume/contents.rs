//! What a volume's values are, as far as they tell it themselves. Defaults depend on it: windows, transfer functions, isovalues.
//!
//! A request may always say what it wants. A reply says what a volume was taken for.

use super::{Values, Volume};
use crate::error::Result;

/// The most voxels that are looked at, evenly in memory.
const MOST_LOOKED_AT: usize = 1 << 18;
/// The part of the voxels on either side that a window leaves out.
const TAIL: f64 = 1e-3;
/// A window ends at the end of the range if that is no further away than this part of its width.
const NEAR: f64 = 0.25;
/// The part of the voxels that may lie far beyond all others and are outliers then. Of a small volume it is one voxel.
const FEW: f64 = 1e-4;
/// The part of the voxels from which on one value far beyond all others stands for no data.
const MANY: f64 = 1e-3;
/// The number of values from which on percentiles say something.
const SEVERAL: usize = 16;
/// The most labels of a volume that is taken for labels without being told.
const MOST_LABELS: usize = 1024;
/// The part of neighbours inside of labels that have the same one, and the part of the others that differ by more than 1. Smooth amounts in whole
/// numbers have many equal neighbours too, but no jumps.
const ALIKE: f64 = 0.75;
const JUMPS: f64 = 0.25;
/// The part of voxels that are 0 in a signed map, and the part of its greatest value that it has on the other side of 0.
const BACKGROUND: f64 = 0.1;
const OTHER_SIDE: f64 = 0.1;

/// The kind of a volume's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DataKind {
    /// A density, such as a built-in's or a computed field's.
    Density,
    /// Hounsfield units of a CT: air far below 0, bone far above.
    Hounsfield,
    /// Whole numbers that are names and not amounts.
    Labels,
    /// Amounts below and above 0, as of a statistical map.
    SignedMap,
    /// Anything else, such as MR.
    Intensity,
}

/// What a volume's values are.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct Contents {
    /// What they are taken for.
    pub kind: DataKind,
    /// The values of the default window: most of them, without what stands for no data and without outliers.
    pub window: [f64; 2],
    /// The least and the greatest value without outliers and what stands for no data.
    pub data: [f64; 2],
    /// The value that stands for no data, if there is one: many voxels have it, and it is far beyond all others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub padding: Option<f64>,
    /// True if some voxels are outside of the window besides those without data.
    pub beyond: bool,
}

/// True if a range of values looks like Hounsfield units: air far below 0 and bone far above.
pub fn is_hounsfield(range: [f64; 2]) -> bool {
    range[0] <= -500.0 && range[1] >= 600.0
}

impl Contents {
    /// Those of a volume whose range tells all.
    pub(super) fn density([low, high]: [f64; 2], upper: Option<f64>) -> Self {
        // A field's brightest voxels are next to its source and would leave the rest dark. At least a millionth of the largest value, so that the
        // window is not empty.
        let window = upper.map_or([low, high], |upper| [0.0, upper.max((high * 1e-6).max(f64::MIN_POSITIVE))]);
        Self { kind: DataKind::Density, window, data: [low, high], padding: None, beyond: upper.is_some() }
    }

    /// What the values of a grid are; `range` is theirs, and rows are `row` voxels long.
    pub(super) fn of(values: Values<'_>, count: usize, row: usize, range: [f64; 2]) -> Self {
        let looked_at = count.min(MOST_LOOKED_AT);
        let places = (0..looked_at).map(|k| (k as u128 * count as u128 / looked_at as u128) as usize);
        let pairs = places.map(|i| [values.of(i), if (i + 1) % row == 0 { f64::NAN } else { values.of(i + 1) }]);
        let pairs: Vec<[f64; 2]> = pairs.filter(|[here, _]| here.is_finite()).collect();
        let mut sorted: Vec<f64> = pairs.iter().map(|[here, _]| *here).collect();
        // An outlier may be among those that are not looked at.
        sorted.extend(range);
        sorted.sort_by(f64::total_cmp);
        let found = Ends::of(&sorted);
        let kept = &sorted[found.kept.clone()];
        let (kind, window) = (kind(&pairs, kept, found.padding), window(kept));
        let data = [kept[0], kept[kept.len() - 1]];
        let window = if kind == DataKind::Labels { data } else { window };
        let is_in = |value: &f64| (window[0]..=window[1]).contains(value) || Some(*value) == found.padding;
        Self { kind, window, data, padding: found.padding, beyond: !sorted.iter().all(is_in) }
    }

    /// The same in words, for a reply.
    pub fn words(&self) -> String {
        let mut words = match self.kind {
            DataKind::Density => "the volume is taken for a density".to_owned(),
            DataKind::Hounsfield => "the volume is taken for Hounsfield units".to_owned(),
            DataKind::Labels => "the volume is taken for labels".to_owned(),
            DataKind::SignedMap => "the volume is taken for a map with values below and above 0".to_owned(),
            DataKind::Intensity => "the volume is taken for intensities".to_owned(),
        };
        if let Some(padding) = self.padding {
            words += &format!("; {:?} is taken for no data", padding as f32);
        }
        if self.beyond {
            let [low, high] = self.window.map(|value| value as f32);
            words += &format!("; a few values are beyond its window, {low:?} to {high:?}");
        }
        words
    }
}

/// The ends of sorted values that lie far beyond all others.
struct Ends {
    /// Those that remain.
    kept: std::ops::Range<usize>,
    padding: Option<f64>,
}

impl Ends {
    /// Takes away what is further from the rest than the rest is wide: a few values, or one that many voxels have.
    fn of(sorted: &[f64]) -> Self {
        let few = ((sorted.len() as f64 * FEW) as usize).max(1) + 1;
        let mut found = Self { kept: 0..sorted.len(), padding: None };
        while let Some((kept, value, count)) = found.without_an_end(sorted, few) {
            let many = count > few && count as f64 >= MANY * sorted.len() as f64;
            if !many && count > few || many && (found.padding.is_some() || value == 0.0) {
                break;
            }
            if many {
                found.padding = Some(value);
            }
            found.kept = kept;
        }
        found
    }

    /// What remains without the values beyond the widest gap at an end, the outermost of these, and their number.
    fn without_an_end(&self, sorted: &[f64], few: usize) -> Option<(std::ops::Range<usize>, f64, usize)> {
        let kept = &sorted[self.kept.clone()];
        let last = kept.len().checked_sub(1)?;
        let same = |value: f64| kept.partition_point(|v| *v <= value) - kept.partition_point(|v| *v < value);
        // The first of a number of values from the low end, or that of the values which are the same there; and alike from the high end.
        let (low, high) = (same(kept[0]), same(kept[last]));
        let mut cuts: Vec<(usize, usize)> =
            (1..few.min(last)).flat_map(|n| [(n, last + 1), (0, last + 1 - n)]).collect();
        cuts.extend([(low, last + 1), (0, last + 1 - high)]);
        let is_far = |&(from, to): &(usize, usize)| {
            let Some(rest) = kept.get(from..to).filter(|rest| distinct(rest) >= SEVERAL) else { return false };
            let width = rest[rest.len() - 1] - rest[0];
            let gap = if from > 0 { rest[0] - kept[from - 1] } else { kept[to] - rest[rest.len() - 1] };
            gap > width
        };
        let (from, to) = cuts.into_iter().filter(is_far).max_by_key(|(from, to)| to - from)?;
        let outermost = if from > 0 { kept[0] } else { kept[last] };
        let start = self.kept.start;
        Some((start + from..start + to, outermost, kept.len() - (to - from)))
    }
}

/// The number of distinct values of a sorted list, or one more than [`MOST_LABELS`] if it has more.
fn distinct(sorted: &[f64]) -> usize {
    let (mut count, mut at) = (0, 0);
    while at < sorted.len() && count <= MOST_LABELS {
        (at, count) = (at + sorted[at..].partition_point(|v| *v <= sorted[at]), count + 1);
    }
    count
}

/// The window of sorted values: percentiles of what is not background, or the range if that is near.
fn window(kept: &[f64]) -> [f64; 2] {
    let [low, high] = [kept[0], kept[kept.len() - 1]];
    // The background is the least value, if many voxels have it.
    let from = kept.partition_point(|v| *v <= low);
    let from = if from as f64 > BACKGROUND * kept.len() as f64 { from } else { 0 };
    let inside = &kept[from..];
    if distinct(inside) < SEVERAL {
        return [low, high];
    }
    let at = |part: f64| inside[((inside.len() - 1) as f64 * part).round() as usize];
    let ends = [if from > 0 { low } else { at(TAIL) }, at(1.0 - TAIL)];
    let near = NEAR * (ends[1] - ends[0]);
    [if ends[0] - low <= near { low } else { ends[0] }, if high - ends[1] <= near { high } else { ends[1] }]
}

fn kind(pairs: &[[f64; 2]], kept: &[f64], padding: Option<f64>) -> DataKind {
    let [low, high] = [kept[0], kept[kept.len() - 1]];
    let part = |of: &dyn Fn(&&[f64; 2]) -> bool, among: &dyn Fn(&&[f64; 2]) -> bool| {
        let among: Vec<&[f64; 2]> = pairs.iter().filter(among).collect();
        among.iter().filter(|pair| of(pair)).count() as f64 / among.len().max(1) as f64
    };
    let is_whole = kept.iter().all(|v| v.fract() == 0.0);
    let inside = |pair: &&[f64; 2]| pair[1].is_finite() && pair.iter().any(|v| *v != 0.0 && Some(*v) != padding);
    let kinds = distinct(kept);
    let differ = |pair: &&[f64; 2]| inside(pair) && pair[0] != pair[1];
    let jumps = || kinds <= SEVERAL || part(&|pair| (pair[0] - pair[1]).abs() > 1.0, &differ) >= JUMPS;
    let alike = || part(&|pair| pair[0] == pair[1], &inside) >= ALIKE;
    if is_whole && low >= 0.0 && (2..=MOST_LABELS).contains(&kinds) && alike() && jumps() {
        return DataKind::Labels;
    }
    if is_hounsfield([low, high]) {
        return DataKind::Hounsfield;
    }
    let both = low < 0.0 && high > 0.0 && (-low).min(high) >= OTHER_SIDE * (-low).max(high);
    if both && (!is_whole || part(&|pair| pair[0] == 0.0, &|_| true) >= BACKGROUND) {
        return DataKind::SignedMap;
    }
    DataKind::Intensity
}

impl Volume {
    /// What its values are. It is found when it is first asked for.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn contents(&self) -> Result<&Contents> {
        if let Some(found) = self.contents.get() {
            return Ok(found);
        }
        if matches!(self.format(), "builtin" | "field") {
            return Ok(self.contents.get_or_init(|| Contents::density(self.range(), self.upper())));
        }
        let found = Contents::of(self.values()?, self.voxel_count(), self.dims()[0], self.range());
        Ok(self.contents.get_or_init(|| found))
    }
}
