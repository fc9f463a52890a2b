//! The page of the study of stated errors: coverage by technique and by option.

use std::collections::BTreeMap;

use super::{Honesty, Outcome};

/// A true error up to this factor above the stated one is nearly covered.
const NEARLY: f64 = 1.5;
/// A stated error this factor above the true one says little.
const MUCH: f64 = 4.0;
/// The least true error whose ratio counts: smaller ones are below what a byte shows.
const LEAST: f64 = 1e-4;

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
}

impl Figures {
    /// The figures of scenes.
    pub fn of<'a>(scenes: impl Iterator<Item = &'a Outcome> + Clone) -> Self {
        let pairs: Vec<[f64; 2]> = scenes.clone().filter_map(Outcome::pair).collect();
        let count = |kept: &dyn Fn(&[f64; 2]) -> bool| pairs.iter().filter(|pair| kept(pair)).count();
        let mut ratios: Vec<f64> = pairs.iter().map(|[stated, is]| stated / is.max(LEAST)).collect();
        ratios.sort_by(f64::total_cmp);
        let within = |o: &&Outcome| o.is.zip(o.asked()).is_some_and(|(is, asked)| is <= asked);
        let asked = scenes.filter(|o| o.is.is_some() && o.asked().is_some());
        Self {
            known: pairs.len(),
            covered: count(&|[stated, is]| is <= stated || *is < LEAST),
            nearly: count(&|[stated, is]| *is <= NEARLY * stated || *is < LEAST),
            median: ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
            above: count(&|[stated, is]| *stated > MUCH * is.max(LEAST)),
            asked: [asked.clone().count(), asked.filter(within).count()],
        }
    }

    fn row(&self, name: &str) -> String {
        let part =
            |n: usize, of: usize| if of == 0 { "–".into() } else { format!("{:.1} %", 100.0 * n as f64 / of as f64) };
        let [asked, within] = self.asked;
        format!(
            "| {name} | {} | {} | {} | {:.2} | {} | {} of {asked} |\n",
            self.known,
            part(self.covered, self.known),
            part(self.nearly, self.known),
            self.median,
            part(self.above, self.known),
            within,
        )
    }
}

impl Honesty {
    /// The page in Markdown.
    pub fn page(&self) -> String {
        let unknown = self.scenes.iter().filter(|o| o.stated.is_none()).count();
        let undecided = self.scenes.iter().filter(|o| o.is.is_none()).count();
        let exact = self.scenes.iter().filter(|o| o.is == Some(0.0)).count();
        let mut text = format!(
            "# Does a stated error keep its word?\n\n{} random scenes of fixed seeds over every view and option, each rendered once and compared with a \
            truth by another path: a shorter step, another tracker, other random numbers, other places in the pixels. {unknown} of them say that their \
            error is not known yet; of {undecided} the truth is not known well enough; {exact} are exactly the truth and say nothing. Measured on {}, {} threads, {}; version {} ({}). `./dev study \
            --case honesty` makes this page.\n\nCovered: the true error is at most the stated one. Errors below {LEAST:e} count as that.\n\n",
            self.scenes.len(),
            self.machine.processor,
            self.machine.threads,
            self.machine.platform,
            self.machine.version,
            self.machine.commit
        );
        let head = "scenes | covered | true ≤ 1.5 stated | median stated / true | stated > 4 true | within the error asked for |\n\
            |---|---|---|---|---|---|---|\n";
        text += &format!("| technique | {head}");
        let mut by_technique: BTreeMap<&str, Vec<&Outcome>> = BTreeMap::new();
        for outcome in &self.scenes {
            by_technique.entry(&outcome.technique).or_default().push(outcome);
        }
        for (name, scenes) in &by_technique {
            text += &Figures::of(scenes.iter().copied()).row(name);
        }
        text += &Figures::of(self.scenes.iter()).row("all");
        text += &format!("\n| picture | {head}");
        let large = |o: &&Outcome| o.side() >= 128;
        text += &Figures::of(self.scenes.iter().filter(|o| large(o) && o.is_noise())).row("128² or more, mostly noise");
        text += &Figures::of(self.scenes.iter().filter(|o| !(large(o) && o.is_noise()))).row("the others");
        text += &format!("\n| option | {head}");
        for (name, scenes) in by_option(&self.scenes) {
            text += &Figures::of(scenes.iter().copied()).row(&format!("`{name}`"));
        }
        text
    }
}

/// The scenes by an option that they give: its name, with its value if that is a word or a truth value.
fn by_option(scenes: &[Outcome]) -> BTreeMap<String, Vec<&Outcome>> {
    let mut found: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for outcome in scenes {
        let own = outcome.truth["technique"].as_str().and_then(|name| Some((name, outcome.request[name].as_object()?)));
        for (technique, (name, value)) in own.into_iter().flat_map(|(t, own)| own.iter().map(move |field| (t, field))) {
            let value = match value {
                serde_json::Value::String(word) => format!(" {word}"),
                serde_json::Value::Bool(truth) => format!(" {truth}"),
                _ => String::new(),
            };
            found.entry(format!("{technique}: {name}{value}")).or_default().push(outcome);
        }
        let budget = outcome.request["budget"].as_object().and_then(|b| b.keys().next().cloned()).unwrap_or_default();
        let budget = if budget == "samples" {
            format!("budget: {} samples", outcome.samples)
        } else {
            format!("budget: {budget}")
        };
        found.entry(budget).or_default().push(outcome);
    }
    found
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn outcome(stated: Option<f64>, is: f64, asked: Option<f64>) -> Outcome {
        Outcome {
            scene: 0,
            technique: "slice".into(),
            request: json!({"slice": {"mode": "mean", "thickness": 1}, "budget": {"max_error": asked}, "image": {"width": 200, "height": 128}}),
            truth: json!({"technique": "slice"}),
            samples: 4,
            stopped_by: Some("error".into()),
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
        let found = Figures::of(scenes.iter());
        assert_eq!((found.known, found.covered, found.nearly, found.above, found.asked), (4, 2, 3, 1, [2, 1]));
        assert!((found.median - 0.1 / 0.09).abs() < 1e-12, "{found:?}");
        assert!(scenes[0].is_noise() && scenes[0].side() == 128);
        let names: Vec<String> = by_option(&scenes).into_keys().collect();
        assert_eq!(names, ["budget: max_error", "slice: mode mean", "slice: thickness"]);
    }
}
