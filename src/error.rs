//! One error type for the whole program, and the one place that chooses a status code.

use std::fmt;

/// One fault of a request, with its place and the permitted values.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Violation {
    /// The JSON pointer (RFC 6901) to the offending field, `""` for the whole body; `query:NAME` for a query parameter.
    pub pointer: String,
    /// The fault, in words for the sender.
    pub detail: String,
    /// The permitted range or values, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub permitted: Option<String>,
}

impl Violation {
    /// A violation at `pointer`, with the permitted values in words.
    pub fn new(pointer: impl Into<String>, detail: impl Into<String>, permitted: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), detail: detail.into(), permitted: Some(permitted.into()) }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = if self.pointer.is_empty() { "(the whole body)" } else { &self.pointer };
        write!(f, "{place}: {}", self.detail)?;
        match &self.permitted {
            Some(permitted) => write!(f, " (permitted: {permitted})"),
            None => Ok(()),
        }
    }
}

/// All errors, as the sender of a request needs to know them.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// The body does not match its content type (bad JSON, a bad header).
    #[error("{0}")]
    Malformed(String),
    /// A bearer token is required. It was not given, or it is wrong.
    #[error("a valid bearer token is required")]
    Unauthorized,
    /// There is no such thing.
    #[error("there is no {what} '{id}'")]
    NotFound {
        /// The kind of thing, such as `render`.
        what: &'static str,
        /// The id asked for.
        id: String,
    },
    /// The path exists, but it does not take the method.
    #[error("this path does not take that method")]
    MethodNotAllowed,
    /// None of the media types in `Accept` can be made.
    #[error("none of the types in Accept can be made here; possible are: {0}")]
    NotAcceptable(String),
    /// The request took too long to arrive.
    #[error("the request did not arrive in time")]
    RequestTimeout,
    /// The thing is in a state that does not permit this.
    #[error("{0}")]
    Conflict(String),
    /// Something is larger than a limit of the configuration.
    #[error("{what} is larger than the limit of {limit}")]
    TooLarge {
        /// The thing that is too large.
        what: String,
        /// The limit, with its unit.
        limit: String,
    },
    /// This path does not read the content type.
    #[error("{0}")]
    UnsupportedMediaType(String),
    /// The body is well formed but asks for something that cannot be done.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<Violation>),
    /// The queue is full.
    #[error("the queue is full: {waiting} renders wait; try again in {retry_after_s} s")]
    QueueFull {
        /// The number of unfinished renders.
        waiting: usize,
        /// The seconds after which a place is likely.
        retry_after_s: u64,
    },
    /// Too many streams are open.
    #[error("{open} streams are open, which is the limit; try again in {retry_after_s} s")]
    StreamsFull {
        /// The number of open streams.
        open: usize,
        /// The seconds after which a place is likely.
        retry_after_s: u64,
    },
    /// A kernel does not build on this device. Requests that need it are refused, and all others are served.
    #[error(
        "the kernel '{variant}' does not build on this device with {lanes} lanes, so what needs it cannot be rendered here; everything \
        else can. Another technique or option may do, or a server that is started with other --lanes or another --device; its log has the compiler's words"
    )]
    Kernel {
        /// The kernel's name and features.
        variant: String,
        /// The lanes that it was built for.
        lanes: u32,
    },
    /// The service is starting or draining.
    #[error("{0}")]
    Unavailable(String),
    /// A fault of the server. The text goes to the log; a client learns only that it happened.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// An [`Error::Invalid`] with a single violation.
    pub fn invalid(pointer: impl Into<String>, detail: impl Into<String>, permitted: impl Into<String>) -> Self {
        Self::Invalid(vec![Violation::new(pointer, detail, permitted)])
    }

    /// The same error with other pointers. Those for which `other` gives none are kept.
    #[must_use]
    pub fn with_pointers(self, other: impl Fn(&str) -> Option<String>) -> Self {
        let Self::Invalid(violations) = self else { return self };
        let moved = |v: Violation| Violation { pointer: other(&v.pointer).unwrap_or(v.pointer), ..v };
        Self::Invalid(violations.into_iter().map(moved).collect())
    }

    /// An [`Error::Internal`] from anything that prints.
    pub fn internal(cause: impl fmt::Display) -> Self {
        Self::Internal(cause.to_string())
    }

    /// The HTTP status and the title of this error. Both are chosen only here.
    pub fn status(&self) -> (u16, &'static str) {
        match self {
            Self::Malformed(_) => (400, "Malformed request"),
            Self::Unauthorized => (401, "Unauthorized"),
            Self::NotFound { .. } => (404, "Not found"),
            Self::MethodNotAllowed => (405, "Method not allowed"),
            Self::NotAcceptable(_) => (406, "Not acceptable"),
            Self::RequestTimeout => (408, "Request timeout"),
            Self::Conflict(_) => (409, "Conflict"),
            Self::TooLarge { .. } => (413, "Too large"),
            Self::UnsupportedMediaType(_) => (415, "Unsupported media type"),
            Self::Invalid(_) => (422, "Invalid request"),
            Self::QueueFull { .. } => (429, "Too many renders"),
            Self::StreamsFull { .. } => (429, "Too many streams"),
            Self::Internal(_) => (500, "Internal error"),
            Self::Kernel { .. } => (501, "Kernel not available"),
            Self::Unavailable(_) => (503, "Unavailable"),
        }
    }
}

/// The result of anything here that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;
