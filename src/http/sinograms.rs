//! `/v1/sinograms`: upload, list, show with a check of the data, numbers, picture, delete.

use std::collections::HashMap;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use super::App;
use super::accept::negotiate;
use super::form::{self, Part};
use super::problem::{self, Id};
use super::volumes::{clean_name, file_name};
use crate::error::{Error, Result};
use crate::frame;
use crate::request::{self, schema_of};
use crate::tomography::{SinogramInfo, SinogramMeta, SinogramParts};

/// The parts of the form.
const PARTS: [&str; 4] = ["meta", "data", "flat", "dark"];
const NRRD: &str = "application/octet-stream";
const NPY: &str = "application/x-npy";

/// `POST /v1/sinograms`: a form, or a NRRD that says its geometry itself.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let (head, body) = request.into_parts();
    let boundary = form::boundary(&head.headers);
    let declared = head.headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or_default();
    if boundary.is_none() && (declared.starts_with("multipart/") || declared.starts_with("application/json")) {
        let words =
            format!("the content type is {declared}; send multipart/form-data, or a NRRD as application/octet-stream");
        return Err(Error::UnsupportedMediaType(words));
    }
    let name = file_name(&head.headers, "sinogram");
    let _turn = app.uploads.acquire().await.map_err(Error::internal)?;
    let limit = app.service.limits().max_body_bytes;
    let bytes = problem::read_body(&head.headers, body, limit, app.request_timeout).await?;
    // The parts of a form are as large as the body, so they are joined beside the runtime's own threads.
    let (parts, bytes) = match boundary {
        Some(boundary) => (Some(form::parts(bytes, boundary, &PARTS).await?), Vec::new()),
        None => (None, bytes),
    };
    let service = app.service.clone();
    let insert = move || -> Result<(SinogramInfo, bool)> {
        let (bytes, name, how) = match parts {
            Some(parts) => of_form(parts, name, service.limits().max_json_bytes)?,
            None => (bytes, name, None),
        };
        if bytes.is_empty() {
            let permitted = "a form with `meta` and `data`, or a NRRD with the key geometry:={…}";
            return Err(Error::invalid("", "the body is empty", permitted));
        }
        let (sinogram, id, new) = service.assets().sinograms().insert(bytes, &name, how)?;
        Ok((sinogram.info(&id, true), new))
    };
    let (info, new) = tokio::task::spawn_blocking(insert).await.map_err(Error::internal)??;
    let location = format!("/v1/sinograms/{}", info.id);
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(header::LOCATION, location)], Json(info)).into_response())
}

/// The bytes of a form's files, the name, and what is said of them in at most `most` bytes of JSON.
fn of_form(
    parts: HashMap<String, Part>,
    name: String,
    most: usize,
) -> Result<(Vec<u8>, String, Option<SinogramParts>)> {
    let bytes_of = |part: &str| parts.get(part).map_or(&[][..], |part| &part.bytes);
    let Some(data) = parts.get("data") else {
        return Err(Error::invalid("/data", "is missing", "a file: NRRD, NumPy's .npy, or bare numbers"));
    };
    let meta = match parts.get("meta") {
        Some(meta) if meta.bytes.len() > most => {
            return Err(Error::TooLarge { what: "the part meta".into(), limit: format!("{most} bytes") });
        }
        Some(meta) => {
            let value: Value = serde_json::from_slice(&meta.bytes)
                .map_err(|cause| Error::invalid("/meta", format!("is not JSON: {cause}"), "an object"))?;
            Some(request::parse::<SinogramMeta>(&value, schema_of::<SinogramMeta>(), "/meta")?)
        }
        None => None,
    };
    let (bytes, how) = SinogramParts::join(meta, ["data", "flat", "dark"].map(bytes_of));
    let name = data.file_name.as_deref().filter(|_| name == "sinogram").map_or(name, clean_name);
    Ok((bytes, name, Some(how)))
}

/// `GET /v1/sinograms`.
pub(super) async fn list(State(app): State<App>) -> Json<Value> {
    Json(json!({"sinograms": app.service.assets().sinograms().list()}))
}

/// `GET /v1/sinograms/{id}`.
pub(super) async fn show(State(app): State<App>, Id(id): Id) -> Result<Json<SinogramInfo>> {
    let info = tokio::task::spawn_blocking(move || app.service.assets().sinograms().info(&id));
    Ok(Json(info.await.map_err(Error::internal)??))
}

/// `GET /v1/sinograms/{id}/data`: NRRD, or NumPy's format if the client asks for it.
pub(super) async fn data(State(app): State<App>, Id(id): Id, headers: HeaderMap) -> Result<Response> {
    let media = negotiate(&headers, &[NRRD, NPY])?;
    let made = tokio::task::spawn_blocking(move || -> Result<(Vec<u8>, String)> {
        let sinogram = app.service.assets().sinograms().get(&id)?;
        let (bytes, extension) = if media == NPY { (sinogram.npy(), "npy") } else { (sinogram.nrrd()?, "nrrd") };
        Ok((bytes, format!("attachment; filename=\"{id}.{extension}\"")))
    });
    let (bytes, disposition) = made.await.map_err(Error::internal)??;
    let headers = [(header::CONTENT_TYPE, media.to_owned()), (header::CONTENT_DISPOSITION, disposition)];
    Ok((headers, [(header::VARY, "accept")], bytes).into_response())
}

/// The query of a picture.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PreviewQuery {
    view: Option<usize>,
}

/// `GET /v1/sinograms/{id}/preview.png`: a view, or the middle row of all.
pub(super) async fn preview(
    State(app): State<App>,
    Id(id): Id,
    query: std::result::Result<Query<PreviewQuery>, axum::extract::rejection::QueryRejection>,
) -> Result<Response> {
    let Query(PreviewQuery { view }) =
        query.map_err(|e| Error::invalid("query:view", e.body_text(), "a view, from 0"))?;
    let made = tokio::task::spawn_blocking(move || {
        let grey = app.service.assets().sinograms().get(&id)?.preview(view)?;
        frame::grey_png(grey.size, &grey.bytes)
    });
    Ok(([(header::CONTENT_TYPE, "image/png")], made.await.map_err(Error::internal)??).into_response())
}

/// `DELETE /v1/sinograms/{id}`. Reconstructions that use it go on.
pub(super) async fn delete(State(app): State<App>, Id(id): Id) -> Result<StatusCode> {
    tokio::task::spawn_blocking(move || app.service.assets().sinograms().delete(&id))
        .await
        .map_err(Error::internal)??;
    Ok(StatusCode::NO_CONTENT)
}
