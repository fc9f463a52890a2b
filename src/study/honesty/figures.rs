//! Figures of the study of stated errors.

use super::Outcome;
use crate::film::LEAST_STATED;

/// A true error up to this factor above the stated one is nearly covered.
pub(super) const NEARLY: f64 = 1.5;
/// A stated error this factor above the true one says little.
pub(super) const MUCH: f64 = 4.0;
/// The least true error whose ratio counts.
pub(super) const LEAST: f64 = LEAST_STATED;

/// Figures of some scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// The scenes whose stated and true error are both known.
    pub known: usize,
    /// Those whose true error is at most the stated one.
    pub covered: usize,
    /// Those whose true error is at most 1.5 times the stated one.
    pub nearly: usize,
    /// The median of stated over true.
    pub median: f64,
    /// Those whose stated error is above 4 times the true one.
    pub above: usize,
    /// The scenes that stopped because they had reached the error asked for, and those of them that are within it.
    pub asked: [usize; 2],
    /// The median of their samples over the fewest that are within it.
    pub late: f64,
}

impl Figures {
    /// The figures of scenes.
    pub fn of(scenes: &[&Outcome]) -> Self {
        let pairs: Vec<[f64; 2]> = scenes.iter().filter_map(|o| o.pair()).collect();
        let count = |kept: &dyn Fn(&[f64; 2]) -> bool| pairs.iter().filter(|pair| kept(pair)).count();
        let asked: Vec<(f64, f64)> = scenes.iter().filter_map(|o| o.is.zip(o.asked)).collect();
        Self {
            known: pairs.len(),
            covered: count(&|[stated, is]| is <= stated || *is < LEAST),
            nearly: count(&|[stated, is]| *is <= NEARLY * stated || *is < LEAST),
            median: median(pairs.iter().map(|[stated, is]| stated / is.max(LEAST))),
            above: count(&|[stated, is]| *stated > MUCH * is.max(LEAST)),
            asked: [asked.len(), asked.iter().filter(|(is, asked)| is <= asked).count()],
            late: median(scenes.iter().filter_map(|o| o.late)),
        }
    }

    pub(super) fn row(&self, name: &str) -> String {
        let part =
            |n: usize, of: usize| if of == 0 { "–".into() } else { format!("{:.1} %", 100.0 * n as f64 / of as f64) };
        let number = |v: f64| if v.is_nan() { "–".into() } else { format!("{v:.2}") };
        let [asked, within] = self.asked;
        format!(
            "| {name} | {} | {} | {} | {} | {} | {within} of {asked} | {} |\n",
            self.known,
            part(self.covered, self.known),
            part(self.nearly, self.known),
            number(self.median),
            part(self.above, self.known),
            number(self.late),
        )
    }
}

/// The median of values; NaN for none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = values.collect();
    if all.is_empty() { f64::NAN } else { crate::study::measure::median(&all) }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn outcome(stated: Option<f64>, is: f64, asked: Option<f64>) -> Outcome {
        Outcome {
            scene: 0,
            technique: "slice".into(),
            moment: "end".into(),
            options: Vec::new(),
            side: 128,
            samples: 4,
            asked,
            late: asked.map(|_| 2.0),
            stated,
            parts: json!({"noise": stated, "truncation": 0}),
            warnings: Vec::new(),
            is: Some(is),
            known_to: Some(0.0),
        }
    }

    #[test]
    fn figures_count_what_is_covered() {
        let scenes = [
            outcome(Some(0.1), 0.09, Some(0.1)),
            outcome(Some(0.1), 0.14, Some(0.1)),
            outcome(Some(0.1), 0.3, None),
            outcome(Some(0.5), 0.1, None),
            outcome(None, 0.1, None),
            outcome(Some(0.0), 0.0, None),
        ];
        let found = Figures::of(&scenes.iter().collect::<Vec<_>>());
        assert_eq!((found.known, found.covered, found.nearly, found.above, found.asked), (4, 2, 3, 1, [2, 1]));
        assert!((found.median - 0.5 * (0.1 / 0.14 + 0.1 / 0.09)).abs() < 1e-12, "{found:?}");
        assert!(scenes[0].is_noise() && found.late == 2.0);
    }
}
