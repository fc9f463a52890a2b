//! `./dev bench growth`: the cost of a frame by volume size, image size and step, and the cost of building the macro-cells. Draws
//! `docs/charts/cost_by_*.svg` and prints Markdown. The growth is the slope of log device time over the upper half of a line.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark says what is wrong by panicking")]

#[path = "../tests/common/mod.rs"]
mod common;
mod scenes;

use std::time::Instant;

use cloudchamber::device::cells::Cells;
use cloudchamber::device::{self, Device, DeviceConfig};
use cloudchamber::volume::VoxelType;
use plotters::prelude::*;
use scenes::{Client, median, modes, scene, synthetic};
use serde_json::{Value, json};

const REPEATS: usize = 7;

/// One technique's cost: x and device milliseconds.
struct Line {
    name: &'static str,
    points: Vec<(f64, f64)>,
}

impl Line {
    /// The slope of log y against log x over the last three points, by least squares.
    fn growth(&self) -> f64 {
        let last: Vec<(f64, f64)> = self.points.iter().rev().take(3).map(|(x, y)| (x.ln(), y.ln())).collect();
        let n = last.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| last.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        last.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / last.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
    }
}

/// The median device time of a few frames from different sides.
fn cost(client: &Client, volume: &str, technique: &str, parameters: &Value, change: impl Fn(&mut Value)) -> f64 {
    let frame = |i: usize| {
        let mut scene = scene(volume, i, technique, parameters);
        change(&mut scene);
        1e3 * client.frame(&scene).device_s
    };
    frame(0);
    median((0..REPEATS).map(frame))
}

fn draw(file: &str, title: &str, x: &str, lines: &[Line]) {
    let path = format!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/charts/{}.svg"), file);
    let all: Vec<(f64, f64)> = lines.iter().flat_map(|l| l.points.clone()).collect();
    let end = |f: fn(&(f64, f64)) -> f64, by: f64| {
        let pick = if by < 1.0 { f64::min } else { f64::max };
        all.iter().map(f).reduce(pick).unwrap() * by
    };
    let (xs, ys) = (end(|p| p.0, 0.9)..end(|p| p.0, 1.1), end(|p| p.1, 0.6)..end(|p| p.1, 1.6));
    let area = SVGBackend::new(&path, (720, 440)).into_drawing_area();
    area.fill(&WHITE).unwrap();
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(60)
        .build_cartesian_2d(xs.log_scale(), ys.log_scale())
        .unwrap();
    let number = |v: &f64| format!("{}", (v * 1000.0).round() / 1000.0);
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc("device time of a frame / ms")
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .draw()
        .unwrap();
    for (i, line) in lines.iter().enumerate() {
        let colour = Palette99::pick(i).to_rgba();
        let label = format!("{}: slope {:.2}", line.name, line.growth());
        let series = chart.draw_series(LineSeries::new(line.points.clone(), colour.stroke_width(2))).unwrap();
        series.label(label).legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(line.points.iter().map(|p| Circle::new(*p, 3, colour.filled()))).unwrap();
    }
    let falls = lines[0].growth() < 0.0;
    chart
        .configure_series_labels()
        .position(if falls { SeriesLabelPosition::UpperRight } else { SeriesLabelPosition::UpperLeft })
        .background_style(WHITE.mix(0.8))
        .draw()
        .unwrap();
    area.present().unwrap();
    println!(
        "\n| {x} | {} |\n|---|{}",
        lines.iter().map(|l| l.name).collect::<Vec<_>>().join(" | "),
        "---|".repeat(lines.len())
    );
    for i in 0..lines[0].points.len() {
        let row: Vec<String> = lines.iter().map(|l| format!("{:.1} ms", l.points[i].1)).collect();
        println!("| {} | {} |", lines[0].points[i].0, row.join(" | "));
    }
    let growth: Vec<String> = lines.iter().map(|l| format!("{:.2}", l.growth())).collect();
    println!("| slope | {} |", growth.join(" | "));
}

/// The time for building the macro-cells of a 256³ byte volume, milliseconds.
fn cells() -> f64 {
    device::keep_compiled_kernels_in(&common::kernel_cache()).unwrap();
    let mut device = Device::open(&DeviceConfig::pocl()).unwrap();
    let voxels = device.upload(&synthetic(256), 8).unwrap();
    let build = || {
        let started = Instant::now();
        let cells = Cells::new(&mut device, &voxels, [256; 3], VoxelType::U8).unwrap();
        cells.distances(&mut device, &[[76.5, 76.5]], 0.0).unwrap();
        1e3 * started.elapsed().as_secs_f64()
    };
    let times: Vec<f64> = std::iter::repeat_with(build).take(REPEATS + 1).collect();
    median(times.into_iter().skip(1))
}

fn main() {
    println!("macro-cells of 256³ bytes and their distances, built on the device: {:.1} ms", cells());
    let client = Client::new(&["--max-image-side", "4096"]);
    let line = |name, points| Line { name, points };
    let sizes = [64, 128, 256, 512];
    let volumes: Vec<String> = sizes.iter().map(|n| client.upload(synthetic(*n), *n)).collect();
    let same = |_: &mut Value| {};
    let by_volume: Vec<Line> = modes()
        .into_iter()
        .map(|(name, technique, own)| {
            line(
                name,
                sizes.iter().zip(&volumes).map(|(n, v)| (*n as f64, cost(&client, v, technique, &own, same))).collect(),
            )
        })
        .collect();
    draw("cost_by_volume", "A 512² frame by the volume's side, one voxel a step", "voxels a side", &by_volume);
    let by_image: Vec<Line> = modes()
        .into_iter()
        .map(|(name, technique, own)| {
            let of = |side: usize| {
                cost(&client, &volumes[2], technique, &own, |s| s["image"] = json!({"width": side, "height": side}))
            };
            line(name, [128, 256, 512, 1024, 2048].iter().map(|n| (*n as f64, of(*n))).collect())
        })
        .collect();
    draw("cost_by_image", "A frame of 256³ voxels by the image's side, one voxel a step", "pixels a side", &by_image);
    let by_step: Vec<Line> = modes()
        .into_iter()
        .map(|(name, technique, own)| {
            let of =
                |step: f64| cost(&client, &volumes[2], technique, &own, |s| s[technique]["step_voxels"] = step.into());
            line(name, [4.0, 2.0, 1.0, 0.5, 0.25].iter().map(|h| (*h, of(*h))).collect())
        })
        .collect();
    draw("cost_by_step", "A 512² frame of 256³ voxels by the step", "voxels a step", &by_step);
}
