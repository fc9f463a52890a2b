//! The bounds of a render.

use crate::config::Limits;
use crate::request::BudgetRequest;

/// The default number of samples: enough that the jitter's noise is below a grey level in most pictures.
const DEFAULT_SAMPLES: u32 = 16;

/// The budget of a render. The render stops at the first bound that is reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// The samples per pixel.
    pub samples: u32,
    /// The milliseconds since the render's start.
    pub time_ms: Option<u64>,
    /// The error, as the film estimates it.
    pub max_error: Option<f64>,
}

impl Budget {
    /// The budget of a request. One that names only a time or an error may take as many samples as the server permits.
    pub(super) fn of(request: &BudgetRequest, limits: &Limits) -> Self {
        let open = request.time_ms.is_some() || request.max_error.is_some();
        let default = if open { limits.max_samples } else { DEFAULT_SAMPLES.min(limits.max_samples) };
        Self { samples: request.samples.unwrap_or(default), time_ms: request.time_ms, max_error: request.max_error }
    }
}
