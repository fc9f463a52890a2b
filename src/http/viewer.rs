//! The viewer's files, from the binary or from `--static`.

use std::path::Path;

use axum::extract::State;
use axum::http::{Method, Uri, header};
use axum::response::{IntoResponse, Response};
use include_dir::{Dir, include_dir};

use super::App;
use crate::error::{Error, Result};

static STATIC: Dir = include_dir!("$CARGO_MANIFEST_DIR/static");

/// The content policy: nothing from elsewhere and no inline script. Pictures may be blobs.
const POLICY: &str = "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; frame-ancestors 'none'";

fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        _ => "application/octet-stream",
    }
}

/// True if a name is plain and leads below the folder: no `..`, no absolute path, no hidden file.
fn is_plain(name: &str) -> bool {
    name.split('/').all(|part| !part.is_empty() && !part.starts_with('.') && !part.contains(['\\', '\0', ':']))
}

/// `GET /` and every file of the viewer; anything else is a 404 problem.
pub(super) async fn file(State(app): State<App>, method: Method, uri: Uri) -> Result<Response> {
    let path = uri.path().trim_start_matches('/');
    let name = if path.is_empty() { "index.html" } else { path };
    let missing = || Error::NotFound { what: "path", id: uri.path().chars().take(100).collect() };
    if !is_plain(name) {
        return Err(missing());
    }
    let bytes = match &app.static_dir {
        Some(dir) => tokio::fs::read(dir.join(Path::new(name))).await.map_err(|_| missing())?,
        None => STATIC.get_file(name).ok_or_else(missing)?.contents().to_vec(),
    };
    if method != Method::GET && method != Method::HEAD {
        return Err(Error::MethodNotAllowed);
    }
    let headers = [
        (header::CONTENT_TYPE, media_type(name)),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::CACHE_CONTROL, "no-cache"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    Ok((headers, bytes).into_response())
}
