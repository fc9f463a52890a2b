//! The page of the study of stated errors: coverage by technique, by picture and by option.

use std::collections::BTreeMap;

use super::figures::{Figures, LEAST, MUCH, NEARLY};
use super::{Honesty, Outcome, Part};
use crate::study::record::Machine;

impl Honesty {
    /// The page in Markdown.
    pub fn page(&self) -> String {
        let count = |which: fn(&Outcome) -> bool| self.scenes().into_iter().filter(|o| which(o)).count();
        let unknown = count(|o| o.stated.is_none());
        let undecided = count(|o| o.stated.is_some() && o.is.is_none());
        let exact = count(|o| o.stated.is_some() && o.is == Some(0.0));
        let mut text = format!(
            "# Does a stated error keep its word?\n\n![stated against true](honesty.svg)\n\n{} random scenes of fixed seeds over every view and option, on \
            built-ins, uploads and fields, each rendered once and compared with a truth by another path: a shorter step, another tracker, other random \
            numbers, other places in the pixels. {unknown} of them say that their error is not known yet; of {undecided} others the truth is not known well \
            enough; {exact} are exactly the truth and say nothing. Measured on {}. `./dev study --case honesty` makes this page.\n\nCovered: the true error \
            is at most the stated one. Errors below {LEAST:e} count as that. Late: the samples of a render that stopped because it had reached the error \
            asked for, over the fewest that are within it, in steps of a factor of 1.4.\n\n",
            self.scenes().len(),
            self.machines(),
        );
        let head = format!(
            "known | covered | true ≤ {NEARLY} stated | median stated / true | stated > {MUCH} true | within the error asked for | late, median |\n\
            |---|---|---|---|---|---|---|---|\n"
        );
        let tables = [
            ("technique", self.by(|o| vec![o.technique.clone()])),
            ("picture", self.by(Outcome::kinds)),
            ("option", self.by(|o| o.options.clone())),
        ];
        for (name, rows) in tables {
            text += &format!("| {name} | {head}");
            rows.iter().for_each(|(name, scenes)| text += &Figures::of(scenes).row(name));
            if name == "technique" {
                text += &self.figures().row("all");
            }
            text += "\n";
        }
        text.trim_end().to_owned() + "\n"
    }

    /// The machines in words.
    pub fn machines(&self) -> String {
        let words = |Part { machine, scenes }: &Part| {
            let Machine { processor, threads, device, platform, version, commit, .. } = machine;
            format!(
                "{processor}, {threads} threads, {device} ({platform}), version {version} ({commit}): {} scenes",
                scenes.len()
            )
        };
        self.parts.iter().map(words).collect::<Vec<_>>().join("; and ")
    }

    /// The scenes by each of the names that they go by.
    fn by(&self, names: impl Fn(&Outcome) -> Vec<String>) -> BTreeMap<String, Vec<&Outcome>> {
        let mut found: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
        for outcome in self.scenes() {
            names(outcome).into_iter().for_each(|name| found.entry(name).or_default().push(outcome));
        }
        found
    }
}

impl Outcome {
    /// The kinds of its picture.
    fn kinds(&self) -> Vec<String> {
        let size = match self.side {
            128.. => "128² or more",
            32.. => "32² or more",
            _ => "less than 32²",
        };
        let largest = if self.is_noise() { "mostly noise" } else { "mostly bias" };
        let moment = match self.moment.as_str() {
            "first" => "first picture",
            "moved" => "first picture after a motion",
            _ => "final picture",
        };
        let is_coarse = self.warnings.iter().any(|code| code == "coarse_step");
        let warned = if is_coarse { "warned of a coarse step" } else { "not warned of a coarse step" };
        vec![moment.into(), format!("{size}, {largest}"), warned.into()]
    }
}
