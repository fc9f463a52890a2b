//! The target of a plan: an error, a time, or both.

use crate::render::Scene;

/// The error if the budget gives none.
const USUAL_ERROR: f64 = 0.02;

/// The target of a plan.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// The error, relative.
    pub error: f64,
    /// The time, ms.
    pub time_ms: Option<f64>,
    /// True if the error is asked for; else it is only the usual one.
    pub says_error: bool,
}

impl Target {
    /// The target of a scene's budget.
    pub fn of(scene: &Scene) -> Self {
        let budget = scene.budget();
        Self {
            error: budget.max_error.unwrap_or(USUAL_ERROR),
            time_ms: budget.time_ms.map(|t| t as f64),
            says_error: budget.max_error.is_some() || budget.time_ms.is_none(),
        }
    }
}
