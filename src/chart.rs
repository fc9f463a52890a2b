//! Charts as SVG, drawn by a plotting library.

use plotters::prelude::*;

use crate::error::{Error, Result};
use crate::job::TracePoint;

/// Relative errors below this are drawn here, since a logarithmic axis has no 0.
const LEAST_ERROR: f64 = 1e-6;

/// A render's error against time, both on logarithmic axes. Previews of fewer pixels are hollow.
///
/// # Errors
/// [`Error::Internal`] when drawing fails.
pub fn convergence(trace: &[TracePoint], state: &str) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, trace, state).map_err(Error::internal)?;
    Ok(svg)
}

fn draw(svg: &mut String, trace: &[TracePoint], state: &str) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let points: Vec<(f64, f64, bool)> =
        trace.iter().filter_map(|p| Some((p.elapsed_ms.max(0.1), p.error?.max(LEAST_ERROR), p.stride == 1))).collect();
    let x = bounds(points.iter().map(|p| p.0), [1.0, 1000.0], 1.5);
    let y = bounds(points.iter().map(|p| p.1), [1e-3, 1.0], 1.5);
    let area = SVGBackend::with_string(svg, (640, 400)).into_drawing_area();
    area.fill(&WHITE)?;
    let samples = trace.last().map_or(0, |p| p.samples);
    let mut chart = ChartBuilder::on(&area)
        .caption(format!("Error against time: {state}, {samples} samples"), ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(72)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("elapsed / ms")
        .y_desc("relative error (RMS)")
        .x_labels(4)
        .y_labels(5)
        .x_label_formatter(&|v| plain(*v))
        .y_label_formatter(&|v| plain(*v))
        .draw()?;
    chart.draw_series(LineSeries::new(points.iter().map(|p| (p.0, p.1)), &BLUE))?;
    let dot = |p: &(f64, f64, bool)| Circle::new((p.0, p.1), 3, if p.2 { BLUE.filled() } else { BLUE.stroke_width(1) });
    chart.draw_series(points.iter().map(dot))?;
    area.present()?;
    Ok(())
}

/// The bounds of values above 0 with some room around them, or `none` if there are no values.
pub fn bounds(values: impl Iterator<Item = f64> + Clone, none: [f64; 2], room: f64) -> std::ops::Range<f64> {
    let least = values.clone().reduce(f64::min).unwrap_or(none[0]) / room;
    let most = values.reduce(f64::max).unwrap_or(none[1]) * room;
    least..most
}

/// A number in its shortest readable form.
pub fn plain(v: f64) -> String {
    if (0.01..1e5).contains(&v) { format!("{}", (v * 1e4).round() / 1e4) } else { format!("{v:.0e}") }
}
