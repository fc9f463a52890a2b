//! A map of a method's error over two parameters.

use plotters::prelude::*;

use crate::chart::plain;
use crate::error::{Error, Result};
use crate::study::verdict::{HeatMap, Sample, Verdict};

const SIZE: (u32, u32) = (760, 460);
/// The frame of a cell whose reply warns.
const WARNS: RGBColor = RGBColor(0, 60, 200);
/// The least error whose cell is so dark that words on it are white.
const DARK: f64 = 0.3;

/// The heat map: a cell's colour and number are the error relative to the truth; a blue frame is a warning, a black cross silence.
///
/// # Errors
/// [`Error::Internal`] when drawing fails.
pub fn heat_map(map: &HeatMap) -> Result<String> {
    let mut svg = String::new();
    draw(&mut svg, map).map_err(Error::internal)?;
    Ok(svg)
}

/// The error relative to the truth.
fn relative(sample: &Sample) -> Option<f64> {
    Some((sample.measured? - sample.truth) / if sample.truth == 0.0 { 1.0 } else { sample.truth.abs() })
}

/// From white through yellow to red, by the magnitude from 0.1 % to 100 %.
fn shade(error: Option<f64>) -> RGBColor {
    let Some(error) = error else { return BLACK };
    let part = ((error.abs().max(1e-3).log10() + 3.0) / 3.0).clamp(0.0, 1.0);
    let c = colorous::YELLOW_ORANGE_RED.eval_continuous(0.85 * part);
    if part <= 0.0 { RGBColor(250, 250, 245) } else { RGBColor(c.r, c.g, c.b) }
}

/// The words for an error in its cell.
fn words(error: Option<f64>) -> String {
    match error {
        None => "—".into(),
        Some(e) if e.abs() < 5e-5 => "0".into(),
        Some(e) if e.abs() < 0.1 => format!("{:+.2} %", 100.0 * e),
        Some(e) if e.abs() < 10.0 => format!("{:+.0} %", 100.0 * e),
        Some(e) => format!("{e:+.0e}"),
    }
}

fn draw(svg: &mut String, map: &HeatMap) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let (left, top, right, bottom) = (96, 44, SIZE.0 as i32 - 16, SIZE.1 as i32 - 78);
    let wide = (right - left) / map.across.len().max(1) as i32;
    let high = (bottom - top) / map.up.len().max(1) as i32;
    let font = |size: i32| ("sans-serif", size).into_font();
    area.draw(&Text::new(map.title.clone(), (left, 12), font(18)))?;
    for (row, samples) in map.samples.iter().enumerate() {
        let y = bottom - (row as i32 + 1) * high;
        area.draw(&Text::new(plain(map.up[row]), (left - 46, y + high / 2 - 6), font(13)))?;
        for (column, sample) in samples.iter().enumerate() {
            let x = left + column as i32 * wide;
            let cell = [(x + 2, y + 2), (x + wide - 2, y + high - 2)];
            let noise = sample.verdict() == Verdict::Unbiased;
            let error = if noise { Some(0.0) } else { relative(sample) };
            area.draw(&Rectangle::new(cell, shade(error).filled()))?;
            if !sample.warnings.is_empty() {
                area.draw(&Rectangle::new(cell, WARNS.stroke_width(3)))?;
            }
            if !sample.verdict().is_told() {
                area.draw(&Cross::new((x + wide / 2, y + high / 2), high / 4, BLACK.stroke_width(3)))?;
            }
            let words = if noise { "≈ 0".into() } else { words(error) };
            let ink = if error.is_none_or(|e| e.abs() > DARK) { WHITE } else { BLACK };
            area.draw(&Text::new(words, (x + 8, y + high / 2 - 6), font(12).color(&ink)))?;
        }
    }
    for (column, value) in map.across.iter().enumerate() {
        area.draw(&Text::new(plain(*value), (left + column as i32 * wide + 8, bottom + 6), font(13)))?;
    }
    area.draw(&Text::new(map.axes[0].clone(), (left, bottom + 28), font(15)))?;
    area.draw(&Text::new(map.axes[1].clone(), (14, (top + bottom) / 2), font(15).transform(FontTransform::Rotate270)))?;
    let note = "relative error; blue frame: the reply warns; cross: it is silent; ≈ 0: not told from noise";
    area.draw(&Text::new(note, (left, bottom + 52), font(12).color(&BLACK.mix(0.6))))?;
    area.present()?;
    Ok(())
}
