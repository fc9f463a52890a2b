//! `/v1/volumes`: upload, list, show with histogram, delete.

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use percent_encoding::percent_decode_str;
use serde_json::{Value, json};

use super::App;
use super::problem::{self, Id};
use crate::error::{Error, Result};
use crate::volume::{RawQuery, VolumeInfo, builtin};

/// The voxels along a side of a built-in volume that is only looked up.
const SHOWN_RESOLUTION: usize = 64;

/// `POST /v1/volumes`.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let query: std::result::Result<Query<RawQuery>, _> = Query::try_from_uri(request.uri());
    let Query(query) =
        query.map_err(|e| Error::Malformed(format!("{}; permitted: dims, type, spacing, endian", e.body_text())))?;
    let raw = query.parse()?;
    let (parts, body) = request.into_parts();
    refuse_forms(&parts.headers)?;
    let name = file_name(&parts.headers, "volume");
    let _turn = app.uploads.acquire().await.map_err(Error::internal)?;
    let bytes =
        problem::read_body(&parts.headers, body, app.service.limits().max_body_bytes, app.request_timeout).await?;
    let service = app.service.clone();
    let (volume, id, new) = tokio::task::spawn_blocking(move || service.assets().volumes().insert(bytes, &name, raw))
        .await
        .map_err(Error::internal)??;
    let location = format!("/v1/volumes/{id}");
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(header::LOCATION, location)], Json(VolumeInfo::of_upload(&id, &volume)?)).into_response())
}

/// The name of an upload, or `otherwise`.
pub(super) fn file_name(headers: &HeaderMap, otherwise: &str) -> String {
    let name = headers.get("x-filename").and_then(|v| v.to_str().ok()).unwrap_or(otherwise);
    clean_name(&percent_decode_str(name).decode_utf8_lossy())
}

/// A name without control characters, of bearable length.
pub(super) fn clean_name(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).take(200).collect()
}

/// Refuses the body of a form by its type, since complaints about its bytes would not help.
fn refuse_forms(headers: &HeaderMap) -> Result<()> {
    let declared = headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
    // curl's --data-binary says x-www-form-urlencoded unless told otherwise, so that type is let through.
    if declared.starts_with("multipart/") || declared.starts_with("application/json") {
        let words =
            format!("the content type is {declared}; send the file itself as the body, as application/octet-stream");
        return Err(Error::UnsupportedMediaType(words));
    }
    Ok(())
}

/// `GET /v1/volumes`.
pub(super) async fn list(State(app): State<App>) -> Result<Json<Value>> {
    let volumes =
        tokio::task::spawn_blocking(move || app.service.assets().list_volumes()).await.map_err(Error::internal)?;
    Ok(Json(json!({"volumes": volumes})))
}

/// `GET /v1/volumes/{id}`, where the id may be the name of a built-in volume.
pub(super) async fn show(State(app): State<App>, Id(id): Id) -> Result<Json<VolumeInfo>> {
    let info = tokio::task::spawn_blocking(move || {
        if builtin::NAMES.contains(&id.as_str()) {
            app.service.assets().builtin_info(&id, SHOWN_RESOLUTION, 0)
        } else {
            app.service.assets().volumes().info(&id)
        }
    });
    Ok(Json(info.await.map_err(Error::internal)??))
}

/// `DELETE /v1/volumes/{id}`. Renders that use it go on.
pub(super) async fn delete(State(app): State<App>, Id(id): Id) -> Result<StatusCode> {
    if builtin::NAMES.contains(&id.as_str()) {
        return Err(Error::Conflict("a built-in volume cannot be deleted".into()));
    }
    tokio::task::spawn_blocking(move || app.service.assets().volumes().delete(&id))
        .await
        .map_err(Error::internal)??;
    Ok(StatusCode::NO_CONTENT)
}
