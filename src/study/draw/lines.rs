//! The chart of a study: each setting's error against its time.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{color, percent};
use crate::chart::{bounds, plain};
use crate::error::{Error, Result};
use crate::study::record::{Line, Point, Record};

/// Relative errors below this are drawn here, since a logarithmic axis has no 0.
const LEAST_ERROR: f64 = 1e-7;
const SIZE: (u32, u32) = (1000, 520);
const CHART_WIDTH: u32 = 620;

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The chart of a study: log error against log time, a line a technique and a point a setting. A ring marks the settings that no other
/// setting beats. The slopes are given in words.
///
/// # Errors
/// [`Error::Internal`] when drawing fails.
pub fn study(record: &Record) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, record).map_err(Error::internal)?;
    Ok(svg)
}

fn place(point: &Point) -> (f64, f64) {
    (point.device_ms.max(1e-3), point.error.rmse.max(LEAST_ERROR))
}

fn draw(svg: &mut String, record: &Record) -> Drawn {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let area = area.titled(&record.title, ("sans-serif", 20))?;
    let (left, right) = area.split_horizontally(CHART_WIDTH);
    draw_lines(&left, record)?;
    draw_legend(&right, record)?;
    area.present()?;
    Ok(())
}

fn draw_lines(area: &Area<'_>, record: &Record) -> Drawn {
    let all = || record.lines.iter().flat_map(|l| &l.points).map(place);
    let (x, y) = (bounds(all().map(|p| p.0), [1.0, 1000.0], 1.7), bounds(all().map(|p| p.1), [1e-3, 1.0], 1.7));
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(84)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    axes!(chart, "time on the device / ms", "error: RMS over the mean of the truth", [plain, percent])?;
    let mut front: Vec<(f64, f64)> =
        record.lines.iter().flat_map(|l| &l.points).filter(|p| p.front).map(place).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(front.iter().copied(), BLACK.mix(0.25).stroke_width(5)))?;
    for (i, line) in record.lines.iter().enumerate() {
        let points: Vec<(f64, f64)> = line.points.iter().map(place).collect();
        chart.draw_series(LineSeries::new(points.iter().copied(), color(i).stroke_width(2)))?;
        chart.draw_series(points.iter().map(|p| marker(i, *p)))?;
    }
    chart.draw_series(front.into_iter().map(|p| Circle::new(p, 7, BLACK.stroke_width(1))))?;
    Ok(())
}

/// A mark of the line's own colour and, after the first colours, of another shape.
fn marker<'a, C: Clone + 'static>(line: usize, at: C) -> DynElement<'static, SVGBackend<'a>, C> {
    let style = color(line).filled();
    match line / super::COLORS.len() {
        0 => Circle::new(at, 4, style).into_dyn(),
        _ => TriangleMarker::new(at, 6, style).into_dyn(),
    }
}

/// The words of a legend entry: the line's name, the range of its parameter, and its slopes.
fn words(line: &Line) -> [String; 2] {
    let ends = match line.points.as_slice() {
        [] => String::new(),
        [only] => format!("{} {}", line.of, plain(only.at)),
        [first, .., last] => format!("{} {} … {}", line.of, plain(first.at), plain(last.at)),
    };
    let slope = match (line.slope, line.expected_slope) {
        (Some(found), Some(expected)) => format!(", slope {found:.2} (expected {expected})"),
        (Some(found), None) => format!(", slope {found:.2}"),
        _ => String::new(),
    };
    [line.name.clone(), ends + &slope]
}

fn draw_legend(area: &Area<'_>, record: &Record) -> Drawn {
    let (large, small) = (("sans-serif", 14).into_font(), ("sans-serif", 12).into_font());
    let mut y = 8;
    for (i, line) in record.lines.iter().enumerate() {
        area.draw(&marker(i, (8, y + 7)))?;
        let [name, more] = words(line);
        area.draw(&Text::new(name, (20, y), large.clone()))?;
        area.draw(&Text::new(more, (20, y + 17), small.clone().color(&BLACK.mix(0.7))))?;
        y += 38;
    }
    area.draw(&Circle::new((8, y + 7), 7, BLACK.stroke_width(1)))?;
    area.draw(&Text::new("no setting is both faster and better", (20, y), small.clone()))?;
    let machine = &record.machine;
    for (k, text) in [&machine.processor, &format!("{} threads, {}", machine.threads, short(&machine.platform))]
        .into_iter()
        .enumerate()
    {
        area.draw(&Text::new(text.clone(), (2, y + 30 + 16 * k as i32), small.clone().color(&BLACK.mix(0.55))))?;
    }
    Ok(())
}

/// The first words of a platform's version.
fn short(platform: &str) -> String {
    platform.split_whitespace().take(5).collect::<Vec<_>>().join(" ").trim_end_matches(',').to_owned()
}
