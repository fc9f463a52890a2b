//! Access by bearer tokens. They are compared by hash, so that the time of a comparison tells nothing.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Request};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use headers::HeaderMapExt;
use headers::authorization::{Authorization, Basic, Bearer};

use crate::config::Config;
use crate::error::{Error, Result};

/// The accepted tokens. If there are none, everybody may come in.
#[derive(Clone, Default)]
pub(super) struct Tokens(Arc<Vec<blake3::Hash>>);

impl Tokens {
    /// The tokens of the flag and the file.
    ///
    /// # Errors
    /// [`Error::Internal`] when the file cannot be read or holds no token, so that a typo does not leave the door open.
    pub fn read(config: &Config) -> Result<Self> {
        let mut tokens: Vec<String> = config.token.iter().filter(|t| !t.is_empty()).cloned().collect();
        if let Some(file) = &config.token_file {
            let text = std::fs::read_to_string(file).map_err(|e| Error::internal(format!("--token-file: {e}")))?;
            let before = tokens.len();
            tokens.extend(
                text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#')).map(str::to_owned),
            );
            if tokens.len() == before {
                return Err(Error::internal("--token-file holds no token"));
            }
        }
        Ok(Self(Arc::new(tokens.iter().map(|t| blake3::hash(t.as_bytes())).collect())))
    }

    fn admit(&self, headers: &HeaderMap) -> bool {
        let bearer = headers.typed_get::<Authorization<Bearer>>().map(|a| a.token().to_owned());
        let basic = headers.typed_get::<Authorization<Basic>>().map(|a| a.password().to_owned());
        let given = bearer.or(basic).map(|t| blake3::hash(t.as_bytes()));
        // blake3's equality takes the same time for every hash.
        given.is_some_and(|hash| self.0.iter().filter(|t| **t == hash).count() > 0)
    }
}

/// Admits `/healthz`, and everything else only with a token, if there are tokens.
pub(super) async fn check(State(tokens): State<Tokens>, request: Request<Body>, next: Next) -> Response {
    if tokens.0.is_empty() || request.uri().path() == "/healthz" || tokens.admit(request.headers()) {
        next.run(request).await
    } else {
        Error::Unauthorized.into_response()
    }
}
