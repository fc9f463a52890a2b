//! A cloud under a sun and a sky, of voxels with walls, so that the host can follow a path exactly.

use glam::dvec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::oracle::{Eye, Grid, Light, Medium, means};
use crate::study::{Case, Scale, Setting, Trial, Truth, view};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "cloud",
    title: "A cloud under a sun and a sky, by every tracker",
    when: "a cloud, and want a picture",
    choose: "`volume_path` as it is (delta tracking); `exact` if voxels are meant to have walls",
    trial,
};

const SIGMA: f64 = 12.0;
const ALBEDO: f64 = 0.95;
const G: f64 = 0.6;
const SIDE: usize = 64;
/// The pixels a side of a compared block. The host has means of blocks.
const BLOCK: usize = 8;
const RESOLUTION: usize = 32;

fn trial(bench: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let eye = Eye { eye: dvec3(0.9, 0.35, -1.6), wide: 2.2 };
    let light = Light { to_sun: dvec3(1.0, 0.6, 0.4).normalize(), irradiance: 5.0, sky: 0.3 };
    let lights = json!([{"type": "sun", "direction": light.to_sun.to_array(), "irradiance": light.irradiance},
        {"type": "sky", "radiance": light.sky}]);
    let most = scale.pick(64, 1024);
    let volume = json!({"builtin": "smoke", "resolution": RESOLUTION});
    let mut settings = Vec::new();
    let own = |tracking: &str, more: &Value| {
        let mut own = json!({"medium": {"sigma_t_per_unit": SIGMA, "albedo": ALBEDO, "phase": {"type": "henyey_greenstein", "g": G}},
            "interpolation": "nearest", "tracking": tracking, "lights": lights});
        for (key, value) in more.as_object().into_iter().flatten() {
            own[key] = value.clone();
        }
        own
    };
    let none = json!({});
    for (line, technique, own, slope) in [
        ("volume_path, exact", "volume_path", own("exact", &none), Some(-0.5)),
        ("volume_path, delta", "volume_path", own("delta", &none), Some(-0.5)),
        ("volume_path, weighted", "volume_path", own("weighted", &none), Some(-0.5)),
        ("volume_path, march of a voxel", "volume_path", own("march", &none), None),
        ("volume_path, at most 4 scatterings", "volume_path", own("auto", &json!({"max_scatterings": 4})), None),
        ("single_scatter", "single_scatter", own("auto", &none), None),
    ] {
        for samples in [1, 4, 16, 64, 256, 1024].into_iter().filter(|n| *n <= most) {
            let request = view(technique, &volume, &eye.json(), SIDE, samples, &own);
            let setting = Setting::random(line, "samples", samples as f64, request).reading(Reads::Blocks(BLOCK));
            settings.push(Setting { expected_slope: slope, ..setting });
        }
    }
    let paths = scale.pick(20_000, 400_000);
    let (values, known_to) = truth(bench, eye, &light, paths)?;
    let truth = Truth {
        words: format!(
            "{paths} paths of the host in double precision for each of {} blocks of pixels, from cell to cell",
            values.len()
        ),
        values,
        centres: None,
        size: None,
        known_to,
    };
    Ok(Ok(Trial { truth, settings }))
}

/// The means of the blocks, and their relative standard error.
fn truth(bench: &Bench, eye: Eye, light: &Light, paths: usize) -> Result<(Vec<f64>, f64)> {
    let density = Grid::of_volume(&*bench.assets().builtin("smoke", RESOLUTION, 0)?)?;
    let medium = Medium { extinction: density.scaled(SIGMA), albedo: ALBEDO, g: G };
    let wide = SIDE / BLOCK;
    let block = |block: usize| {
        let [found] = means(paths, block as u64, |random| {
            let (x, y) = ((block % wide) as f64 + random.unit(), (block / wide) as f64 + random.unit());
            [medium.radiance(light, random, eye.origin(x / wide as f64, y / wide as f64), eye.forward())]
        });
        found
    };
    let found: Vec<[f64; 2]> = (0..wide * wide).into_par_iter().map(block).collect();
    let mean = found.iter().map(|f| f[0]).sum::<f64>() / found.len() as f64;
    let error = (found.iter().map(|f| f[1].powi(2)).sum::<f64>() / found.len() as f64).sqrt();
    Ok((found.iter().map(|f| f[0]).collect(), error / mean))
}
