//! Forms with files (`multipart/form-data`, RFC 7578).

use std::collections::HashMap;
use std::convert::Infallible;

use axum::http::{HeaderMap, header};
use bytes::Bytes;

use crate::error::{Error, Result};

/// A part of a form.
pub struct Part {
    /// The name of its file, if it is one.
    pub file_name: Option<String>,
    /// Its content.
    pub bytes: Bytes,
}

/// The boundary of a form's parts; `None` if the content type is another.
pub fn boundary(headers: &HeaderMap) -> Option<String> {
    let declared = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    multer::parse_boundary(declared).ok()
}

/// The parts of a form by their names, each of which is in `permitted` and comes once.
///
/// # Errors
/// [`Error::Malformed`] for a body that is no form; [`Error::Invalid`] at a part that is not permitted or comes twice.
pub async fn parts(body: Vec<u8>, boundary: String, permitted: &[&str]) -> Result<HashMap<String, Part>> {
    let malformed = |cause: multer::Error| Error::Malformed(format!("the body is no form: {cause}"));
    let stream = futures_util::stream::once(async move { Ok::<_, Infallible>(Bytes::from(body)) });
    let mut form = multer::Multipart::new(stream, boundary);
    let mut parts = HashMap::new();
    while let Some(field) = form.next_field().await.map_err(malformed)? {
        let name: String = field.name().unwrap_or_default().chars().take(100).collect();
        let at = || format!("/{name}");
        if !permitted.contains(&name.as_str()) {
            return Err(Error::invalid(at(), "is no part of this form", permitted.join(", ")));
        }
        if parts.contains_key(&name) {
            return Err(Error::invalid(at(), "is given twice", "once"));
        }
        let file_name = field.file_name().map(str::to_owned);
        let bytes = field.bytes().await.map_err(malformed)?;
        parts.insert(name, Part { file_name, bytes });
    }
    Ok(parts)
}
