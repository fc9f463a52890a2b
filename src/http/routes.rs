//! The table of routes and the layers around them.

use axum::Router;
use axum::extract::MatchedPath;
use axum::http::{HeaderName, HeaderValue, Method, Request, header};
use axum::middleware::{self, Next};
use axum::response::Response;
use axum::routing::{get, post, put};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{DefaultPredicate, NotForContentType, Predicate};
use tower_http::cors::{AllowOrigin, Any, CorsLayer};
use tower_http::trace::TraceLayer;

use super::guard::{self, Tokens};
use super::{
    App, exports, frames, info, openapi, plans, problem, projections, renders, sinograms, streams, studies, viewer,
    volumes,
};
use crate::error::{Error, Result};

/// Every route with its layers.
pub(super) fn router(app: App, tokens: Tokens, origins: &[String]) -> Result<Router> {
    let api = Router::new()
        .route("/v1/renders", post(renders::create).get(renders::list))
        .route("/v1/renders/{id}", get(renders::show).delete(renders::cancel))
        .route("/v1/renders/{id}/camera", put(renders::set_camera))
        .route("/v1/renders/{id}/frames", get(streams::frames))
        .route("/v1/renders/{id}/frame.png", get(frames::frame_png))
        .route("/v1/renders/{id}/frame.exr", get(frames::frame_exr))
        .route("/v1/renders/{id}/difference", get(renders::difference))
        .route("/v1/renders/{id}/field", get(renders::field))
        .route("/v1/renders/{id}/events", get(streams::events))
        .route("/v1/renders/{id}/convergence.svg", get(renders::convergence))
        .route("/v1/exports", post(exports::create).get(exports::list))
        .route("/v1/exports/{id}", get(exports::show).delete(exports::cancel))
        .route("/v1/exports/{id}/file", get(exports::file))
        .route("/v1/exports/{id}/events", get(streams::export_events))
        .route("/v1/volumes", post(volumes::create).get(volumes::list))
        .route("/v1/volumes/{id}", get(volumes::show).delete(volumes::delete))
        .route("/v1/projections", post(projections::create))
        .route("/v1/sinograms", post(sinograms::create).get(sinograms::list))
        .route("/v1/sinograms/{id}", get(sinograms::show).delete(sinograms::delete))
        .route("/v1/sinograms/{id}/data", get(sinograms::data))
        .route("/v1/sinograms/{id}/preview.png", get(sinograms::preview))
        .route("/v1/plan", post(plans::plan))
        .route("/v1/studies", get(studies::list))
        .route("/v1/studies/{id}", get(studies::show))
        .route("/v1/techniques", get(info::techniques))
        .route("/v1/device", get(info::device))
        .route("/healthz", get(info::healthz))
        .route("/readyz", get(info::readyz))
        .route("/metrics", get(info::metrics))
        .route("/openapi.json", get(openapi::document))
        .route("/docs", get(openapi::docs_root))
        .route("/docs/", get(openapi::docs))
        .route("/docs/{*path}", get(openapi::docs))
        .fallback(viewer::file)
        .method_not_allowed_fallback(|| async { Error::MethodNotAllowed })
        .with_state(app);
    // Pictures are compressed already, and a compressed stream would hold frames back.
    let compressible = DefaultPredicate::new()
        .and(NotForContentType::const_new("multipart/x-mixed-replace"))
        .and(NotForContentType::const_new("application/octet-stream"));
    let layered = api
        .layer(middleware::from_fn(count))
        .layer(middleware::from_fn_with_state(tokens, guard::check))
        .layer(CompressionLayer::new().compress_when(compressible))
        .layer(CatchPanicLayer::custom(problem::from_panic))
        .layer(TraceLayer::new_for_http().on_failure(()));
    if origins.is_empty() { Ok(layered) } else { Ok(layered.layer(cors(origins)?)) }
}

fn cors(origins: &[String]) -> Result<CorsLayer> {
    let parse = |o: &String| {
        o.parse::<HeaderValue>().map_err(|_| Error::internal(format!("--cors-origin: '{o}' is not an origin")))
    };
    let origins = origins.iter().map(parse).collect::<Result<Vec<_>>>()?;
    Ok(CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins))
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers(
            [header::CONTENT_TYPE, header::AUTHORIZATION, header::ACCEPT, header::IF_NONE_MATCH]
                .into_iter()
                .chain(["idempotency-key", "x-filename", "last-event-id"].map(HeaderName::from_static))
                .collect::<Vec<_>>(),
        )
        .expose_headers(Any))
}

/// Counts requests by route and status. The number of labels must not grow with the clients' inventions, so a label has the route's pattern instead
/// of its path, and only methods that exist.
async fn count(path: Option<MatchedPath>, request: Request<axum::body::Body>, next: Next) -> Response {
    let method = match request.method().as_str() {
        known @ ("GET" | "HEAD" | "POST" | "PUT" | "DELETE" | "OPTIONS" | "PATCH") => known.to_owned(),
        _ => "OTHER".to_owned(),
    };
    let response = next.run(request).await;
    let route = path.map_or_else(|| "static".to_owned(), |p| p.as_str().to_owned());
    let labels = [("method", method), ("route", route), ("status", response.status().as_u16().to_string())];
    metrics::counter!("cloudchamber_http_requests_total", &labels).increment(1);
    response
}
