//! One error type for the whole house, and the one place where a status code is chosen.

use std::fmt;

/// One thing wrong with a request: where, what, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Violation {
    /// JSON pointer (RFC 6901) to the offending field, `""` for the whole body; `query:NAME` for a query parameter.
    pub pointer: String,
    /// What is wrong, in words for the sender.
    pub detail: String,
    /// The permitted range or values, where there is one.
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

/// Everything that can go wrong, as the sender of a request needs to know it.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// The body is not what its content type says (bad JSON, a bad header).
    #[error("{0}")]
    Malformed(String),
    /// A bearer token is asked for and was not given, or is wrong.
    #[error("a valid bearer token is required")]
    Unauthorized,
    /// No such thing.
    #[error("there is no {what} '{id}'")]
    NotFound {
        /// The kind of thing, such as `render`.
        what: &'static str,
        /// The id asked for.
        id: String,
    },
    /// The path exists, the method does not.
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
        /// What is too large.
        what: String,
        /// The limit, with its unit.
        limit: String,
    },
    /// The content type is not one that this path reads.
    #[error("{0}")]
    UnsupportedMediaType(String),
    /// The body is well formed and means something that cannot be done.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Invalid(Vec<Violation>),
    /// The queue is full.
    #[error("the queue is full: {waiting} renders wait; try again in {retry_after_s} s")]
    QueueFull {
        /// Unfinished renders held now.
        waiting: usize,
        /// Seconds after which a place is likely.
        retry_after_s: u64,
    },
    /// Too many streams are open.
    #[error("{open} streams are open, which is the limit; try again in {retry_after_s} s")]
    StreamsFull {
        /// Streams open now.
        open: usize,
        /// Seconds after which a place is likely.
        retry_after_s: u64,
    },
    /// A kernel does not build on this device: what needs it cannot be had here, everything else can.
    #[error(
        "the kernel '{variant}' does not build on this device with {lanes} lanes, so what needs it cannot be rendered here; everything \
        else can. Another technique or option may do, or a server that is started with other --lanes or another --device; its log has the compiler's words"
    )]
    Kernel {
        /// The kernel's name and features.
        variant: String,
        /// Lanes that it was built for.
        lanes: u32,
    },
    /// The service is starting or draining.
    #[error("{0}")]
    Unavailable(String),
    /// Our fault. The text goes to the log; the client is told only that it happened.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// An [`Error::Invalid`] with a single violation.
    pub fn invalid(pointer: impl Into<String>, detail: impl Into<String>, permitted: impl Into<String>) -> Self {
        Self::Invalid(vec![Violation::new(pointer, detail, permitted)])
    }

    /// The same with other pointers, for those that `other` gives one for.
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

    /// The HTTP status and the title of this error: the only place where either is chosen.
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
