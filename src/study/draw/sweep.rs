//! The chart of an experiment's sweeps: the measured values, the true ones, and the predicted ones.

use plotters::prelude::*;

use super::color;
use crate::chart::{bounds, plain};
use crate::error::{Error, Result};
use crate::study::verdict::{Findings, Sample, Sweep};

const SIZE: (u32, u32) = (1000, 460);
const CHART_WIDTH: u32 = 620;
/// Values spread wider than this are drawn on a logarithmic axis.
const WIDE: f64 = 30.0;

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// The chart of an experiment: points with error bars, the truth in grey, the prediction dashed, and a ring around flagged points.
///
/// # Errors
/// [`Error::Internal`] when drawing fails.
pub fn sweep(title: &str, findings: &Findings) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, title, findings).map_err(Error::internal)?;
    Ok(svg)
}

fn draw(svg: &mut String, title: &str, findings: &Findings) -> Drawn {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let area = area.titled(title, ("sans-serif", 20))?;
    let (left, right) = area.split_horizontally(CHART_WIDTH);
    let samples = || findings.sweeps.iter().flat_map(|s| &s.samples);
    let values = || samples().flat_map(|s| [s.measured, Some(s.truth), s.predicted]).flatten();
    let places = samples().map(|s| s.at);
    let x = bounds(places, [1.0, 10.0], 1.25);
    let most = values().fold(f64::MIN, f64::max);
    let least = values().fold(f64::MAX, f64::min);
    let axis = |chart: &mut ChartBuilder<'_, '_, SVGBackend<'_>>| {
        chart.margin(10).x_label_area_size(44).y_label_area_size(84);
    };
    let mut builder = ChartBuilder::on(&left);
    axis(&mut builder);
    // The two axes are of different types; the drawing is the same.
    macro_rules! draw_on {
        ($chart:expr) => {{
            let mut chart = $chart;
            axes!(chart, findings.of.as_str(), findings.quantity.as_str(), [plain, plain])?;
            for (i, sweep) in findings.sweeps.iter().enumerate() {
                let of = |value: fn(&Sample) -> Option<f64>| {
                    sweep.samples.iter().filter_map(|s| Some((s.at, value(s)?))).collect::<Vec<_>>()
                };
                chart.draw_series(LineSeries::new(of(|s| Some(s.truth)), BLACK.mix(0.3).stroke_width(3)))?;
                chart.draw_series(DashedLineSeries::new(of(|s| s.predicted), 6, 4, color(i).stroke_width(2)))?;
                let bars = sweep.samples.iter().filter(|s| s.standard_error > 0.0).filter_map(|s| {
                    let (m, e) = (s.measured?, 1.96 * s.standard_error);
                    Some(PathElement::new(vec![(s.at, m - e), (s.at, m + e)], color(i).stroke_width(1)))
                });
                chart.draw_series(bars)?;
                chart.draw_series(of(|s| s.measured).into_iter().map(|p| Circle::new(p, 4, color(i).filled())))?;
                let flagged = sweep.samples.iter().filter(|s| !s.warnings.is_empty());
                let rings = flagged.filter_map(|s| Some(Circle::new((s.at, s.measured?), 8, RED.stroke_width(1))));
                chart.draw_series(rings)?;
            }
        }};
    }
    if least > 0.0 && most / least > WIDE {
        let y = bounds(values(), [1e-3, 1.0], 1.5);
        draw_on!(builder.build_cartesian_2d(x.log_scale(), y.log_scale())?);
    } else {
        let room = 0.08 * (most - least).max(1e-3 * most.abs()).max(1e-9);
        draw_on!(builder.build_cartesian_2d(x.log_scale(), least - room..most + room)?);
    }
    legend(&right, &findings.sweeps)?;
    area.present()?;
    Ok(())
}

fn legend(area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>, sweeps: &[Sweep]) -> Drawn {
    let (large, small) = (("sans-serif", 14).into_font(), ("sans-serif", 12).into_font());
    let mut y = 8;
    for (i, sweep) in sweeps.iter().enumerate() {
        area.draw(&Circle::new((8, y + 7), 4, color(i).filled()))?;
        area.draw(&Text::new(sweep.method.clone(), (20, y), large.clone()))?;
        area.draw(&Text::new(sweep.verdict().words(), (20, y + 17), small.clone().color(&BLACK.mix(0.7))))?;
        y += 38;
    }
    area.draw(&Circle::new((8, y + 7), 8, RED.stroke_width(1)))?;
    area.draw(&Text::new("the reply warns", (20, y), small.clone()))?;
    area.draw(&PathElement::new(vec![(2, y + 26), (16, y + 26)], BLACK.mix(0.3).stroke_width(3)))?;
    area.draw(&Text::new("the truth; dashed: what a closed form predicts", (20, y + 20), small))?;
    Ok(())
}
