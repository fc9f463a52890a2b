//! The JSON Schema of a render request: the shared fields and every technique's own, under the limits of the server.

use serde_json::Value;

use super::AUTO;
use crate::config::Limits;
use crate::request::{self, RenderRequest};
use crate::technique::{self, Kind, Technique};

/// The JSON Schema of a technique's own parameters under `limits`.
pub fn parameters_schema(technique: &Technique, limits: &Limits) -> Value {
    let mut schema = (technique.schema)().clone();
    if let Kind::Field { work: Some(work), .. } = technique.kind {
        schema["properties"][work.of]["maximum"] = (work.most)(limits).into();
    }
    schema
}

/// The JSON Schema of a render request under `limits`: the shared fields and every technique's own.
pub fn schema(limits: &Limits) -> &'static Value {
    request::kept(&format!("{limits:?}"), || make_schema(limits))
}

/// The schema of a request with the fields that may stand under its `volume`.
pub(super) fn with_fields(mut schema: Value, limits: &Limits) -> Value {
    schema["properties"]["volume"]["additionalProperties"] = false.into();
    for t in technique::fields() {
        schema["properties"]["volume"]["properties"][t.name] = parameters_schema(t, limits);
    }
    schema
}

fn make_schema(limits: &Limits) -> Value {
    let mut schema = request::schema_of::<RenderRequest>().clone();
    let names: Vec<&str> = technique::views().map(|t| t.name).collect();
    schema["properties"]["technique"]["enum"] = names.into_iter().chain([AUTO]).collect();
    for t in technique::views() {
        schema["properties"][t.name] = parameters_schema(t, limits);
    }
    for t in technique::views() {
        for name in t.shares {
            schema["properties"][name] = (t.schema)()["properties"][name].clone();
        }
    }
    schema = with_fields(schema, limits);
    for side in ["width", "height"] {
        schema["properties"]["image"]["properties"][side]["maximum"] = limits.max_image_side.into();
    }
    schema["properties"]["budget"]["properties"]["samples"]["maximum"] = limits.max_samples.into();
    schema["properties"]["budget"]["properties"]["time_ms"]["maximum"] = limits.max_time_ms.into();
    schema
}
