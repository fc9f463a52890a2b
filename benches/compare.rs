//! `./dev compare OLD [NEW [NAME]]`: sends every request of `tests/requests/` to two builds of the server and reports the differences of their
//! replies. OLD and NEW are server binaries; without NEW, the second one is the binary of this folder. With NAME, only the entries are sent whose
//! name contains it.
//!
//! Statuses, headers, pictures, grids and JSON have to agree to the byte. An EXR has to agree in its values and words, since its blocks come in any
//! order. Times and ids are left out, and so are the texts for people: `detail`, `message`, `failure` and reasons, of which only the number is
//! compared. If a reply depends on measured times (`"compare": "shape"`), only the fields and their types are compared. If it consists of such
//! times (`"compare": "head"`), only the status and the headers are compared.
//!
//! An entry whose reply is changed on purpose says so: `"changed": "why, and in which way"`. Its differences are listed apart. A difference in any
//! other entry makes the program end with 1.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "compare/answer.rs"]
mod answer;
#[path = "compare/call.rs"]
mod call;
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "compare/differences.rs"]
mod differences;
#[path = "compare/formats.rs"]
mod formats;
#[path = "compare/mask.rs"]
mod mask;
#[path = "compare/side.rs"]
mod side;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use answer::Reply;
use common::pictures::{self, Asked};
use side::Side;

/// The binary of this folder, which cargo builds with this program.
const NEW: &str = env!("CARGO_BIN_EXE_cloudchamber");
/// The number of differences of an answer beyond which only some are told.
const MOST_TOLD: usize = 6;

/// The findings.
#[derive(Default)]
struct Found {
    /// The entries and milliseconds by file.
    files: BTreeMap<String, (usize, u128)>,
    /// The lines by kind of difference: not expected, and expected.
    differ: Vec<String>,
    changed: Vec<String>,
    /// The entries that are said to be changed and are not.
    same: Vec<String>,
}

/// The differences of two lists of replies, in a line each.
fn told(name: &str, [old, new]: [&[Reply]; 2]) -> Vec<String> {
    let mut lines = Vec::new();
    for (a, b) in old.iter().zip(new) {
        let all = differences::of(a, b);
        let more = all.len().saturating_sub(MOST_TOLD);
        lines.extend(all.iter().take(MOST_TOLD).map(|d| format!("{name}: {}: {d}", a.label)));
        lines.extend((more > 0).then(|| format!("{name}: {}: and {more} more", a.label)));
    }
    if old.len() != new.len() {
        lines.push(format!("{name}: {} replies, now {}", old.len(), new.len()));
    }
    lines
}

impl Found {
    fn add(&mut self, file: &str, asked: &Asked, lines: Vec<String>, took: u128) {
        let (entries, ms) = self.files.entry(file.to_owned()).or_default();
        (*entries, *ms) = (*entries + 1, *ms + took);
        let Some(why) = asked.about["changed"].as_str() else {
            lines.iter().for_each(|line| println!("{line}"));
            return self.differ.extend(lines);
        };
        if lines.is_empty() {
            self.same.push(asked.name.clone());
        }
        self.changed.extend(lines.into_iter().map(|line| format!("{line} ({why})")));
    }

    /// Prints the findings. True if nothing differs that should not.
    fn report(&self) -> bool {
        for (title, lines) in
            [("changed on purpose", &self.changed), ("said to be changed, and the same in both", &self.same)]
        {
            if !lines.is_empty() {
                println!("\n{title}:\n{}", lines.join("\n"));
            }
        }
        println!();
        for (file, (entries, ms)) in &self.files {
            println!("{file}: {entries} entries in {:.1} s", *ms as f64 / 1e3);
        }
        let entries: usize = self.files.values().map(|f| f.0).sum();
        println!("{entries} entries, {} differences, {} on purpose", self.differ.len(), self.changed.len());
        self.differ.is_empty()
    }
}

fn main() -> ExitCode {
    // Cargo passes `--bench` to a benchmark.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let Some(old) = arguments.first() else {
        eprintln!("usage: ./dev compare OLD [NEW [NAME]]");
        return ExitCode::from(2);
    };
    let program = |path: &str| PathBuf::from(path).canonicalize().unwrap_or_else(|e| panic!("{path}: {e}"));
    let programs = [program(old), program(arguments.get(1).map_or(NEW, String::as_str))];
    let part = arguments.get(2).map_or("", String::as_str);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let started = Instant::now();
    let mut sides = programs.map(|program| Side::start(&program));
    let mut found = Found::default();
    let uploads = sides.each_mut().map(|side| runtime.block_on(side.upload_volumes()));
    found.differ.extend(told("upload", [&uploads[0], &uploads[1]]));
    found.differ.iter().for_each(|line| println!("{line}"));
    for (file, asked) in pictures::everything().iter().filter(|(_, asked)| asked.name.contains(part)) {
        let asked_at = Instant::now();
        let [a, b] = &mut sides;
        let (old, new) = runtime.block_on(async { tokio::join!(a.ask(asked), b.ask(asked)) });
        found.add(file, asked, told(&asked.name, [&old, &new]), asked_at.elapsed().as_millis());
    }
    let agree = found.report();
    println!("in {:.0} s", started.elapsed().as_secs_f64());
    if agree { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
