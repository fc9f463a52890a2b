//! `./dev bench equal_error`: time for equal error. VTK's CPU ray caster draws volumes at one voxel a step. Of our settings, the fastest counts
//! whose picture has no greater error. Prints Markdown, and puts a chart of each beside those of the study (`CHARTS=folder`, else the data
//! folder's).
//!
//! The truth is our own picture with steps of a tenth of a voxel and 64 places in each pixel, in linear floats: with shorter steps, VTK's own
//! picture converges elsewhere, since it sums in 15 bits. A common factor is not counted against VTK's picture, so that a difference in lighting
//! does not matter. The volumes are the synthetic one, and those of `SCANS`, files separated by `:` with bytes as voxels.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod scenes;

use std::path::{Path, PathBuf};

use clap::Parser;
use cloudchamber::config::{DeviceArgs, Limits};
use cloudchamber::study::bench::{Bench, Reads, Run};
use cloudchamber::study::measure::{Measured, measure};
use cloudchamber::study::record::{Choice, Line, Point, Record};
use cloudchamber::study::results::{PEERS, Results};
use cloudchamber::study::{ERRORS, fit, machine};
use cloudchamber::volume::{RawQuery, Volume, Voxels};
use scenes::{FRAMES, SIDE, list, median, modes, synthetic, vtk};
use serde_json::{Value, json};

/// The steps that are tried, in voxels.
const STEPS: [f64; 9] = [0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 8.0, 16.0];
const PIXELS: usize = 512;

#[derive(Parser)]
struct Flags {
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    limits: Limits,
}

/// A volume of bytes, with its size.
struct Subject {
    name: String,
    bytes: Vec<u8>,
    dims: [usize; 3],
    spacing: [f64; 3],
}

impl Subject {
    fn synthetic() -> Self {
        let spacing = [2.0 / SIDE as f64; 3];
        Self { name: "synthetic".into(), bytes: synthetic(SIDE), dims: [SIDE; 3], spacing }
    }

    fn scan(bench: &Bench, path: &Path) -> Self {
        let id = bench.assets().volumes().insert(std::fs::read(path).unwrap(), "scan", None).unwrap().1;
        let volume: std::sync::Arc<Volume> = bench.assets().volumes().get(&id).unwrap();
        let Voxels::U8(bytes) = volume.voxels().unwrap() else {
            panic!("{}: its voxels are not bytes", path.display())
        };
        let name = path.file_name().unwrap().to_string_lossy().split('.').next().unwrap().to_lowercase();
        Self { name, bytes: bytes.clone(), dims: volume.dims(), spacing: volume.spacing() }
    }

    fn voxel(&self) -> f64 {
        self.spacing.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The distance from the eye to the middle of the turn's axis.
    fn distance(&self) -> f64 {
        let sides = self.dims.iter().zip(self.spacing).map(|(n, s)| *n as f64 * s);
        1.8 * sides.fold(0.0, f64::max)
    }

    fn upload(&self, bench: &Bench) -> Value {
        let query = RawQuery {
            dims: Some(list(self.dims)),
            r#type: Some("u8".into()),
            spacing: Some(list(self.spacing)),
            endian: None,
        };
        json!({"id": bench.assets().volumes().insert(self.bytes.clone(), &self.name, query.parse().unwrap()).unwrap().1})
    }

    /// The parameters of a mode of `scenes`, whose opacities are for the synthetic volume's voxels.
    fn own(&self, parameters: &Value) -> Value {
        let mut own = parameters.clone();
        let scale = 2.0 / SIDE as f64 / self.voxel();
        for point in own["transfer_function"]["points"].as_array_mut().unwrap() {
            point["opacity_per_unit"] = json!(point["opacity_per_unit"].as_f64().unwrap() * scale);
        }
        own
    }

    fn request(&self, volume: &Value, frame: usize, samples: u32, own: &Value) -> Value {
        let (angle, distance) = (frame as f64 / FRAMES as f64 * std::f64::consts::TAU, self.distance());
        json!({"technique": "emission_absorption", "volume": volume, "image": {"width": PIXELS, "height": PIXELS},
            "camera": {"eye": [distance * angle.sin(), -distance * angle.cos(), distance / 3.0], "target": [0, 0, 0],
            "up": [0, 0, 1], "fov_y_deg": 30}, "budget": {"samples": samples}, "emission_absorption": own})
    }

    /// The seconds of a frame of VTK's, and its luminance; `None` without VTK.
    fn vtk(&self, mode: &str) -> Option<(f64, Vec<f64>)> {
        let folder = tempfile::tempdir().unwrap();
        let [raw, out] = ["volume.raw", "out.rgb"].map(|name| folder.path().join(name));
        std::fs::write(&raw, &self.bytes).unwrap();
        let seconds = vtk(&raw, self.dims, self.spacing, self.distance(), mode, Some(&out))?;
        let luminance =
            |p: &[u8]| (0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])) / 255.0;
        Some((seconds, std::fs::read(&out).unwrap().chunks_exact(3).map(luminance).collect()))
    }
}

fn point(at: f64, ms: [f64; 2], error: Measured, run: Option<&Run>) -> Point {
    Point {
        at,
        device_ms: ms[0],
        wall_ms: ms[1],
        error,
        flip: None,
        stated_error: run.and_then(|run| run.stated_error),
        samples: 1,
        runs: 1,
        bytes: run.map_or(0, |run| run.bytes),
        counts: run.map_or(Value::Null, |run| run.reply["counts"].clone()),
        warnings: Vec::new(),
        front: false,
        // A request would repeat the many points of its transfer function, which are in the benchmark.
        request: Value::Null,
    }
}

/// The values times the factor that brings them closest to the truth.
fn fitted(values: &[f64], truth: &[f64]) -> Vec<f64> {
    let products: f64 = values.iter().zip(truth).map(|(v, t)| v * t).sum();
    let squares: f64 = values.iter().map(|v| v * v).sum();
    values.iter().map(|v| v * products / squares).collect()
}

fn line(name: &str, points: Vec<Point>) -> Line {
    Line { name: name.into(), of: "voxels a step".into(), expected_slope: None, slope: None, points }
}

/// Measures a volume in a mode and prints its row.
fn compare(bench: &Bench, results: &Results, subject: &Subject, mode: &str, parameters: &Value) {
    let (volume, own) = (subject.upload(bench), subject.own(parameters));
    let with = |step: f64, more: Value| {
        let mut own = own.clone();
        own["step_voxels"] = json!(step);
        own.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        own
    };
    let finest = with(0.1, json!({"opacity_threshold": 1.0, "jitter": true}));
    let truth = bench.run(&subject.request(&volume, 0, 64, &finest), Reads::Luminance).unwrap().values;
    let Some((vtk_s, picture)) = subject.vtk(mode) else { panic!("no VTK: ./dev bench installs it") };
    let raw = measure(std::slice::from_ref(&picture), &truth).unwrap();
    let vtk = measure(&[fitted(&picture, &truth)], &truth).unwrap();
    let ours = |name: &str, more: Value| {
        let of = |step: &f64| {
            let own = with(*step, more.clone());
            let runs: Vec<Run> = (0..FRAMES)
                .map(|i| bench.run(&subject.request(&volume, i, 1, &own), Reads::Luminance).unwrap())
                .collect();
            let ms = [median(runs.iter().map(|r| r.device_ms)), median(runs.iter().map(|r| r.wall_ms))];
            let error = measure(&[runs[0].values.clone()], &truth).unwrap();
            point(*step, ms, error, Some(&runs[0]))
        };
        line(name, STEPS.iter().map(of).collect())
    };
    let lines = vec![
        ours("a sample a step", json!({})),
        ours("to opacity 0.9999", json!({"opacity_threshold": 0.9999})),
        line("VTK, times the best factor", vec![point(1.0, [1e3 * vtk_s; 2], vtk, None)]),
    ];
    let ours = lines[..2].iter().flat_map(|l| l.points.iter().map(move |p| (l, p)));
    let best = ours.filter(|(_, p)| p.error.rmse <= vtk.rmse).min_by(|a, b| a.1.device_ms.total_cmp(&b.1.device_ms));
    let best = best.map(|(line, point)| (format!("{}, {} voxels a step", line.name, point.at), point.clone()));
    results.put(&finish(bench, subject, mode, lines)).unwrap();
    let Some((setting, best)) = best else {
        return println!("| {} | {mode} | {:.0} ms | {:.2} % | none |", subject.name, 1e3 * vtk_s, 100.0 * vtk.rmse);
    };
    println!(
        "| {} | {mode} | {:.0} ms | {:.2} % ({:.2} %) | {setting} | {:.1} ms | {:.2} % | {:.1}× | {:.1}× |",
        subject.name,
        1e3 * vtk_s,
        100.0 * vtk.rmse,
        100.0 * raw.rmse,
        best.device_ms,
        100.0 * best.error.rmse,
        1e3 * vtk_s / best.device_ms,
        1e3 * vtk_s / best.wall_ms,
    );
}

fn finish(bench: &Bench, subject: &Subject, mode: &str, mut lines: Vec<Line>) -> Record {
    let all: Vec<(f64, f64)> = lines.iter().flat_map(|l| &l.points).map(|p| (p.device_ms, p.error.rmse)).collect();
    for (point, front) in lines.iter_mut().flat_map(|l| &mut l.points).zip(fit::pareto(&all)) {
        point.front = front;
    }
    let ours: Vec<(String, &Point)> = lines[..2]
        .iter()
        .flat_map(|l| l.points.iter().map(move |p| (format!("{}, {} {}", l.name, l.of, p.at), p)))
        .collect();
    let times: Vec<(f64, f64)> = ours.iter().map(|(_, p)| (p.device_ms, p.error.rmse)).collect();
    let choice = |bound: f64| {
        let found = fit::fastest_within(&times, bound).map(|i| &ours[i]);
        Choice {
            bound,
            setting: found.map(|(setting, _)| setting.clone()),
            device_ms: found.map(|(_, p)| p.device_ms),
            rmse: found.map(|(_, p)| p.error.rmse),
        }
    };
    let equal_error = ERRORS.map(choice).to_vec();
    let [x, y, z] = subject.dims;
    Record {
        name: format!("{PEERS}{}_{mode}", subject.name),
        title: format!(
            "The {mode} picture of {} ({x} × {y} × {z} bytes) by step, against VTK's of a voxel a step",
            subject.name
        ),
        truth: "our picture of a tenth of a voxel a step and 64 places in each pixel".into(),
        truth_known_to: 0.002,
        quick: false,
        machine: machine(bench),
        lines,
        equal_error,
        equal_time: Vec::new(),
    }
}

fn main() {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    cloudchamber::device::keep_compiled_kernels_in(&common::kernel_cache()).unwrap();
    let work = runtime.spawn_blocking(|| {
        let flags = Flags::parse_from(["equal_error"]);
        let bench = Bench::new(&flags.device, flags.limits).unwrap();
        let charts = std::env::var_os("CHARTS").map_or_else(|| flags.device.data_dir().join("studies"), PathBuf::from);
        let results = Results::new(charts);
        let scans = std::env::var("SCANS").unwrap_or_default();
        let scans = scans.split(':').filter(|s| !s.is_empty()).map(|path| Subject::scan(&bench, Path::new(path)));
        println!("| volume | mode | VTK | its error (with no factor) | ours | device | error | device against VTK | wall against VTK |\n|---|---|---|---|---|---|---|---|---|");
        for subject in [Subject::synthetic()].into_iter().chain(scans) {
            for (mode, _, parameters) in modes().into_iter().filter(|(_, t, _)| *t == "emission_absorption") {
                compare(&bench, &results, &subject, mode, &parameters);
            }
        }
    });
    runtime.block_on(work).unwrap();
}
