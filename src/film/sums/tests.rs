//! The sums against the error's definition, pixel by pixel.

use super::*;
use crate::error::{Error, Result};
use crate::film::Tiles;

/// Numbers in 0…1 without a pattern.
fn number(i: usize, seed: usize) -> f32 {
    ((i + seed * 1_000_003).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f32 / (1u32 << 24) as f32
}

/// A film, a third of it empty, some of its pixels opaque, and some of unknown error.
fn film([width, height]: [usize; 2], count: u32, tiled: bool, stride: usize) -> Film {
    let pixels = width * height;
    let empty = |i: usize| (i / 40).is_multiple_of(3);
    let colour = |i: usize| {
        let alpha = if i.is_multiple_of(5) { 1.0 - 0.01 * number(i, 4) } else { number(i, 5) };
        if empty(i) { [0.0; 4] } else { [number(i, 1), number(i, 2), number(i, 3), alpha] }
    };
    let m2 = (0..pixels).map(|i| if i.is_multiple_of(97) { f32::NAN } else { number(i, 6) });
    let (side, wide) = (16, width.div_ceil(16));
    let counts = (0..wide * height.div_ceil(side)).map(|i| i as u32 % 7).collect();
    let main = Samples {
        width,
        height,
        stride,
        count,
        mean: (0..pixels).flat_map(colour).collect(),
        m2: m2.collect(),
        tiles: tiled.then_some(Tiles { side, wide, counts }),
    };
    Film { size: [width * stride, height * stride], main, noisy: true, opacity_threshold: 0.99, ..Film::default() }
}

/// As it is defined, of some rows: one sum over all would have a rounding error of its own.
fn plain_of(film: &Film, rows: Range<usize>) -> Sums {
    let main = &film.main;
    let mut sums = Sums::default();
    for i in rows.start * main.width..rows.end * main.width {
        let through = 1.0 - f64::from(main.mean[4 * i + 3]);
        sums.luminance += main.luminance(i);
        if through <= 1.0 - film.opacity_threshold {
            sums.truncated += (through.max(0.0) * main.luminance(i)).powi(2);
        }
        let squared = Some(main.squared_error(i)).filter(|e| e.is_finite()).unwrap_or(0.0);
        sums.noise += squared;
        sums.noise_squares += squared * squared;
    }
    if (main.stride > 1 || main.count < 2) && rows.len() == 2 {
        for x in (0..main.width - 1).step_by(2) {
            let at = rows.start * main.width + x;
            let four = [at, at + 1, at + main.width, at + main.width + 1].map(|i| main.luminance(i));
            let mean = four.iter().sum::<f64>() / 4.0;
            sums.blocks += four.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 4.0;
            sums.block_count += 1;
        }
    }
    sums
}

fn plain(film: &Film) -> Sums {
    (0..film.main.height).step_by(2).map(|y| plain_of(film, y..(y + 2).min(film.main.height))).sum()
}

#[test]
fn sums_are_those_of_the_definition() {
    for size in [[1, 1], [1, 700], [700, 1], [37, 41], [301, 203], [640, 400]] {
        for (count, tiled, stride) in [(1, false, 1), (4, false, 1), (5, true, 1), (1, false, 8), (2, false, 8)] {
            let film = film(size, count, tiled, stride);
            let (ours, plain) = (film.sums(), plain(&film));
            let same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
            let numbers =
                |s: &Sums| [s.luminance, s.truncated, s.noise, s.noise_squares, s.blocks, s.block_count as f64];
            let all = numbers(&ours).into_iter().zip(numbers(&plain)).all(|(a, b)| same(a, b));
            assert!(all, "{size:?}, {count} samples: {ours:?}, {plain:?}");
        }
    }
}

#[test]
fn the_error_does_not_depend_on_the_threads() -> Result<()> {
    let film = film([640, 400], 4, false, 1);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(Error::internal)?;
        Ok::<_, Error>(pool.install(|| (film.error(), film.png())))
    };
    let ((error, png), (error_of_four, png_of_four)) = (with(1)?, with(4)?);
    assert_eq!(error, error_of_four);
    let (png, png_of_four) = (png?, png_of_four?);
    assert!(png.0 == png_of_four.0);
    assert_eq!(png.1, error, "a frame's error is the film's");
    Ok(())
}
