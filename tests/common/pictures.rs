//! The list of requests in `tests/requests/*.json`, and the volumes and the sinogram that it calls `{"test": NAME}`.
//!
//! Every entry has a name of its own. Most are render requests. The others have `calls`, which are sent to a server, one after the other. `./dev
//! compare` sends all of them to two servers, and tests render those that end in a picture.

use std::path::Path;

use cloudchamber::technique;
use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use super::engine::House;

/// The files whose requests do not all end in a picture.
const NO_PICTURES: [&str; 4] = ["calls", "errors", "exports", "plans"];
/// The fields of an entry beside its request.
const ABOUT: [&str; 5] = ["name", "reference", "compare", "changed", "few_steps"];

/// An entry of the list.
pub struct Asked {
    pub name: String,
    /// `reference`, `compare`, `changed` and `few_steps`, if it has them.
    pub about: Value,
    pub request: Value,
}

impl Asked {
    /// Reads an entry. A render request without a size or a budget gets small ones.
    pub fn new(mut entry: Value) -> Self {
        let own = entry.as_object_mut().unwrap();
        let about: Value = ABOUT.iter().filter_map(|key| Some((key.to_string(), own.remove(*key)?))).collect();
        let name = about["name"].as_str().unwrap().to_owned();
        let request = if own.contains_key("calls") { entry } else { small(entry) };
        Self { name, about, request }
    }

    /// The technique that it tests: the one of its field, if it has one.
    pub fn technique(&self) -> &str {
        let field = technique::fields().find(|t| self.request["volume"].get(t.name).is_some());
        field.map_or_else(|| self.request["technique"].as_str().unwrap(), |t| t.name)
    }

    /// True if it needs a volume that only a [`House`] has.
    pub fn needs_house(&self) -> bool {
        self.request.to_string().contains(r#""test":"#)
    }

    /// True if a film of it is committed.
    pub fn is_reference(&self) -> bool {
        self.about["reference"] == true
    }
}

/// The request with a size and a budget. An invalid request stays as it is.
pub fn small(mut request: Value) -> Value {
    if let Some(own) = request.as_object_mut() {
        own.entry("budget").or_insert(json!({"samples": 2}));
        if let Some(image) = own.entry("image").or_insert(json!({})).as_object_mut() {
            image.entry("width").or_insert(json!(48));
            image.entry("height").or_insert(json!(40));
        }
    }
    request
}

/// The entries of a file.
fn entries(file: &Path) -> Vec<Asked> {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let all: Vec<Value> = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    all.into_iter().map(Asked::new).collect()
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/requests"))
}

/// All requests that end in a picture.
pub fn list() -> Vec<Asked> {
    let of_pictures = |file: &String| !NO_PICTURES.contains(&file.as_str());
    everything().into_iter().filter(|(file, _)| of_pictures(file)).map(|(_, asked)| asked).collect()
}

/// Every entry of every file, with the name of its file.
pub fn everything() -> Vec<(String, Asked)> {
    let mut files: Vec<_> = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let named = |file: &std::path::PathBuf| file.file_stem().unwrap().to_string_lossy().into_owned();
    files.iter().flat_map(|file| entries(file).into_iter().map(move |asked| (named(file), asked))).collect()
}

/// A whole number from 0 to 200, smooth from voxel to voxel.
fn wave([x, y, z]: [usize; 3]) -> u8 {
    let [a, b, c] = [x as f64 * 0.31, y as f64 * 0.42, z as f64 * 0.27];
    (90.0 + 55.0 * a.sin() * b.cos() + 45.0 * (c + 0.3 * a).sin()).round() as u8
}

/// The names of the test volumes.
pub const VOLUMES: [&str; 18] = [
    "u8", "i8", "i16", "u16", "f32", "f64", "labels", "labels16", "holes", "nothing", "outliers", "tiny", "negative",
    "long", "needles", "plate", "flat", "falling",
];

/// The name of the test sinogram.
pub const SINOGRAM: &str = "sinogram";

/// The upload of the test sinogram: a NRRD of the counts behind two discs.
pub fn sinogram() -> Vec<u8> {
    let (views, bins) = (45, 48);
    let chord = |u: f64, radius: f64| 2.0 * (radius * radius - u * u).max(0.0).sqrt();
    let count = |i: usize| {
        let (angle, u) = ((i / bins) as f64 * std::f64::consts::PI / views as f64, (i % bins) as f64 - 23.5);
        let small = u - 7.0 * angle.cos() + 4.0 * angle.sin();
        (1000.0 * (-0.03 * chord(u, 18.0) - 0.05 * chord(small, 5.0)).exp()).round() as u16
    };
    let geometry = r#"{"angles_deg": {"to": 180, "count": 45}, "detector": {"count": [48, 1]}}"#;
    let header = format!(
        "NRRD0005\ntype: uint16\ndimension: 2\nsizes: {bins} {views}\nendian: little\nencoding: raw\n\
         geometry:={geometry}\nquantity:=counts\nphotons_per_ray:=1000\n\n"
    );
    header.into_bytes().into_iter().chain((0..views * bins).flat_map(|i| count(i).to_le_bytes())).collect()
}

/// The upload of a test volume: its bytes, and the way to read them, if they do not tell it themselves.
pub fn upload(name: &str) -> (Vec<u8>, RawQuery) {
    let dims @ [wide, high, deep] = if name == "plate" { [24, 20, 1] } else { [24, 20, 22] };
    let places = (0..wide * high * deep).map(|i| [i % wide, i / wide % high, i / (wide * high)]);
    let values = places.clone().map(wave);
    let parts = values.clone().map(|v| f32::from(v) / 200.0);
    let floats = |of: &dyn Fn((usize, f32)) -> f32| -> Vec<u8> {
        parts.clone().enumerate().flat_map(|part| of(part).to_le_bytes()).collect()
    };
    let labels = places.map(|[x, y, z]| ((x / 8 + y / 7 + z / 6) % 3) as u8);
    let (bytes, of) = match name {
        "u8" | "long" | "needles" | "plate" => (values.collect(), "u8"),
        "i8" => (values.map(|v| v.wrapping_sub(100)).collect(), "i8"),
        "i16" => (values.flat_map(|v| (i16::from(v) * 10 - 1000).to_le_bytes()).collect(), "i16"),
        "u16" => (values.flat_map(|v| (u16::from(v) * 300).to_le_bytes()).collect(), "u16"),
        "f32" => (floats(&|(_, v)| v), "f32"),
        "f64" => (values.flat_map(|v| (f64::from(v) / 300.0).to_le_bytes()).collect(), "f64"),
        "labels" => (labels.collect(), "u8"),
        "labels16" => (labels.flat_map(|v| (u16::from(v) * 150).to_le_bytes()).collect(), "u16"),
        "holes" => (floats(&|(at, v)| if at % 97 == 0 { f32::NAN } else { v }), "f32"),
        "nothing" => (floats(&|_| f32::NAN), "f32"),
        "outliers" => (floats(&|(at, v)| if at % 2003 == 7 { 1e6 } else { v }), "f32"),
        "tiny" => (floats(&|(_, v)| v * 1e-30), "f32"),
        "negative" => (floats(&|(_, v)| v - 0.3), "f32"),
        "flat" => (vec![2; wide * high * deep], "u8"),
        "falling" => return (nifti(dims, values), RawQuery::default()),
        _ => panic!("there is no test volume {name}"),
    };
    let spacing = match name {
        "long" => "0.05,0.1,0.2",
        "needles" => "0.0001,0.1,0.1",
        _ => "0.1,0.1,0.09",
    };
    let text = |words: &str| Some(words.to_owned());
    let dims = Some(dims.map(|n| n.to_string()).join(","));
    (bytes, RawQuery { dims, r#type: text(of), spacing: text(spacing), endian: None })
}

/// A NIfTI file of bytes: value = 100 − 2 · voxel, and a quarter of the second axis along the first.
fn nifti(dims: [usize; 3], voxels: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut file = vec![0; 352];
    let mut put = |at: usize, bytes: &[u8]| file[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    let sizes = [3, dims[0] as i16, dims[1] as i16, dims[2] as i16, 1, 1, 1, 1];
    put(40, bytemuck::cast_slice(&sizes));
    put(70, bytemuck::cast_slice(&[2i16, 8]));
    put(76, bytemuck::cast_slice(&[1.0f32, 0.1, 0.1, 0.09, 1.0, 1.0, 1.0, 1.0, 352.0, -2.0, 100.0]));
    put(254, &1i16.to_le_bytes());
    put(280, bytemuck::cast_slice(&[0.1f32, 0.025, 0.0, 5.0, 0.0, 0.1, 0.0, 6.0, 0.0, 0.0, 0.09, 7.0]));
    put(344, b"n+1\0");
    file.extend(voxels);
    file
}

/// The request with ids in place of test volumes, wherever they stand in it.
pub fn with_ids(request: &Value, id: &dyn Fn(&str) -> String) -> Value {
    match request {
        // A test volume may have other fields beside it, such as a level.
        Value::Object(fields) => fields
            .iter()
            .map(|(k, v)| match (k.as_str(), v) {
                ("test", Value::String(name)) => ("id".to_owned(), json!(id(name))),
                _ => (k.clone(), with_ids(v, id)),
            })
            .collect(),
        Value::Array(items) => items.iter().map(|v| with_ids(v, id)).collect(),
        other => other.clone(),
    }
}

/// The request with the ids that test volumes have in a house.
pub fn with_volumes(request: &Value, house: &House) -> Value {
    with_ids(request, &|name| {
        if name == SINOGRAM {
            return house.assets().sinograms().insert(sinogram(), name, None).unwrap().1;
        }
        let (bytes, query) = upload(name);
        house.assets().volumes().insert(bytes, name, query.parse().unwrap()).unwrap().1
    })
}
