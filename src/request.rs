//! Wire types: what a client may send, as JSON Schema and serde see it. No defaults are resolved here and nothing is read.
//!
//! A body is checked against the very schema that is served (`schema`), so what the documentation permits and what the
//! server permits cannot drift apart; what a schema cannot say is checked when the [`crate::render::Scene`] is made.

use std::sync::{Arc, Mutex, PoisonError};

use jsonschema::error::{TypeKind, ValidationErrorKind};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use crate::error::{Error, Result, Violation};

/// The largest whole number that every JSON reader carries exactly: 2^53 - 1.
pub const LARGEST_WHOLE: i64 = 9_007_199_254_740_991;

/// The body of `POST /v1/renders`, less the techniques' own parameters.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
pub struct RenderRequest {
    /// The view technique that makes the picture.
    pub technique: String,
    /// What is looked at: an uploaded volume, a built-in one, or a field technique's name with its parameters. Default: the built-in `smoke`.
    pub volume: Option<VolumeRequest>,
    /// Default: one that frames the volume.
    pub camera: Option<CameraRequest>,
    /// Size of the picture.
    pub image: Option<ImageRequest>,
    /// What of the volume is shown. Default: all.
    pub clip: Option<ClipRequest>,
    /// When to stop: whichever is reached first. Default: the technique's own number of samples.
    pub budget: Option<BudgetRequest>,
    /// What the volume is made of, for techniques that scatter light: in place of their own `medium`, so that one scene serves them all.
    pub medium: Option<Value>,
    /// The lights of such a technique, in place of its own `lights`.
    pub lights: Option<Value>,
    /// Keys every random number of the render.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    pub seed: Option<u64>,
    /// The techniques' own parameters, by technique.
    #[serde(flatten)]
    #[schemars(skip)]
    pub parameters: Map<String, Value>,
}

/// What is looked at: exactly one of `id`, `builtin`, or the name of a field technique.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
pub struct VolumeRequest {
    /// The id of an uploaded volume.
    pub id: Option<String>,
    /// The name of a built-in volume.
    pub builtin: Option<String>,
    /// Voxels a side of a built-in volume.
    #[schemars(range(min = 8, max = 512))]
    pub resolution: Option<u32>,
    /// Seed of a built-in volume that is made of random numbers.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    pub seed: Option<u64>,
    /// A coarser level of an uploaded or built-in volume: its voxels are the means of boxes 2^level times as wide as the smallest side of a voxel.
    /// `step_voxels` is of the level's. Default 0, the volume as it is; the planner chooses one where it is not given.
    #[schemars(range(min = 0, max = crate::volume::MOST_LEVEL))]
    pub level: Option<u32>,
    /// A field technique's parameters, by technique.
    #[serde(flatten)]
    #[schemars(skip)]
    pub field: Map<String, Value>,
}

/// A camera: either `camera_to_world`, or `eye` with `target` and `up`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraRequest {
    /// Column-major 4x4 matrix, rigid, translation in the last column; the camera looks along -z with +y up (three.js, glTF).
    #[schemars(length(min = 16, max = 16))]
    pub camera_to_world: Option<Vec<f64>>,
    /// Where the eye is, in world units (mm for a scan; the volume is centred at the origin).
    pub eye: Option<[f64; 3]>,
    /// What the eye looks at. Default: the volume's centre.
    pub target: Option<[f64; 3]>,
    /// Which way is up. Default: z for a scan, y for a built-in.
    pub up: Option<[f64; 3]>,
    /// Full vertical angle of view in degrees. Default 53.13.
    #[schemars(range(min = 0.1, max = 179))]
    pub fov_y_deg: Option<f64>,
    /// `orthographic` shows what `fov_y_deg` would show in the target's plane.
    #[schemars(extend("enum" = ["perspective", "orthographic"]))]
    pub projection: Option<String>,
}

/// Size of the picture.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageRequest {
    /// Pixels across. Default 512.
    #[schemars(range(min = 1, max = 4096))]
    pub width: Option<u32>,
    /// Pixels down. Default 512.
    #[schemars(range(min = 1, max = 4096))]
    pub height: Option<u32>,
    /// Linear red, green, blue behind the volume. Default black.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub background: Option<[f64; 3]>,
    /// Leave out the background: a PNG with alpha.
    pub transparent: Option<bool>,
}

/// Clipping planes and a crop box: only what is inside of all of them is shown.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClipRequest {
    /// Planes in world units.
    #[schemars(length(max = 8))]
    pub planes: Option<Vec<PlaneRequest>>,
    /// A box along the world's axes.
    #[serde(rename = "box")]
    pub crop: Option<BoxRequest>,
}

/// A plane: the side that its normal points to is shown.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneRequest {
    /// Towards what is shown, of any length.
    pub normal: [f64; 3],
    /// A point of the plane. Default: the volume's centre.
    #[serde(default)]
    pub point: [f64; 3],
}

/// A box along the world's axes, in world units.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRequest {
    /// Its least corner.
    pub min: [f64; 3],
    /// Its greatest corner.
    pub max: [f64; 3],
}

/// When to stop.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BudgetRequest {
    /// Samples per pixel.
    #[schemars(range(min = 1, max = 65536))]
    pub samples: Option<u32>,
    /// Milliseconds from the start of the render; the sample under way is finished.
    #[schemars(range(min = 1, max = 3_600_000))]
    pub time_ms: Option<u64>,
    /// Stop when `error` is at most this.
    #[schemars(range(min = 1e-6, max = 10))]
    pub max_error: Option<f64>,
}

/// What `make` makes for this `key`, made once and kept for good: schemas are asked for with each request, are few, and take longer to make
/// than a request to check.
pub fn kept(key: &str, make: impl FnOnce() -> Value) -> &'static Value {
    static KEPT: Mutex<Vec<(String, &'static Value)>> = Mutex::new(Vec::new());
    let find = |kept: &[(String, &'static Value)]| kept.iter().find(|(known, _)| known == key).map(|(_, value)| *value);
    let lock = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let known = find(&lock());
    known.unwrap_or_else(|| {
        // Not under the lock: making one asks for others. Of two that are made at a time the first stays.
        let made = make();
        let mut kept = lock();
        find(&kept).unwrap_or_else(|| {
            let made: &Value = Box::leak(Box::new(made));
            kept.push((key.into(), made));
            made
        })
    })
}

/// The JSON Schema of a wire type, self-contained, with closed objects and plain `enum`s.
pub fn schema_of<T: JsonSchema>() -> &'static Value {
    kept(std::any::type_name::<T>(), make_schema::<T>)
}

fn make_schema<T: JsonSchema>() -> Value {
    let settings = schemars::generate::SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let schema: Schema = SchemaGenerator::new(settings).into_root_schema_for::<T>();
    let mut value = schema.to_value();
    if let Some(object) = value.as_object_mut() {
        object.remove("$schema");
        object.insert("additionalProperties".into(), json!(false));
    }
    value
}

/// The JSON Schema of `T` without some of its fields.
pub fn schema_without<T: JsonSchema>(fields: &[&str]) -> Value {
    let mut schema = schema_of::<T>().clone();
    if let Some(properties) = schema["properties"].as_object_mut() {
        properties.retain(|name, _| !fields.contains(&name.as_str()));
    }
    schema
}

/// Checks `value` against `schema` and deserialises it. `at` is the JSON pointer of `value` in the body.
///
/// # Errors
/// [`Error::Invalid`] with every violation, each with its pointer and the permitted range.
pub fn parse<T: DeserializeOwned>(value: &Value, schema: &'static Value, at: &str) -> Result<T> {
    check(value, schema, at)?;
    read(value, at)
}

/// Deserialises a value that has been checked against its schema, as part of a whole body.
///
/// # Errors
/// [`Error::Invalid`] where the schema permits more than the type.
pub fn read<T: DeserializeOwned>(value: &Value, at: &str) -> Result<T> {
    let value = with_whole_numbers(value);
    T::deserialize(&value)
        .map_err(|e| Error::invalid(at, e.to_string(), "see the schema in /v1/techniques and /openapi.json"))
}

/// The same JSON with `16.0` as `16`: to JSON Schema both are integers, to serde only the second is.
fn with_whole_numbers(value: &Value) -> Value {
    match value {
        Value::Number(n) => match n.as_f64() {
            Some(v) if n.is_f64() && v.fract() == 0.0 && v.abs() <= LARGEST_WHOLE as f64 => json!(v as i64),
            _ => value.clone(),
        },
        Value::Array(items) => items.iter().map(with_whole_numbers).collect(),
        Value::Object(fields) => fields.iter().map(|(k, v)| (k.clone(), with_whole_numbers(v))).collect(),
        other => other.clone(),
    }
}

/// Checks `value` against `schema` only.
///
/// # Errors
/// As [`parse`].
pub fn check(value: &Value, schema: &'static Value, at: &str) -> Result<()> {
    let validator = validator(schema)?;
    let violations: Vec<Violation> =
        validator.iter_errors(value).flat_map(|e| violation(&e, schema, at)).take(20).collect();
    if violations.is_empty() { Ok(()) } else { Err(Error::Invalid(violations)) }
}

/// The compiled schema. They are few, and compiling one takes longer than checking a request.
fn validator(schema: &'static Value) -> Result<Arc<jsonschema::Validator>> {
    static COMPILED: Mutex<Vec<(&Value, Arc<jsonschema::Validator>)>> = Mutex::new(Vec::new());
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, validator)) = compiled.iter().find(|(known, _)| std::ptr::eq(*known, schema)) {
        return Ok(validator.clone());
    }
    let validator = Arc::new(jsonschema::validator_for(schema).map_err(Error::internal)?);
    compiled.push((schema, validator.clone()));
    Ok(validator)
}

/// Our words for a schema error. An unknown field is reported at its own pointer, not its parent's.
fn violation(error: &jsonschema::ValidationError<'_>, schema: &Value, at: &str) -> Vec<Violation> {
    let pointer = format!("{at}{}", error.instance_path().as_str());
    let shown = |limit: &Value| limit.to_string();
    let range = || permitted_range(schema, error.instance_path().as_str());
    let one = |detail: String, permitted: String| vec![Violation::new(pointer.clone(), detail, permitted)];
    match error.kind() {
        ValidationErrorKind::AdditionalProperties { unexpected } => {
            let known = permitted_fields(schema, error.instance_path().as_str());
            let at = |name: &String| format!("{pointer}/{}", name.replace('~', "~0").replace('/', "~1"));
            unexpected.iter().map(|name| Violation::new(at(name), "unknown field", known.clone())).collect()
        }
        ValidationErrorKind::Minimum { limit } => {
            one("too small".into(), range().unwrap_or(format!("at least {}", shown(limit))))
        }
        ValidationErrorKind::Maximum { limit } => {
            one("too large".into(), range().unwrap_or(format!("at most {}", shown(limit))))
        }
        ValidationErrorKind::Enum { options } => one("not one of the permitted values".into(), options.to_string()),
        ValidationErrorKind::MinItems { limit } => one("too few elements".into(), format!("at least {limit}")),
        ValidationErrorKind::MaxItems { limit } => one("too many elements".into(), format!("at most {limit}")),
        ValidationErrorKind::Required { property } => {
            let name = property.as_str().unwrap_or_default();
            vec![Violation::new(
                format!("{pointer}/{name}"),
                "this field is required",
                permitted_fields(schema, error.instance_path().as_str()),
            )]
        }
        ValidationErrorKind::Type { kind } => {
            let wanted = match kind {
                TypeKind::Single(t) => t.to_string(),
                TypeKind::Multiple(types) => types.iter().map(|t| t.to_string()).collect::<Vec<_>>().join(" or "),
            };
            one("wrong type".into(), range().map_or(wanted.clone(), |r| format!("{wanted}, {r}")))
        }
        _ => match permitted_names(schema, error.instance_path().as_str()) {
            names if names.is_empty() => {
                one(error.to_string(), "see the schema in /v1/techniques and /openapi.json".into())
            }
            names => one("not one of the permitted values".into(), json!(names).to_string()),
        },
    }
}

/// The subschema that a path leads to, through `properties` and `items`.
fn subschema<'s>(schema: &'s Value, path: &str) -> Option<&'s Value> {
    path.split('/').skip(1).try_fold(schema, |s, part| match s.pointer(&format!("/properties/{part}")) {
        Some(found) => Some(found),
        None => s.get("items"),
    })
}

fn permitted_range(schema: &Value, path: &str) -> Option<String> {
    let s = subschema(schema, path)?;
    match (s.get("minimum"), s.get("maximum")) {
        (Some(low), Some(high)) => Some(format!("{low} to {high}")),
        (Some(low), None) => Some(format!("at least {low}")),
        (None, Some(high)) => Some(format!("at most {high}")),
        (None, None) => None,
    }
}

/// What a value may be that is one of several named ones, each with its description.
fn permitted_names<'s>(schema: &'s Value, path: &str) -> Vec<&'s Value> {
    fn names(s: &Value) -> Vec<&Value> {
        let several = ["oneOf", "anyOf"].into_iter().filter_map(|of| s.get(of)?.as_array()).flatten();
        s.get("const").into_iter().chain(several.flat_map(names)).collect()
    }
    subschema(schema, path).map(names).unwrap_or_default()
}

fn permitted_fields(schema: &Value, path: &str) -> String {
    let names = |s: &Value| Some(s.get("properties")?.as_object()?.keys().cloned().collect::<Vec<_>>().join(", "));
    subschema(schema, path).and_then(names).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::technique;

    #[test]
    fn who_names_what_there_is_not_is_told_what_there_is() {
        let schema = technique::find("projection").map(|t| (t.schema)()).unwrap_or_default();
        for (field, one_of_them) in [("mode", "xray"), ("interpolation", "trilinear")] {
            let found = match check(&json!({field: "maximal"}), schema, "/projection") {
                Err(Error::Invalid(violations)) => violations,
                _ => Vec::new(),
            };
            let pointers: Vec<&str> = found.iter().map(|v| v.pointer.as_str()).collect();
            assert_eq!(pointers, [format!("/projection/{field}")]);
            let permitted = found[0].permitted.clone().unwrap_or_default();
            assert!(permitted.contains(&format!("\"{one_of_them}\"")) && !permitted.contains("schema"), "{permitted}");
        }
    }
}
