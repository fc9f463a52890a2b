//! `POST /v1/projections`: the request of an export `project` in the words of who measures.

use serde_json::{Map, Value, json};

use super::export_schema;
use crate::config::Limits;
use crate::error::{Error, Result};
use crate::request;

/// The fields of a projection beside `of`, which are the technique's own.
const OWN: [&str; 2] = ["geometry", "projector"];

/// The JSON Schema of a projection's request under `limits`.
pub fn projection_schema(limits: &Limits) -> &'static Value {
    request::kept(&format!("projections {limits:?}"), || {
        let export = &export_schema(limits)["properties"];
        let own = &export["project"]["properties"];
        let mut of = export["volume"].clone();
        of["properties"]["phantom"] = own["phantom"].clone();
        of["description"] = "What is measured: a volume, a field or a phantom. Default: the built-in `smoke`.".into();
        let mut properties = Map::new();
        properties.insert("of".into(), of);
        properties.extend(OWN.map(|name| (name.to_owned(), own[name].clone())));
        json!({"type": "object", "properties": properties, "additionalProperties": false})
    })
}

/// The export's request of a projection's.
///
/// # Errors
/// [`Error::Invalid`] for fields that there are not.
pub fn export_of_projection(body: &Value, limits: &Limits) -> Result<Value> {
    request::check(body, projection_schema(limits), "")?;
    let mut own: Map<String, Value> =
        OWN.into_iter().filter_map(|name| Some((name.to_owned(), body.get(name)?.clone()))).collect();
    let mut export = json!({"technique": "project"});
    match body.get("of") {
        Some(of) if of.get("phantom").is_some() => {
            if of.as_object().is_some_and(|of| of.len() > 1) {
                return Err(Error::invalid("/of", "a phantom and something else are given", "one of them"));
            }
            own.insert("phantom".into(), of["phantom"].clone());
        }
        Some(of) => export["volume"] = of.clone(),
        None => {}
    }
    export["project"] = own.into();
    Ok(export)
}

/// A refusal of the export, at the fields of the projection.
pub fn at_projection(error: Error) -> Error {
    error.with_pointers(|pointer| {
        let of = |rest: &str, to: &str| Some(format!("{to}{rest}"));
        if let Some(rest) = pointer.strip_prefix("/volume") {
            return of(rest, "/of");
        }
        let rest = pointer.strip_prefix("/project")?;
        if rest.starts_with("/phantom") { of(rest, "/of") } else { of(rest, "") }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_the_field_that_was_sent() {
        for (of_export, of_projection) in [
            ("/volume/id", "/of/id"),
            ("/project/phantom/shapes/0", "/of/phantom/shapes/0"),
            ("/project/geometry/detector", "/geometry/detector"),
            ("", ""),
        ] {
            let Error::Invalid(found) = at_projection(Error::invalid(of_export, "", "")) else { unreachable!() };
            assert_eq!(found[0].pointer, of_projection);
        }
    }
}
