//! `/openapi.json`, made from one table of operations (`operations.rs`) and from the schemas that bodies are checked against, and `/docs`.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::{Uri, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde_json::{Map, Value, json};

use super::App;
use super::operations::{Body, JSON, OPERATIONS, Operation};
use crate::error::{Error, Result};
use crate::render;
use crate::request::{CameraRequest, schema_of};
use crate::tomography::{SinogramInfo, SinogramMeta};
use crate::volume::VolumeInfo;

fn describe(operation: &Operation) -> Value {
    let mut responses = Map::new();
    for (status, media, words) in operation.answers {
        let entry = responses.entry(status.to_string()).or_insert_with(|| json!({"description": words, "content": {}}));
        if !media.is_empty() {
            entry["content"][*media] = json!({});
        }
    }
    for status in operation.problems.iter().chain([&401, &500]) {
        responses.insert(status.to_string(), json!({"$ref": "#/components/responses/Problem"}));
    }
    let mut described = json!({"summary": operation.words, "responses": responses});
    let names = operation.path.split(['{', '}']).skip(1).step_by(2);
    let path_parameters =
        names.map(|n| json!({"name": n, "in": "path", "required": true, "schema": {"type": "string"}}));
    let mut parameters: Vec<Value> = path_parameters.collect();
    let mut query = |name: &str, schema: Value| parameters.push(json!({"name": name, "in": "query", "schema": schema}));
    if operation.path.contains("/frame.") || operation.path.ends_with("/file") {
        query("wait", json!({"enum": ["final"]}));
    }
    if operation.path.ends_with("/preview.png") {
        query("view", json!({"type": "integer", "minimum": 0}));
    }
    if operation.path.ends_with("/difference") {
        query("with", json!({"type": "string"}));
    }
    match operation.body {
        Body::None => {}
        Body::Json(schema) => {
            let content = json!({JSON: {"schema": {"$ref": format!("#/components/schemas/{schema}")}}});
            described["requestBody"] = json!({"required": true, "content": content});
        }
        Body::Form(meta, files) => {
            let mut properties = Map::new();
            properties.insert("meta".into(), json!({"$ref": format!("#/components/schemas/{meta}")}));
            properties
                .extend(files.iter().map(|name| ((*name).to_owned(), json!({"type": "string", "format": "binary"}))));
            let schema = json!({"type": "object", "required": ["data"], "properties": properties});
            let content = json!({"multipart/form-data": {"schema": schema}, "application/octet-stream": {}});
            described["requestBody"] = json!({"required": true, "content": content});
        }
        Body::Bytes => {
            for name in ["dims", "type", "spacing", "endian"] {
                query(name, json!({"type": "string"}));
            }
            described["requestBody"] = json!({"required": true, "content": {"application/octet-stream": {}}});
        }
    }
    described["parameters"] = parameters.into();
    described
}

/// `GET /openapi.json`.
pub(super) async fn document(State(app): State<App>) -> Json<Value> {
    let mut paths = Map::new();
    for operation in OPERATIONS {
        let path = paths.entry(operation.path).or_insert_with(|| json!({}));
        path[operation.method] = describe(operation);
    }
    let problem = json!({"type": "object", "properties": {
        "type": {"type": "string"}, "title": {"type": "string"}, "status": {"type": "integer"}, "detail": {"type": "string"},
        "errors": {"type": "array", "items": {"type": "object", "properties": {
            "pointer": {"type": "string"}, "detail": {"type": "string"}, "permitted": {"type": "string"}}}}}});
    Json(json!({
        "openapi": "3.1.0",
        "info": {"title": "Cloudchamber", "version": env!("CARGO_PKG_VERSION"), "description": env!("CARGO_PKG_DESCRIPTION")},
        "paths": paths,
        "components": {
            "schemas": {
                "RenderRequest": render::schema(app.service.limits()), "ExportRequest": render::export_schema(app.service.limits()), "ProjectionRequest": render::projection_schema(app.service.limits()), "Camera": schema_of::<CameraRequest>(),
                "Volume": schema_of::<VolumeInfo>(), "Sinogram": schema_of::<SinogramInfo>(), "SinogramMeta": schema_of::<SinogramMeta>(), "Problem": problem,
            },
            "responses": {"Problem": {
                "description": "RFC 9457 problem document",
                "content": {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}}},
        },
    }))
}

/// `GET /docs`: a redirect to the page itself, so that its relative links work.
pub(super) async fn docs_root() -> Redirect {
    Redirect::permanent("/docs/")
}

/// The readable form of the document.
pub(super) async fn docs(uri: Uri) -> Result<Response> {
    let name = uri.path().trim_start_matches("/docs").trim_start_matches('/').to_owned();
    let config = Arc::new(utoipa_swagger_ui::Config::from("/openapi.json"));
    let file = utoipa_swagger_ui::serve(&name, config).map_err(Error::internal)?;
    let file = file.ok_or_else(|| Error::NotFound { what: "page", id: name.chars().take(100).collect() })?;
    Ok(([(header::CONTENT_TYPE, file.content_type)], file.bytes.into_owned()).into_response())
}
