//! Random scenes: any view with parameters that it draws itself, on volumes of any type, of any size of picture, with any budget.

use serde_json::{Value, json};

use crate::error::Result;
use crate::study::bench::Bench;
use crate::study::oracle::Random;
use crate::technique::{self, Draw, Technique};
use crate::volume::builtin::BUILTINS;
use crate::volume::{RawQuery, VoxelType, Voxels};

/// The draws until one is a valid request.
const TRIES: u64 = 50;
/// The technique that stands for the planner's choice.
const AUTO: &str = "auto";

/// A scene of the study.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The view whose parameters it has, or `auto`.
    pub technique: &'static str,
    /// The request.
    pub request: Value,
    /// The request without a budget whose picture is the truth. It has no size and no seed yet.
    pub truth: Value,
}

/// The scene of a number. Views take turns, and the planner with them.
///
/// # Errors
/// Those of the store.
pub fn scene(bench: &Bench, number: u64, sizes: &[u32]) -> Result<Option<Scene>> {
    let views: Vec<&Technique> = technique::views().collect();
    let turn = number as usize % (views.len() + 1);
    for attempt in 0..TRIES {
        let mut random = Random::new(0x5eed_0000 + number * TRIES + attempt);
        let view = match views.get(turn) {
            Some(view) => view,
            None => views[(random.unit() * views.len() as f64) as usize],
        };
        let scene = draw(bench, view, turn == views.len(), number, &mut random, sizes)?;
        // The planner's request is one of its view too.
        let mut own = scene.request.clone();
        own["technique"] = scene.truth["technique"].clone();
        if bench.is_valid(&own) && bench.is_valid(&scene.truth) {
            return Ok(Some(scene));
        }
    }
    Ok(None)
}

fn draw(
    bench: &Bench,
    view: &Technique,
    is_planned: bool,
    number: u64,
    random: &mut Random,
    sizes: &[u32],
) -> Result<Scene> {
    let mut unit = || random.unit();
    let (volume, range) = volume(bench, number, &mut unit)?;
    let cases = (view.cases)();
    let mut own = (cases.draw)(&mut Draw::new(&mut unit, range, 2.0));
    let size = |unit: &mut dyn FnMut() -> f64| sizes[(unit() * sizes.len() as f64) as usize];
    let image = json!({"width": size(&mut unit), "height": size(&mut unit)});
    let mut request = json!({"technique": view.name, view.name: own, "volume": volume, "image": image, "seed": number,
        "camera": camera(&mut unit)});
    if unit() < 0.1 {
        request["clip"] =
            json!({"planes": [{"normal": [unit() - 0.5, unit() - 0.5, unit() - 0.5], "point": [0.2 * unit(), 0, 0]}]});
    }
    let mut truth = request.clone();
    if let Some(own) = own.as_object_mut() {
        (cases.truth)(own);
        truth[view.name] = json!(own);
    }
    request["budget"] = budget(&mut unit, is_planned);
    if is_planned {
        request["technique"] = json!(AUTO);
    }
    Ok(Scene { technique: if is_planned { AUTO } else { view.name }, request, truth })
}

/// A camera around the volume, now and then inside of it or without perspective.
fn camera(unit: &mut dyn FnMut() -> f64) -> Value {
    let (turn, height) = (std::f64::consts::TAU * unit(), 2.0 * unit() - 1.0);
    let flat = (1.0 - height * height).sqrt();
    let far = if unit() < 0.1 { 0.3 + 0.7 * unit() } else { 2.0 + 2.0 * unit() };
    let target: [f64; 3] = std::array::from_fn(|_| 0.4 * (unit() - 0.5));
    json!({"eye": [far * flat * turn.cos(), far * height, far * flat * turn.sin()], "target": target, "up": [0.1, 0.2, 1],
        "fov_y_deg": 20.0 + 45.0 * unit(), "projection": if unit() < 0.15 { "orthographic" } else { "perspective" }})
}

/// A number of samples, an error, or a time. The planner needs an error.
fn budget(unit: &mut dyn FnMut() -> f64, is_planned: bool) -> Value {
    let kind = if is_planned { 0.5 } else { unit() };
    let logarithmic = |u: f64, least: f64, most: f64| least * (most / least).powf(u);
    if kind < 0.5 {
        let samples = [1, 2, 3, 4, 6, 8, 16, 24, 32, 64][(unit() * 10.0) as usize];
        json!({ "samples": samples })
    } else if kind < 0.85 {
        json!({"max_error": logarithmic(unit(), 0.01, 0.2)})
    } else {
        json!({"time_ms": logarithmic(unit(), 10.0, 300.0).round()})
    }
}

/// A built-in volume as it is, or its values in another type of voxels, and its range.
fn volume(bench: &Bench, number: u64, unit: &mut dyn FnMut() -> f64) -> Result<(Value, [f64; 2])> {
    let builtin = &BUILTINS[(unit() * BUILTINS.len() as f64) as usize];
    let resolution = [16, 24, 32, 48, 64, 96][(unit() * 6.0) as usize];
    let values = bench.assets().builtin(builtin.name, resolution, number)?;
    let voxel = VoxelType::ALL[(unit() * 4.0) as usize];
    if unit() < 0.5 || voxel == VoxelType::F32 {
        return Ok((json!({"builtin": builtin.name, "resolution": resolution, "seed": number}), values.range()));
    }
    let most = match voxel {
        VoxelType::U8 => f64::from(u8::MAX),
        VoxelType::I16 => f64::from(i16::MAX),
        VoxelType::U16 | VoxelType::F32 => f64::from(u16::MAX),
    };
    let ([low, high], floats) = (values.range(), values.values()?);
    let whole = |i: usize| (most * (floats.of(i) - low) / (high - low).max(f64::MIN_POSITIVE)).round();
    let all = 0..values.voxel_count();
    let voxels = match voxel {
        VoxelType::U8 => Voxels::U8(all.map(|i| whole(i) as u8).collect()),
        VoxelType::I16 => Voxels::I16(all.map(|i| whole(i) as i16).collect()),
        VoxelType::U16 | VoxelType::F32 => Voxels::U16(all.map(|i| whole(i) as u16).collect()),
    };
    let query = RawQuery {
        dims: Some(values.dims().map(|n| n.to_string()).join(",")),
        r#type: Some(format!("{voxel:?}").to_lowercase()),
        spacing: Some(values.spacing().map(|s| s.to_string()).join(",")),
        endian: None,
    };
    let (stored, id, _) = bench.assets().volumes().insert(voxels.as_bytes().to_vec(), "honesty", query.parse()?)?;
    Ok((json!({ "id": id }), stored.range()))
}
