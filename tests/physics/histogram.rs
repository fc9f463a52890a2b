//! `histogram` against counts in double precision, a closed form, and the values that are counted apart.

use cloudchamber::error::Error;
use cloudchamber::job::State;
use cloudchamber::render::ExportTask;
use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use crate::common::engine::House;

/// The rows of a histogram's table, and its result.
fn table(request: &Value) -> (Vec<[f64; 4]>, Value) {
    let job = House::shared().export(request);
    assert_eq!(job.state(), State::Done);
    let file = job.file().unwrap();
    assert_eq!((file.media_type, file.extension), ("text/csv", "csv"));
    let text = String::from_utf8(file.bytes.to_vec()).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("from,to,voxels,part_at_least"));
    let row = |line: &str| line.split(',').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>().try_into().unwrap();
    (lines.map(row).collect(), job.resource()["result"].clone())
}

fn of(volume: &Value, own: Value) -> (Vec<[f64; 4]>, Value) {
    table(&json!({"technique": "histogram", "volume": volume, "histogram": own}))
}

/// A raw volume of words with a value for each voxel.
fn words(dims: [usize; 3], value: impl Fn(usize) -> i16) -> Value {
    let count = dims.iter().product::<usize>();
    let bytes = (0..count).flat_map(|i| value(i).to_le_bytes()).collect();
    let query = RawQuery {
        dims: Some(dims.map(|n| n.to_string()).join(",")),
        r#type: Some("i16".into()),
        spacing: None,
        endian: None,
    };
    json!({"id": House::shared().assets().volumes().insert(bytes, "words", query.parse().unwrap()).unwrap().1})
}

#[test]
fn each_value_is_in_its_bin_and_no_other() {
    // The values are 0 to 99, each as often as it is the last two digits of 31 i. Bins have one value each, in their middles.
    let value = |i: usize| (i * 31 % 100) as i16;
    let dims = [20, 30, 41];
    let (rows, result) = of(&words(dims, value), json!({"bins": 100, "range": [-0.5, 99.5]}));
    let count = dims.iter().product::<usize>();
    let mut at_least = count;
    for (bin, [from, to, voxels, part]) in rows.iter().enumerate() {
        let expected = (0..count).filter(|i| value(*i) as usize == bin).count();
        assert_eq!((*from, *to, *voxels as usize), (bin as f64 - 0.5, bin as f64 + 0.5, expected));
        assert!((part - at_least as f64 / count as f64).abs() < 1e-12, "{bin}: {part}");
        at_least -= expected;
    }
    assert_eq!((rows.len(), at_least), (100, 0));
    assert_eq!(result["voxels"], count);
}

#[test]
fn what_is_outside_and_what_is_no_number_is_counted_apart() {
    let house = House::shared();
    let volume = house.floats([10, 10, 10], |x, y, _| if x > 0.0 && y > 0.0 { f64::NAN } else { x });
    // x is −0.9, −0.7 … 0.9. Of the 750 finite voxels 500 are below 0.
    let (rows, result) = of(&volume, json!({"bins": 2, "range": [-0.4, 0.0]}));
    let voxels: Vec<f64> = rows.iter().map(|row| row[2]).collect();
    assert_eq!(voxels, [100.0, 100.0], "−0.3 and −0.1");
    let others = ["below", "above", "not_a_number"].map(|name| result[name].as_u64().unwrap());
    assert_eq!(others, [300, 250, 250]);
    let parts: Vec<f64> = rows.iter().map(|row| row[3]).collect();
    assert_eq!(parts, [450.0 / 750.0, 350.0 / 750.0], "the voxels above count, and those without a value do not");
    let (rows, _) = of(&json!({"builtin": "constant", "resolution": 8}), json!({"bins": 3}));
    assert_eq!(rows.iter().map(|row| row[2]).collect::<Vec<_>>(), [0.0, 512.0, 0.0], "all have one value");
}

#[test]
fn a_gaussians_levels_are_spheres() {
    // exp(−r²/2s²) is at least v within r = s √(−2 ln v). The count is the part of the box inside, to a voxel's surface.
    let house = House::shared();
    let s = 0.3;
    let volume = house.floats([96; 3], |x, y, z| (-(x * x + y * y + z * z) / (2.0 * s * s)).exp());
    let (rows, _) = of(&volume, json!({"bins": 10, "range": [0.0, 1.0]}));
    for [from, _, _, part] in &rows[1..] {
        let r = s * (-2.0 * from.ln()).sqrt();
        let inside = 4.0 / 3.0 * std::f64::consts::PI * r.powi(3) / 8.0;
        let surface = 4.0 * std::f64::consts::PI * r * r / 8.0 * (2.0 / 96.0);
        assert!((part - inside).abs() < 0.2 * surface, "at {from}: {part}, {inside} ± {surface}");
    }
}

#[test]
fn values_that_fall_as_voxels_rise_are_in_the_bins_of_their_values() {
    // The scale of the NIfTI file is 100 − 2 · voxel.
    let house = House::shared();
    let (bytes, query) = crate::common::pictures::upload("falling");
    let (volume, id, _) = house.assets().volumes().insert(bytes, "falling", query.parse().unwrap()).unwrap();
    let (rows, _) = of(&json!({"id": id}), json!({"bins": 4}));
    let [low, high] = volume.range();
    assert!((rows[0][0] - low).abs() < 1e-9 && (rows[3][1] - high).abs() < 1e-9);
    let [nx, ny, nz] = volume.dims();
    let mut expected = [0.0; 4];
    for z in 0..nz {
        for (x, y) in (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))) {
            let place = (volume.values().unwrap().at(x, y, z) - low) / (high - low) * 4.0;
            expected[(place as usize).min(3)] += 1.0;
        }
    }
    // A value on an edge may be on either side.
    let apart: f64 = rows.iter().zip(expected).map(|(row, n)| (row[2] - n).abs()).sum();
    assert!(apart <= 0.02 * (nx * ny * nz) as f64, "{rows:?} {expected:?}");
}

#[test]
fn bins_that_single_precision_cannot_tell_apart_are_refused_or_warned_of() {
    let job = House::shared()
        .export(&json!({"technique": "histogram", "volume": {"builtin": "gaussian", "resolution": 16},
        "histogram": {"bins": 65536, "range": [0.999, 1.0]}}));
    let resource = job.resource();
    for warnings in [&resource["warnings"], &resource["result"]["warnings"]] {
        assert_eq!(warnings[0]["code"], "narrow_bins", "{resource}");
    }
    let house = House::shared();
    let volume = house.floats([4; 3], |x, _, _| x);
    let narrow = json!({"technique": "histogram", "volume": volume, "histogram": {"range": [0, 1e-45]}});
    let refused = ExportTask::from_json(&narrow, house.assets(), house.service.limits());
    assert!(matches!(refused, Err(Error::Invalid(v)) if v[0].pointer == "/histogram/range"));
}

#[test]
fn a_simulations_grid_is_counted_once_it_is_complete() {
    let field = json!({"photon_transport": {"photons": 20_000, "grid": [16, 16, 16]}});
    let (rows, result) = of(&field, json!({"bins": 8}));
    assert_eq!(rows.iter().map(|row| row[2]).sum::<f64>(), 4096.0);
    assert_eq!((rows[0][3], result["voxels"].as_u64()), (1.0, Some(4096)));
}
