//! Runs a case: every setting with several seeds, measured against the truth.

use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::json;

use super::bench::{Bench, Reads, Run};
#[cfg(feature = "flip")]
use super::flip;
use super::record::{Choice, Line, Machine, Point, Record};
use super::{Case, Scale, Setting, Trial, Truth, fit, measure};
use crate::chart::plain;
use crate::error::Result;
use crate::power_law::PowerLaw;
use crate::technique::{self, Kind, Work};

/// The errors of the table of the fastest settings.
pub const ERRORS: [f64; 3] = [0.1, 0.01, 0.001];
/// The times of the table of the best settings, device milliseconds.
const TIMES_MS: [f64; 4] = [1.0, 10.0, 100.0, 1000.0];

/// The machine on which the numbers are taken.
pub fn machine(bench: &Bench) -> Machine {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    let device = bench.device();
    Machine {
        processor: model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned()),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        device: device.device.clone(),
        platform: device.platform_version.clone(),
        driver: device.driver.clone(),
        lanes: device.lanes,
        version: env!("CARGO_PKG_VERSION").into(),
        commit: std::env::var("CLOUDCHAMBER_COMMIT").unwrap_or_else(|_| "unknown".into()),
        unix_s: SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()),
    }
}

/// Measures every setting of a case, or gives the reason that it cannot be run here. `told` hears of each setting.
///
/// # Errors
/// Those of the requests, and of measuring.
pub fn study(
    bench: &Bench,
    case: &Case,
    scale: Scale,
    told: &mut dyn FnMut(&str),
) -> Result<std::result::Result<Record, String>> {
    let Trial { truth, settings } = match (case.trial)(bench, scale)? {
        Ok(trial) => trial,
        Err(why) => return Ok(Err(why)),
    };
    let mut lines: Vec<Line> = Vec::new();
    for setting in &settings {
        let point = point(bench, setting, &truth, scale)?;
        told(&format!(
            "{}: {}, {} {}: {:.3} ms, error {:.4} %",
            case.name,
            setting.line,
            setting.of,
            setting.at,
            point.device_ms,
            100.0 * point.error.rmse
        ));
        match lines.iter_mut().find(|l| l.name == setting.line) {
            Some(line) => line.points.push(point),
            None => lines.push(Line {
                name: setting.line.clone(),
                of: setting.of.into(),
                expected_slope: setting.expected_slope,
                slope: None,
                points: vec![point],
            }),
        }
    }
    for line in &mut lines {
        let told_apart = |p: &&Point| p.error.rmse > 3.0 * truth.known_to;
        let points: Vec<(f64, f64)> = line.points.iter().filter(told_apart).map(|p| (p.at, p.error.rmse)).collect();
        line.slope = PowerLaw::through(&points).map(|l| l.power);
    }
    Ok(Ok(finish(bench, case, scale, truth, lines)))
}

fn finish(bench: &Bench, case: &Case, scale: Scale, truth: Truth, mut lines: Vec<Line>) -> Record {
    let all: Vec<(f64, f64)> = lines.iter().flat_map(|l| &l.points).map(|p| (p.device_ms, p.error.rmse)).collect();
    let front = fit::pareto(&all);
    let names: Vec<String> = lines
        .iter()
        .flat_map(|l| l.points.iter().map(move |p| format!("{}, {} {}", l.name, l.of, plain(p.at))))
        .collect();
    for (point, front) in lines.iter_mut().flat_map(|l| &mut l.points).zip(front) {
        point.front = front;
    }
    let choice = |bound: f64, found: Option<usize>| Choice {
        bound,
        setting: found.map(|i| names[i].clone()),
        device_ms: found.map(|i| all[i].0),
        rmse: found.map(|i| all[i].1),
    };
    Record {
        name: case.name.into(),
        title: case.title.into(),
        truth: truth.words,
        truth_known_to: truth.known_to,
        quick: scale == Scale::Quick,
        machine: machine(bench),
        equal_error: ERRORS.iter().map(|e| choice(*e, fit::fastest_within(&all, *e))).collect(),
        equal_time: TIMES_MS.iter().map(|t| choice(*t, fit::best_within(&all, *t))).collect(),
        lines,
    }
}

/// Runs a setting with several seeds. The first run, which may compile, is not timed.
fn point(bench: &Bench, setting: &Setting, truth: &Truth, scale: Scale) -> Result<Point> {
    let mut request = setting.request.clone();
    bench.run(&small(&request), setting.reads)?;
    let mut run = |seed: usize| -> Result<Run> {
        request["seed"] = json!(seed);
        if let Some((_, field)) = field_of(&mut request) {
            field["seed"] = json!(seed);
        }
        bench.run(&request, setting.reads)
    };
    let runs: Vec<Run> = (0..scale.runs()).map(|i| run(i + 1)).collect::<Result<_>>()?;
    let values: Vec<Vec<f64>> = runs.iter().map(|r| r.values.clone()).collect();
    let expected = truth.centres.as_ref().filter(|_| setting.centres).unwrap_or(&truth.values);
    let error =
        if setting.random { measure::measure(&values, expected)? } else { measure::measure(&values[..1], expected)? };
    let looks = matches!(setting.reads, Reads::Luminance | Reads::Transmittance);
    let size = truth.size.filter(|_| looks);
    let of = |f: fn(&Run) -> f64| measure::median(&runs.iter().map(f).collect::<Vec<_>>());
    Ok(Point {
        at: setting.at,
        device_ms: of(|r| r.device_ms),
        wall_ms: of(|r| r.wall_ms),
        error,
        #[cfg(feature = "flip")]
        flip: size.map(|size| flip::mean_flip(expected, &values[0], size)).transpose()?,
        #[cfg(not(feature = "flip"))]
        flip: size.and(None),
        stated_error: runs[0].stated_error,
        samples: runs[0].samples,
        runs: if setting.random { runs.len() } else { 1 },
        bytes: runs[0].bytes,
        counts: runs[0].reply["counts"].clone(),
        warnings: runs[0].codes(),
        front: false,
        request: setting.request.clone(),
    })
}

/// The parameters of a request's field, and of which of them there may be more or less.
pub(super) fn field_of(request: &mut serde_json::Value) -> Option<(Work, &mut serde_json::Value)> {
    let (technique, work) = technique::fields().find_map(|t| match t.kind {
        Kind::Field { work: Some(work), .. } if request["volume"].get(t.name).is_some() => Some((t, work)),
        _ => None,
    })?;
    request["volume"].get_mut(technique.name).map(|own| (work, own))
}

/// The same request with next to no work in it. It compiles the kernels that the request needs.
fn small(request: &serde_json::Value) -> serde_json::Value {
    let mut small = request.clone();
    small["image"] = json!({"width": 8, "height": 8});
    small["budget"] = json!({"samples": 1});
    if let Some((work, field)) = field_of(&mut small) {
        field[work.of] = json!(work.first.min(1000));
    }
    small
}
