//! The check of bodies against their schemas, with our own words for errors.

use std::sync::{Arc, Mutex, PoisonError};

use jsonschema::error::{TypeKind, ValidationErrorKind};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::LARGEST_WHOLE;
use crate::error::{Error, Result, Violation};

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
/// [`Error::Invalid`] if the schema permits more than the type.
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

/// The compiled schema, which is kept. Schemas are few, and compiling one takes longer than checking a request.
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

/// The permitted values of a field that is one of several named ones, each with its description.
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
