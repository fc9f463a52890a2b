//! The study's charts as SVG, drawn by a plotting library.

/// Draws the axes of a chart with these words and formats.
macro_rules! axes {
    ($chart:expr, $x:expr, $y:expr, [$of_x:expr, $of_y:expr]) => {
        $chart
            .configure_mesh()
            .x_desc($x)
            .y_desc($y)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 15))
            .x_label_formatter(&|v| $of_x(*v))
            .y_label_formatter(&|v| $of_y(*v))
            .light_line_style(WHITE.mix(0.0))
            .draw()
    };
}

mod heat;
mod lines;
mod scatter;
mod sweep;

pub use heat::heat_map;
pub use lines::study;
pub use scatter::honesty;
pub use sweep::sweep;

use plotters::style::RGBColor;

/// Colours that all eyes tell apart (Okabe & Ito, 2008), and that are dark enough on white.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(110, 110, 110),
];

/// The colour of the line of this index.
fn color(line: usize) -> RGBColor {
    COLORS[line % COLORS.len()]
}

/// A relative error in percent.
fn percent(v: f64) -> String {
    let v = 100.0 * v;
    if v >= 1e-3 { format!("{} %", (v * 1e4).round() / 1e4) } else { format!("{v:.0e} %") }
}
