//! `POST /v1/projections`: a measurement, whose sinogram is kept. From then on it is an export.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{Request, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::App;
use crate::error::Result;
use crate::render::{at_projection, export_of_projection};

/// `POST /v1/projections`.
pub(super) async fn create(State(app): State<App>, request: Request<Body>) -> Result<Response> {
    let body = app.read_json(request).await?;
    let export = export_of_projection(&body, app.service.limits())?;
    let job = app.service.project(export).await.map_err(at_projection)?;
    let location = format!("/v1/exports/{}", job.id());
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, location)], Json(job.resource())).into_response())
}
