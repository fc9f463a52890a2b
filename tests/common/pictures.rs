//! The list of pictures in `tests/pictures/requests.json`: small requests of all techniques, voxel types and interpolations.

use cloudchamber::volume::RawQuery;
use serde_json::{Value, json};

use super::engine::House;

/// Voxels along x, y, z of the volumes that the list calls `{"test": NAME}`.
const DIMS: [usize; 3] = [24, 20, 22];

/// One of the list.
pub struct Asked {
    pub name: String,
    pub request: Value,
}

impl Asked {
    /// The technique that it is there for: the one of its field, where it has one.
    pub fn technique(&self) -> &str {
        let is_field = self.request["volume"].get("photon_transport").is_some();
        if is_field { "photon_transport" } else { self.request["technique"].as_str().unwrap() }
    }

    /// Whether it needs a volume that only a [`House`] has.
    pub fn needs_house(&self) -> bool {
        self.request.to_string().contains(r#"{"test":"#)
    }
}

/// The whole list, with a size and a budget where it gives none.
pub fn list() -> Vec<Asked> {
    let all: Vec<Value> = serde_json::from_str(include_str!("../pictures/requests.json")).unwrap();
    let asked = |mut request: Value| {
        let own = request.as_object_mut().unwrap();
        let name = own.remove("name").unwrap().as_str().unwrap().to_owned();
        own.entry("budget").or_insert(json!({"samples": 2}));
        let image = own.entry("image").or_insert(json!({})).as_object_mut().unwrap();
        image.insert("width".into(), json!(48));
        image.insert("height".into(), json!(40));
        Asked { name, request }
    };
    all.into_iter().map(asked).collect()
}

/// A whole number from 0 to 200, smooth from voxel to voxel.
fn wave(x: usize, y: usize, z: usize) -> u8 {
    let [a, b, c] = [x as f64 * 0.31, y as f64 * 0.42, z as f64 * 0.27];
    (90.0 + 55.0 * a.sin() * b.cos() + 45.0 * (c + 0.3 * a).sin()).round() as u8
}

/// The bytes of a test volume and the type of its voxels.
fn voxels(name: &str) -> (Vec<u8>, &'static str) {
    let [wide, high, deep] = DIMS;
    let places = (0..wide * high * deep).map(|i| [i % wide, i / wide % high, i / (wide * high)]);
    let values = places.clone().map(|[x, y, z]| wave(x, y, z));
    let holes = |(at, value): (usize, u8)| if at % 97 == 0 { f32::NAN } else { f32::from(value) / 200.0 };
    match name {
        "u8" => (values.collect(), "u8"),
        "i16" => (values.flat_map(|v| (i16::from(v) * 10 - 1000).to_le_bytes()).collect(), "i16"),
        "u16" => (values.flat_map(|v| (u16::from(v) * 300).to_le_bytes()).collect(), "u16"),
        "f32" => (values.flat_map(|v| (f32::from(v) / 200.0).to_le_bytes()).collect(), "f32"),
        "holes" => (values.enumerate().flat_map(|v| holes(v).to_le_bytes()).collect(), "f32"),
        "labels" => (places.map(|[x, y, z]| ((x / 8 + y / 7 + z / 6) % 3) as u8).collect(), "u8"),
        _ => panic!("there is no test volume {name}"),
    }
}

/// The request with ids in place of test volumes, wherever they stand in it.
pub fn with_volumes(request: &Value, house: &House) -> Value {
    if let Some(name) = request.get("test").and_then(Value::as_str) {
        let (bytes, of) = voxels(name);
        let query = RawQuery {
            dims: Some(DIMS.map(|n| n.to_string()).join(",")),
            r#type: Some(of.into()),
            spacing: Some("0.1,0.1,0.09".into()),
            endian: None,
        };
        return json!({"id": house.store.insert(bytes, name, query.parse().unwrap()).unwrap().1});
    }
    match request {
        Value::Object(fields) => fields.iter().map(|(k, v)| (k.clone(), with_volumes(v, house))).collect(),
        Value::Array(items) => items.iter().map(|v| with_volumes(v, house)).collect(),
        other => other.clone(),
    }
}
