//! The chart of the study of stated errors: each picture's stated error against its true one.

use std::collections::BTreeSet;

use plotters::prelude::*;

use super::{color, percent};
use crate::chart::bounds;
use crate::error::{Error, Result};
use crate::study::honesty::{Figures, Honesty, Outcome};

const SIZE: (u32, u32) = (1000, 560);
const CHART_WIDTH: u32 = 700;
/// Errors below this, true or stated, are drawn here, since a logarithmic axis has no 0.
const LEAST: f64 = 1e-5;

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// The chart of stated against true errors, a colour a technique. Below the diagonal is what states too little.
///
/// # Errors
/// [`Error::Internal`] when drawing fails.
pub fn honesty(found: &Honesty) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, found).map_err(Error::internal)?;
    Ok(svg)
}

fn draw(svg: &mut String, found: &Honesty) -> Drawn {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let area = area.titled("Stated against true errors of random scenes", ("sans-serif", 20))?;
    let (left, right) = area.split_horizontally(CHART_WIDTH);
    let scenes = found.scenes();
    let names: BTreeSet<&str> = scenes.iter().map(|o| o.technique.as_str()).collect();
    let of = |name: &str| scenes.iter().copied().filter(|o| o.technique == name).collect::<Vec<&Outcome>>();
    let place = |o: &Outcome| o.pair().map(|[stated, is]| (is.max(LEAST), stated.max(LEAST)));
    let all = || scenes.iter().copied().filter_map(place).flat_map(|(x, y)| [x, y]);
    let range = bounds(all(), [1e-3, 1.0], 1.5);
    let mut chart = ChartBuilder::on(&left)
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(84)
        .build_cartesian_2d(range.clone().log_scale(), range.clone().log_scale())?;
    axes!(chart, "true error", "stated error", [percent, percent])?;
    let line = |factor: f64| [range.start, range.end].map(|x| (x, factor * x));
    chart.draw_series(LineSeries::new(line(1.0), BLACK.stroke_width(2)))?;
    chart.draw_series(LineSeries::new(line(4.0), BLACK.mix(0.3).stroke_width(1)))?;
    for (i, name) in names.iter().enumerate() {
        let places = of(name).into_iter().filter_map(place);
        chart.draw_series(places.map(|at| Circle::new(at, 3, color(i).filled())))?;
    }
    for (i, name) in names.iter().enumerate() {
        let (y, figures) = (14 + 40 * i as i32, Figures::of(&of(name)));
        let part = 100.0 * figures.covered as f64 / figures.known.max(1) as f64;
        right.draw(&Circle::new((8, y + 7), 5, color(i).filled()))?;
        right.draw(&Text::new((*name).to_owned(), (20, y), ("sans-serif", 14)))?;
        let words = format!("{:.0} % of {} covered, median {:.2}", part, figures.known, figures.median);
        right.draw(&Text::new(words, (20, y + 17), ("sans-serif", 12).into_font().color(&BLACK.mix(0.7))))?;
    }
    let (y, all) = (14 + 40 * names.len() as i32, found.figures());
    let words = format!("all: {:.1} % of {} covered", 100.0 * all.covered as f64 / all.known.max(1) as f64, all.known);
    right.draw(&Text::new(words, (2, y), ("sans-serif", 14)))?;
    for (row, words) in
        ["black line: stated = true; below it too little", "grey line: stated = 4 × true"].iter().enumerate()
    {
        let small = ("sans-serif", 12).into_font().color(&BLACK.mix(0.55));
        right.draw(&Text::new((*words).to_owned(), (2, y + 26 + 17 * row as i32), small))?;
    }
    area.present()?;
    Ok(())
}
