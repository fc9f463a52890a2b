//! A study in Markdown.

use super::record::Record;
use crate::chart::plain;

fn percent(v: f64) -> String {
    format!("{:.3} %", 100.0 * v)
}

/// The settings of a study with their costs and errors, and the settings to choose for an error.
pub fn table(record: &Record) -> String {
    let mut text = format!("\n## {}\n\nTruth: {}.\n\n", record.title, record.truth);
    text += "| setting | device | error | bias | noise | front | slope |\n|---|---|---|---|---|---|---|\n";
    for line in &record.lines {
        for (i, point) in line.points.iter().enumerate() {
            let bias = match point.error.bias_within {
                Some(within) => format!("{} ± {}", percent(point.error.bias), percent(within)),
                None => percent(point.error.bias),
            };
            let slope = line.slope.filter(|_| i == 0).map(|s| {
                let expected = line.expected_slope.map_or(String::new(), |e| format!(" (expected {e})"));
                format!("{s:.2} in {}{expected}", line.of)
            });
            text += &format!(
                "| {}, {} {} | {:.3} ms | {} | {bias} | {} | {} | {} |\n",
                line.name,
                line.of,
                plain(point.at),
                point.device_ms,
                percent(point.error.rmse),
                point.error.noise.map_or("–".into(), percent),
                if point.front { "yes" } else { "" },
                slope.unwrap_or_default()
            );
        }
    }
    text += "\n| error at most | fastest setting | device |\n|---|---|---|\n";
    for choice in &record.equal_error {
        let setting = choice.setting.as_deref().unwrap_or("none tried");
        let time = choice.device_ms.map_or("–".into(), |t| format!("{t:.3} ms"));
        text += &format!("| {} | {setting} | {time} |\n", percent(choice.bound));
    }
    text
}
