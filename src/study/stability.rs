//! Runs the experiments, and writes a page of their outcomes.

use serde::{Deserialize, Serialize};

use super::bench::Bench;
use super::experiments::{EXPERIMENTS, Experiment, NOT_HERE_YET};
use super::record::Machine;
use super::verdict::{Findings, Sample, Verdict};
use super::{Scale, machine};
use crate::error::Result;

/// The outcome of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Its name.
    pub name: String,
    /// Its title, a line of words.
    pub title: String,
    /// The result of a right implementation.
    pub expected: String,
    /// The worst verdict of all places.
    pub verdict: Verdict,
    /// The places that differ from the closed form, in words.
    pub surprises: Vec<String>,
    /// True if it is the short form.
    pub quick: bool,
    /// The machine of the measurement.
    pub machine: Machine,
    /// The findings of the measurement.
    pub findings: Findings,
}

/// The outcomes of all experiments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// The outcomes, one by one.
    pub experiments: Vec<Outcome>,
    /// Failures elsewhere whose technique is not here yet, and that technique.
    pub not_here_yet: Vec<[String; 2]>,
}

/// Runs one experiment.
///
/// # Errors
/// Those of its requests.
pub fn outcome(bench: &Bench, experiment: &Experiment, scale: Scale) -> Result<Outcome> {
    let mut findings = (experiment.run)(bench, scale)?;
    findings.keep_codes(experiment.codes);
    Ok(Outcome {
        name: experiment.name.into(),
        title: experiment.title.into(),
        expected: experiment.expected.into(),
        verdict: findings.verdict(),
        surprises: findings.surprises(),
        quick: scale == Scale::Quick,
        machine: machine(bench),
        findings,
    })
}

/// Runs the experiments of `asked`; `told` hears of each.
///
/// # Errors
/// Those of their requests.
pub fn stability(
    bench: &Bench,
    scale: Scale,
    asked: &dyn Fn(&Experiment) -> bool,
    told: &mut dyn FnMut(&str),
) -> Result<Stability> {
    let mut experiments = Vec::new();
    for experiment in EXPERIMENTS.iter().filter(|e| asked(e)) {
        let start = std::time::Instant::now();
        let outcome = outcome(bench, experiment, scale)?;
        let verdict = outcome.verdict.words();
        told(&format!("{}: {verdict}, {:.1} s", experiment.name, start.elapsed().as_secs_f64()));
        experiments.push(outcome);
    }
    let not_here_yet = NOT_HERE_YET.iter().map(|row| row.map(str::to_owned)).collect();
    Ok(Stability { experiments, not_here_yet })
}

impl Stability {
    /// The page in Markdown; charts lie beside it.
    pub fn page(&self) -> String {
        let mut text = format!(
            "# Where methods fail\n\nEach experiment takes a method out of its domain and looks at what it says of itself there. `{}` \
            fails the build. The codes are those of the `warnings` of an ordinary render. `./dev study --case stability` makes this \
            page.\n\n",
            Verdict::BiasedAndSilent.words()
        );
        text += "| experiment | expected | verdict |\n|---|---|---|\n";
        for outcome in &self.experiments {
            let [title, name] = [&outcome.title, &outcome.name];
            text += &format!("| [{}](#{name}) | {} | {} |\n", short(title), outcome.expected, outcome.verdict.words());
        }
        for [row, technique] in &self.not_here_yet {
            text += &format!("| {row} | – | not here yet: {technique} |\n");
        }
        self.experiments.iter().for_each(|outcome| text += &outcome.section());
        text
    }
}

/// A title up to its colon.
fn short(title: &str) -> &str {
    title.split(':').next().unwrap_or(title)
}

impl Outcome {
    fn section(&self) -> String {
        let (name, title) = (&self.name, short(&self.title));
        let mut text = format!("\n<a id=\"{name}\"></a>\n## {title}\n\n");
        if title.len() < self.title.len() {
            text += &format!("{}.\n\n", self.title);
        }
        text += &format!("![{title}](stability_{name}.svg)\n\n");
        text += "| method | verdict | largest error | warnings | time on the device |\n|---|---|---|---|---|\n";
        for sweep in &self.findings.sweeps {
            text += &row(&sweep.method, sweep.verdict(), &sweep.samples.iter().collect::<Vec<_>>());
        }
        if let Some(map) = &self.findings.heat_map {
            let samples: Vec<&Sample> = map.samples.iter().flatten().collect();
            let worst = samples.iter().map(|s| s.verdict()).max().unwrap_or(Verdict::Exact);
            text += &row(&format!("{} (map)", map.title), worst, &samples);
            text += &format!("\n![{}](stability_{name}_map.svg)\n", map.title);
        }
        let m = &self.machine;
        let quick = if self.quick { ", the quick form" } else { "" };
        text += &format!(
            "\nMeasured on {}, {} threads, {}; version {} ({}){quick}.\n",
            m.processor, m.threads, m.platform, m.version, m.commit
        );
        for surprise in &self.surprises {
            text += &format!("\nNot as predicted: {surprise}.\n");
        }
        text
    }
}

fn row(method: &str, verdict: Verdict, samples: &[&Sample]) -> String {
    let error = |s: &&Sample| Some((s.measured? - s.truth).abs() / if s.truth == 0.0 { 1.0 } else { s.truth.abs() });
    let told_apart = samples.iter().filter(|s| s.verdict() != Verdict::Unbiased);
    let largest = told_apart.filter_map(error).fold(0.0, f64::max);
    let mut codes: Vec<&str> = samples.iter().flat_map(|s| &s.warnings).map(String::as_str).collect();
    codes.sort_unstable();
    codes.dedup();
    let times = samples.iter().map(|s| s.device_ms);
    let (least, most) = (times.clone().fold(f64::INFINITY, f64::min), times.fold(0.0, f64::max));
    let codes: Vec<String> = codes.into_iter().map(|c| format!("`{c}`")).collect();
    let largest = match verdict {
        Verdict::Unbiased => "noise".into(),
        _ => format!("{:.2e}", largest),
    };
    format!("| {method} | {} | {largest} | {} | {least:.2} to {most:.2} ms |\n", verdict.words(), codes.join(", "))
}
