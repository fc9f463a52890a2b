//! Errors as RFC 9457 problem documents, and the readers of bodies, in which every failure becomes a problem document.

use std::time::Duration;

use axum::body::Body;
use axum::extract::{FromRequestParts, Path};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, Request, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use problem_details::ProblemDetails;
use serde_json::{Value, json};

use crate::error::{Error, Result};

impl IntoResponse for Error {
    fn into_response(self) -> Response {
        let (code, title) = self.status();
        let status = StatusCode::from_u16(code).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        // The cause of an internal error is for the log, not for the client.
        let detail = match &self {
            Error::Internal(cause) => {
                tracing::error!(%cause, "internal error");
                "something went wrong on the server; its log says what".to_owned()
            }
            other => other.to_string(),
        };
        let errors = if let Error::Invalid(violations) = &self { json!(violations) } else { json!([]) };
        let slug = title.to_lowercase().replace(' ', "-");
        let kind = format!("/problems/{slug}").parse::<axum::http::Uri>().unwrap_or_default();
        let mut response = ProblemDetails::from_status_code(status)
            .with_type(kind)
            .with_title(title)
            .with_detail(detail)
            .with_extensions(json!({"errors": errors}))
            .into_response();
        let headers = response.headers_mut();
        match self {
            Error::QueueFull { retry_after_s, .. } | Error::StreamsFull { retry_after_s, .. } => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from(retry_after_s.max(1)));
            }
            Error::Unavailable(_) => drop(headers.insert(header::RETRY_AFTER, HeaderValue::from(5))),
            Error::Unauthorized => {
                // Basic lets a browser ask for the token, as the password, and send it with everything that the viewer loads.
                headers.append(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
                headers.append(
                    header::WWW_AUTHENTICATE,
                    HeaderValue::from_static("Basic realm=\"Cloudchamber: token as password\""),
                );
            }
            _ => {}
        }
        response
    }
}

/// The last part of a path, decoded. A part that is not UTF-8 names nothing.
pub struct Id(pub String);

impl<S: Send + Sync> FromRequestParts<S> for Id {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self> {
        let missing = |_| Error::NotFound { what: "path", id: parts.uri.path().chars().take(100).collect() };
        let path = Path::<String>::from_request_parts(&mut parts.clone(), state).await;
        path.map(|Path(id)| Self(id)).map_err(missing)
    }
}

/// A panic in a handler, reported like any other internal error.
pub fn from_panic(panic: Box<dyn std::any::Any + Send>) -> Response {
    let words =
        panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied()).unwrap_or("panic");
    Error::internal(format!("a handler panicked: {words}")).into_response()
}

/// The body: at most `limit` bytes, with at most `patience` between two pieces of it.
///
/// # Errors
/// [`Error::TooLarge`], [`Error::RequestTimeout`], or [`Error::Malformed`] when it breaks off.
pub async fn read_body(headers: &HeaderMap, body: Body, limit: usize, patience: Duration) -> Result<Vec<u8>> {
    let too_large = || Error::TooLarge { what: "the body".into(), limit: format!("{limit} bytes") };
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|v| v.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|n| n > limit as u64) {
        return Err(too_large());
    }
    // The buffer grows with the bytes that arrive, since an announced length is not trusted.
    let mut bytes = Vec::new();
    let mut stream = body.into_data_stream();
    loop {
        match tokio::time::timeout(patience, stream.next()).await {
            Err(_) => return Err(Error::RequestTimeout),
            Ok(None) => return Ok(bytes),
            Ok(Some(Err(cause))) => return Err(Error::Malformed(format!("the body broke off: {cause}"))),
            Ok(Some(Ok(piece))) if bytes.len() + piece.len() > limit => return Err(too_large()),
            Ok(Some(Ok(piece))) => bytes.extend_from_slice(&piece),
        }
    }
}

/// The body as JSON.
///
/// # Errors
/// As [`read_body`]; [`Error::UnsupportedMediaType`] when the content type is not JSON; [`Error::Malformed`] with line and column.
pub async fn read_json(request: Request<Body>, limit: usize, patience: Duration) -> Result<Value> {
    let (parts, body) = request.into_parts();
    let declared = parts.headers.get(header::CONTENT_TYPE).and_then(|v| v.to_str().ok()).unwrap_or("none");
    let is_json =
        declared.parse::<mime::Mime>().is_ok_and(|m| m.subtype() == mime::JSON || m.suffix() == Some(mime::JSON));
    if !is_json {
        return Err(Error::UnsupportedMediaType(format!(
            "the content type is {declared}; this path reads application/json"
        )));
    }
    let bytes = read_body(&parts.headers, body, limit, patience).await?;
    serde_json::from_slice(&bytes).map_err(|e| Error::Malformed(format!("the body is not JSON: {e}")))
}
