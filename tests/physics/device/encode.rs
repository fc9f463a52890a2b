//! Films developed on the device against the definitions, pixel by pixel in double precision.

use cloudchamber::device::Buffer;
use cloudchamber::device::Device;
use cloudchamber::device::encode::{EncodeSettings, Encoder, PADDING, Set, curve};
use cloudchamber::film::picture::Background;
use cloudchamber::film::{Samples, Sums, Tiles};

/// Numbers in 0…1 without a pattern.
fn number(i: usize, seed: usize) -> f32 {
    ((i + seed * 1_000_003).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f32 / (1u32 << 24) as f32
}

/// A film of which a third is empty, some pixels are opaque, some too bright, and some of unknown error.
fn film([width, height]: [usize; 2], count: u32, tiled: bool, stride: usize, unit: f32) -> Samples {
    let pixels = width * height;
    let colour = |i: usize| {
        let alpha = if i.is_multiple_of(5) { 1.0 - 0.01 * number(i, 4) } else { number(i, 5) };
        if (i / 40).is_multiple_of(3) {
            return [0.0; 4];
        }
        [1.2 * number(i, 1) * unit, 1.2 * number(i, 2) * unit, 1.2 * number(i, 3) * unit, alpha]
    };
    let m2 = (0..pixels).map(|i| if i.is_multiple_of(97) { f32::NAN } else { number(i, 6) * unit * unit });
    let (side, wide) = (16, width.div_ceil(16));
    let counts = (0..wide * height.div_ceil(side)).map(|i| i as u32 % 7).collect();
    let (mean, m2) = ((0..pixels).flat_map(colour).collect(), m2.collect());
    Samples { width, height, stride, count, mean, m2, tiles: tiled.then_some(Tiles { side, wide, counts }) }
}

fn upload(device: &Device, samples: &Samples) -> Buffer {
    let all = [bytemuck::cast_slice(&samples.mean), bytemuck::cast_slice(&samples.m2)].concat();
    device.upload(&all, PADDING).unwrap()
}

fn count_at(samples: &Samples, i: usize) -> f64 {
    let count = samples.tiles.as_ref().map_or(samples.count, |t| t.count_at(i % samples.width, i / samples.width));
    f64::from(count)
}

/// The sums by their definitions, of the film alone.
fn plain(film: &Samples, threshold: f64, lanes: usize) -> Sums {
    let mut sums = Sums { block_count: (film.width / 2) * (film.height / 2), ..Sums::default() };
    for i in 0..film.pixels() {
        let (luminance, n) = (film.luminance(i), count_at(film, i));
        let through = 1.0 - f64::from(film.mean[4 * i + 3]);
        sums.luminance += luminance;
        sums.weighted += n * luminance;
        if through <= 1.0 - threshold {
            sums.truncated += (through.max(0.0) * luminance).powi(2);
        }
        let m2 = f64::from(film.m2[i]);
        sums.unknown += u64::from(!m2.is_finite());
        if n > 1.0 && m2.is_finite() {
            let squared = m2 / (n * (n - 1.0));
            sums.noise += squared;
            sums.noise_squares += squared * squared;
        }
    }
    for y in (0..film.height - 1).step_by(2) {
        for x in (0..film.width - 1).step_by(2) {
            let at = y * film.width + x;
            let four = [at, at + 1, at + film.width, at + film.width + 1].map(|i| film.luminance(i));
            let mean = four.iter().sum::<f64>() / 4.0;
            let block = four.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / 4.0;
            sums.blocks += block;
            sums.block_squares += block * block;
        }
    }
    // All pixels but the last of a packet, or of 32 pixels one by one, have a neighbour at hand.
    let part = if lanes == 1 { 32 } else { lanes };
    for i in 0..film.pixels() {
        let x = i % film.width;
        if x % 2 == 1 && x % part + 1 < part && x + 1 < film.width {
            sums.between += (film.luminance(i) - 0.5 * (film.luminance(i - 1) + film.luminance(i + 1))).powi(2);
            sums.pixels_between += 1;
        }
        // Every second row of a film that is interpolated lies between two others.
        let (y, wide) = (i / film.width, film.width);
        if film.stride > 1 && y % 2 == 1 && y + 1 < film.height {
            sums.between += (film.luminance(i) - 0.5 * (film.luminance(i - wide) + film.luminance(i + wide))).powi(2);
            sums.pixels_between += 1;
        }
    }
    sums
}

/// Linear to sRGB (IEC 61966-2-1), not rounded.
fn srgb(v: f64) -> f64 {
    let v = v.clamp(0.0, 1.0);
    255.0 * if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// The picture's values before they are rounded to bytes, and the number of those above white.
fn plain_picture(film: &Samples, size: [usize; 2], background: Background) -> (Vec<f64>, u64) {
    let (mut values, mut clipped) = (Vec::new(), 0);
    let place = |full: usize, n: usize| {
        let at = (full as f64 / film.stride as f64).min((n - 1) as f64);
        (at.floor() as usize, (at.floor() as usize + 1).min(n - 1), at.fract())
    };
    for y in 0..size[1] {
        for x in 0..size[0] {
            let ((x0, x1, fx), (y0, y1, fy)) = (place(x, film.width), place(y, film.height));
            let value = |c: usize| {
                let at = |x: usize, y: usize| f64::from(film.mean[4 * (y * film.width + x) + c]);
                (1.0 - fy) * ((1.0 - fx) * at(x0, y0) + fx * at(x1, y0))
                    + fy * ((1.0 - fx) * at(x0, y1) + fx * at(x1, y1))
            };
            let alpha = value(3);
            let colour: [f64; 3] = std::array::from_fn(|c| match background {
                Background::Colour(behind) => value(c) + (1.0 - alpha) * f64::from(behind[c]),
                Background::Transparent => value(c) * if alpha > 0.0 { 1.0 / alpha } else { 0.0 },
            });
            clipped += colour.iter().filter(|v| **v > 1.0).count() as u64;
            values.extend(colour.map(srgb));
            if background == Background::Transparent {
                values.push(255.0 * alpha.clamp(0.0, 1.0));
            }
        }
    }
    (values, clipped)
}

/// All sums as numbers.
fn numbers(s: &Sums) -> Vec<f64> {
    let own = [s.luminance, s.weighted, s.truncated, s.noise, s.noise_squares, s.blocks, s.block_squares, s.between];
    let counts = [s.block_count, s.pixels_between as usize, s.unknown as usize].map(|n| n as f64);
    own.into_iter().chain(counts).collect()
}

/// Develops a film and compares all results.
fn check(device: &mut Device, film: &Samples, background: Background) {
    let size = [film.width * film.stride, film.height * film.stride];
    let curve = curve(device).unwrap();
    let mut encoder = Encoder::new(device, &curve, size, background, None).unwrap();
    let main = upload(device, film);
    let look = EncodeSettings { size, background, opacity_threshold: 0.99, deviations: true };
    let sums = encoder.encode(device, Set { buffer: &main, samples: film }, &look).unwrap();
    let picture = encoder.picture(device).unwrap();
    let (values, clipped) = plain_picture(film, size, background);
    let expected = plain(film, 0.99, device.info().lanes as usize);
    let said = format!("{} lanes, {size:?}, {} samples, stride {}", device.info().lanes, film.count, film.stride);
    for (i, (ours, plain)) in numbers(&sums).into_iter().zip(numbers(&expected)).enumerate() {
        assert!((ours - plain).abs() <= 2e-6 * plain.abs(), "{said}, sum {i}: {ours:e}, {plain:e}");
    }
    // A value that is white to the last digit may be counted or not.
    assert!(sums.clipped.abs_diff(clipped) <= 1 + clipped / 10_000, "{said}: {} clipped, {clipped}", sums.clipped);
    assert_eq!(picture.len(), values.len(), "{said}");
    let furthest = picture.iter().zip(&values).map(|(b, v)| (f64::from(*b) - v).abs()).fold(0.0, f64::max);
    // The bound is half a step of the bytes, and of the table's where the curve is steepest: 12.92 · 255 / 65535 / 2.
    assert!(furthest <= 0.5 + 0.026, "{said}: {furthest}");
}

#[test]
fn films_are_developed_as_they_are_defined() {
    for lanes in [None, Some(1), Some(4), Some(8), Some(16)] {
        let mut device = super::open(lanes, None);
        for size in [[1, 1], [1, 70], [130, 1], [37, 41], [301, 203]] {
            for (count, tiled) in [(1, false), (4, false), (5, true)] {
                let whole = film(size, count, tiled, 1, 1.0);
                let behind = Background::Colour([0.3, 0.0, 0.01]);
                check(&mut device, &whole, behind);
                check(&mut device, &whole, Background::Transparent);
            }
            if size[0] < 200 {
                check(&mut device, &film(size, 2, false, 8, 1.0), Background::default());
            }
        }
    }
}

#[test]
fn small_squares_are_not_lost_below_the_least_float() {
    let mut device = super::open(None, None);
    // Luminances of 1e-19 have squares that floats cannot hold, and fourth powers that doubles just can.
    let dark = film([64, 48], 4, false, 1, 1e-19);
    let dark = Samples { m2: dark.mean.chunks(4).map(|p| 1e-36 * (1.0 + p[0])).collect(), ..dark };
    check(&mut device, &dark, Background::default());
}
