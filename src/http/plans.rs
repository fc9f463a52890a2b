//! `POST /v1/plan`: the technique and options for a request, their predicted cost and error, and the reasons.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::Request;

use super::App;
use crate::error::Result;
use crate::plan::Plan;

/// `POST /v1/plan`.
pub(super) async fn plan(State(app): State<App>, request: Request<Body>) -> Result<Json<Plan>> {
    let body = app.read_json(request).await?;
    Ok(Json(app.service.planner().plan(&body).await?))
}
