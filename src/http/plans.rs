//! `POST /v1/plan`: what a request would be rendered with, what that would cost and be wrong by, and why.

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::Request;

use super::{App, problem};
use crate::error::Result;
use crate::plan::{Plan, Planner};

/// `POST /v1/plan`.
pub(super) async fn plan(State(app): State<App>, request: Request<Body>) -> Result<Json<Plan>> {
    let body = problem::read_json(request, app.limits.max_json_bytes, app.request_timeout).await?;
    Ok(Json(planner(&app).plan(&body).await?))
}

/// The planner of this server.
pub(super) fn planner(app: &App) -> Planner<'_> {
    Planner { engine: &app.engine, store: &app.store, limits: &app.limits, calibrations: &app.calibrations }
}
