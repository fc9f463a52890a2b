//! JSON Schemas of wire types, made once.

use std::sync::{Mutex, PoisonError};

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Value, json};

/// The result of `make` for this `key`, made once and kept for good. Each request asks for schemas; they are few, and take longer to make than a
/// request to check.
pub fn kept(key: &str, make: impl FnOnce() -> Value) -> &'static Value {
    static KEPT: Mutex<Vec<(String, &'static Value)>> = Mutex::new(Vec::new());
    let find = |kept: &[(String, &'static Value)]| kept.iter().find(|(known, _)| known == key).map(|(_, value)| *value);
    let lock = || KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let known = find(&lock());
    known.unwrap_or_else(|| {
        // The lock is not held, since making one asks for others. Of two that are made at a time the first stays.
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
