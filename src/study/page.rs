//! The page of plain words, which recommends a setting for each kind of scene.

use super::record::Record;
use super::{CASES, table};

const INTRODUCTION: &str = "# Speed against accuracy

Every chart sets what a setting is wrong by against the time that it takes: lower is more accurate, further left is faster. The truth is
one that the technique had no part in: a closed form, a published table, or a reference in double precision that the charts name. A ring
marks the settings that no other beats in both. Random techniques fall with a slope of −½: four times the samples, half the error.
Stepping ones fall with the order of their method in the step, and where a line stops falling it is biased: no amount of work helps.

*Error* is the root of the mean squared difference over the mean of the truth. *Bias* stands with its 95 % interval; an interval
that holds 0 is no bias that could be told. Where methods leave their domain, and what they say then, is in [stability](stability.md).

`./dev study` makes all of this anew on your machine, `./dev study --case cloud --quick` a part of it in seconds. Times compare
settings of one machine; they are not promises for another.

## What to choose when

| you have | choose | error 10 % | error 1 % | error 0.1 % |
|---|---|---|---|---|
";

/// The page in Markdown; charts lie beside it.
pub fn page(records: &[Record]) -> String {
    let mut text = INTRODUCTION.to_owned();
    let case = |record: &Record| CASES.iter().find(|c| c.name == record.name);
    for record in records {
        let Some(case) = case(record) else { continue };
        let cell = |bound: f64| {
            let found = record.equal_error.iter().find(|c| (c.bound / bound - 1.0).abs() < 1e-6);
            match found.and_then(|c| Some((c.setting.as_deref()?, c.device_ms?))) {
                Some((setting, ms)) => format!("{setting}: {ms:.2} ms"),
                None => "none tried".into(),
            }
        };
        let [ten, one, tenth] = [0.1, 0.01, 0.001].map(cell);
        text += &format!("| [{}](#{}) | {} | {ten} | {one} | {tenth} |\n", case.when, case.name, case.choose);
    }
    for record in records {
        let name = &record.name;
        text += &format!("\n<a id=\"{name}\"></a>{}\n![{}]({name}.svg)\n", table(record), record.title);
        let machine = &record.machine;
        text += &format!(
            "\nMeasured on {}, {} threads, {}; version {} ({}){}.\n",
            machine.processor,
            machine.threads,
            machine.platform,
            machine.version,
            machine.commit,
            if record.quick { ", the quick form" } else { "" }
        );
    }
    text
}
