//! Scenes that scatter light, and the tests of their films.

use std::sync::Arc;

use cloudchamber::film::Film;
use serde_json::{Value, json};

use super::engine::House;

/// A camera far away that looks along `-from` through parallel rays at a spot of the size `wide`.
pub fn spot(from: [f64; 3], wide: f64) -> Value {
    spot_at(from, [0.0; 3], wide)
}

/// The same camera, with a spot at a place.
pub fn spot_at(from: [f64; 3], target: [f64; 3], wide: f64) -> Value {
    let length = from.iter().map(|v| v * v).sum::<f64>().sqrt();
    // The camera is as near as the narrowest angle of view permits.
    let away = (570.0 * wide).min(50.0);
    assert!(away > 3.9, "a spot of {wide} is too small");
    let eye: Vec<f64> = (0..3).map(|i| target[i] + away * from[i] / length).collect();
    let up = if from[1].abs() > 0.9 * length { [1, 0, 0] } else { [0, 1, 0] };
    let fov = 2.0 * (0.5 * wide / away).atan().to_degrees();
    json!({"eye": eye, "target": target, "up": up, "fov_y_deg": fov, "projection": "orthographic"})
}

/// A render request of a scattering view.
pub fn scene(technique: &str, volume: &Value, camera: &Value, own: &Value, side: u32, samples: u32) -> Value {
    json!({"technique": technique, "volume": volume, "camera": camera, technique: own,
        "image": {"width": side, "height": side}, "budget": {"samples": samples}})
}

/// A film of a house.
pub fn film(house: &House, request: &Value) -> Arc<Film> {
    house.film(request).0
}

fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

/// The mean luminance over all pixels, and its standard error by the spread of the pixels. All pixels must see the same.
pub fn mean(film: &Film) -> (f64, f64) {
    mean_by(film, luminance)
}

/// The mean of one channel (3: alpha) over all pixels, and its standard error.
pub fn channel(film: &Film, c: usize) -> (f64, f64) {
    mean_by(film, |p| f64::from(p[c]))
}

fn mean_by(film: &Film, value: impl Fn(&[f32]) -> f64) -> (f64, f64) {
    let values: Vec<f64> = film.main.mean.chunks_exact(4).map(value).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Fails unless (mean, standard error) is within 3.5 standard errors of a truth that is itself known to `known_to`.
pub fn agrees((mean, error): (f64, f64), truth: f64, known_to: f64, what: &str) {
    let z = ((mean - truth).abs() - known_to).max(0.0) / error.max(1e-12);
    println!("{what}: {mean:.6} ± {error:.6}, truth {truth:.6}, z {z:.2}");
    assert!(z <= 3.5, "{what}: {mean} ± {error}, truth {truth}, z {z}");
    assert!(error < 0.02 * truth.abs().max(0.05), "{what}: ± {error} proves little");
}

/// Fails unless two means are within 3.5 standard errors of each other.
pub fn agree(a: (f64, f64), b: (f64, f64), what: &str) {
    let error = a.1.hypot(b.1);
    println!("{what}: {:.6} ± {:.6}, {:.6} ± {:.6}, z {:.2}", a.0, a.1, b.0, b.1, (a.0 - b.0) / error);
    assert!((a.0 - b.0).abs() <= 3.5 * error.max(1e-9), "{what}: {a:?} and {b:?}");
}

/// The sum of all pixels' luminance, and its variance.
pub fn total(f: &Film) -> (f64, f64) {
    let n = f64::from(f.main.count);
    let sum = f.main.mean.chunks_exact(4).map(luminance).sum();
    (sum, f.main.m2.iter().map(|m2| f64::from(*m2) / (n - 1.0) / n).sum())
}

/// The z of every pixel's luminance between two films. It is 0 for pixels without variance that are the same.
pub fn pixel_z(a: &Film, b: &Film) -> Vec<f64> {
    let variance = |f: &Film, i: usize| {
        let n = f64::from(f.main.count);
        f64::from(f.main.m2[i]) / (n - 1.0) / n
    };
    let pixels = a.main.m2.len();
    (0..pixels)
        .map(|i| {
            let difference = luminance(&a.main.mean[4 * i..]) - luminance(&b.main.mean[4 * i..]);
            let error = (variance(a, i) + variance(b, i)).sqrt();
            if difference.abs() < 1e-5 { 0.0 } else { difference / error.max(1e-12) }
        })
        .collect()
}

/// Fails unless two films are of the same picture. No more pixels than one in 400 may be beyond the two-sided 1 % level, corrected for their number
/// by Šidák, the means must be the same, and the mean of z² must be no more than noise. (The mean of z itself is not 0: if samples are skewed,
/// pixels that happen to be dark also happen to look certain.)
pub fn same_picture(a: &Film, b: &Film, what: &str) {
    let z = pixel_z(a, b);
    let n = z.len() as f64;
    // The level of one of n tests: 1 − (1 − 0.01)^(1/n).
    let level = -(0.99f64.ln() / n).exp_m1();
    let beyond = z.iter().filter(|z| two_sided(z.abs()) < level).count() as f64;
    let (ours, theirs) = (total(a), total(b));
    let mean = (ours.0 - theirs.0) / (ours.1 + theirs.1).sqrt().max(1e-9);
    let square = z.iter().map(|z| z * z).sum::<f64>() / n;
    println!("{what}: {beyond} of {n} pixels beyond, z of the mean {mean:.4}, mean z² {square:.3}");
    assert!(beyond <= 0.0025 * n, "{what}: {beyond} of {n} pixels differ");
    assert!(mean.abs() <= 3.5, "{what}: z of the mean is {mean}");
    assert!(square < 1.15, "{what}: the mean of z² is {square}");
}

/// The probability that noise is beyond ±z. Abramowitz & Stegun 7.1.26 is not good enough in the tail, so this is a continued fraction.
fn two_sided(z: f64) -> f64 {
    if z < 2.0 {
        return 1.0;
    }
    let fraction = (1..60).rev().fold(z, |below, k| z + f64::from(k) / below);
    2.0 * (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt() / fraction
}
