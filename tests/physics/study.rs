//! The study on the real device, in its quick form: cases reach their truth as theory says, and no method is wrong in silence.

mod honesty;
mod planner;
mod stated;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use cloudchamber::study::bench::Bench;
use cloudchamber::study::experiments::EXPERIMENTS;
use cloudchamber::study::record::{Line, Record};
use cloudchamber::study::stability::stability;
use cloudchamber::study::verdict::Verdict;
use cloudchamber::study::{CASES, Scale, study};

use crate::common::engine::House;

/// Calls `work` with a shared engine, one at a time on each.
fn on_a_bench(work: impl FnOnce(&Bench)) {
    static TAKEN: [Mutex<()>; House::SHARED] = [const { Mutex::new(()) }; House::SHARED];
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let turn = NEXT.fetch_add(1, Ordering::Relaxed) % House::SHARED;
    let free = (0..House::SHARED).find_map(|index| Some((index, TAKEN[index].try_lock().ok()?)));
    let wait = || (turn, TAKEN[turn].lock().unwrap_or_else(PoisonError::into_inner));
    let (index, _one_at_a_time) = free.unwrap_or_else(wait);
    work(&House::shared_at(index).bench());
}

#[test]
fn every_method_that_leaves_its_domain_says_so() {
    on_a_bench(|bench| {
        let found = stability(bench, Scale::Quick, &|_| true, &mut |line| eprintln!("{line}")).unwrap();
        assert_eq!(found.experiments.len(), EXPERIMENTS.len());
        for outcome in &found.experiments {
            let silent = outcome.findings.samples().filter(|(_, s)| !s.verdict().is_told());
            let silent: Vec<_> = silent.map(|(method, s)| format!("{method}: {s:?}")).collect();
            assert!(silent.is_empty(), "{} is wrong and silent:\n{}", outcome.name, silent.join("\n"));
            assert!(outcome.surprises.is_empty(), "{}: {:?}", outcome.name, outcome.surprises);
        }
        // An experiment that no longer reaches the failure of its method shows nothing.
        for name in ["march_step", "majorant", "opacity_step", "single_scattering"] {
            let outcome = found.experiments.iter().find(|o| o.name == name).unwrap();
            assert_eq!(outcome.verdict, Verdict::BiasedAndFlagged, "{name}");
        }
    });
}

fn case(bench: &Bench, name: &str) -> Record {
    let case = CASES.iter().find(|c| c.name == name).unwrap();
    let record = study(bench, case, Scale::Quick, &mut |_| ()).unwrap().unwrap_or_else(|why| panic!("{name}: {why}"));
    assert!(record.lines.iter().flat_map(|l| &l.points).any(|p| p.front), "{name}: something is on the front");
    record
}

fn slope(record: &Record, line: &Line, within: f64) {
    let (found, expected) = (line.slope, line.expected_slope);
    let (Some(found), Some(expected)) = (found, expected) else {
        panic!("{}, {}: slope {found:?}, expected {expected:?}", record.name, line.name)
    };
    assert!((found - expected).abs() <= within, "{}, {}: slope {found}, expected {expected}", record.name, line.name);
}

#[test]
fn errors_follow_the_order_of_their_method() {
    on_a_bench(|bench| {
        for name in ["isosurface_sphere", "composite"] {
            let record = case(bench, name);
            record.lines.iter().filter(|l| l.expected_slope.is_some()).for_each(|line| slope(&record, line, 0.35));
        }
        let slab = case(bench, "slab");
        slab.lines.iter().for_each(|line| slope(&slab, line, 0.3));
        let exact = case(bench, "beer_lambert");
        let steps = exact.lines.iter().find(|l| l.name == "emission_absorption").unwrap();
        assert!(steps.points.iter().all(|p| p.error.rmse < 2e-4), "no step is wrong in one medium: {steps:?}");
    });
}

#[test]
fn a_bias_is_told_from_noise() {
    on_a_bench(|bench| {
        let record = case(bench, "scattering_medium");
        let last = |line: &str| {
            let line = record.lines.iter().find(|l| l.name == line).unwrap();
            let point = line.points.last().unwrap();
            (point.error.bias, point.error.bias_within.unwrap())
        };
        let (bias, within) = last("volume_path");
        assert!(bias.abs() <= 2.0 * within, "the whole path is unbiased: {bias} ± {within}");
        let (bias, within) = last("single_scatter");
        assert!(bias < -0.5 && within < 0.02, "light scattered once is half of it: {bias} ± {within}");
        let cheap = &record.equal_error[0];
        assert!(cheap.rmse.is_some_and(|e| e <= 0.1), "{cheap:?}");
    });
}
