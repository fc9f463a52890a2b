//! Whether a render goes on after a pass.

use std::time::Instant;

use super::context::DeviceContext;
use super::view_run::ViewRun;
use crate::error::Result;
use crate::film::is_round;
use crate::scene::Scene;
use crate::technique::Random;

/// What to do after a pass.
pub(super) enum Verdict {
    GoOn,
    /// Start over with half the step.
    Refine,
    /// Stop, and why.
    Stop(&'static str),
}

/// What to do after a pass. The error is looked at after 2, 3, 4, 6, 8, 12, … samples, a fixed order, so that the same
/// request stops at the same sample. Where the step, not the noise, keeps the error above what was asked for, the step is
/// halved; where nothing is left to halve, the render stops and says so.
pub(super) fn verdict(view: &mut ViewRun, scene: &Scene, started: Instant, context: &DeviceContext) -> Result<Verdict> {
    let (samples, budget) = (view.samples(), scene.budget());
    if samples >= budget.samples {
        return Ok(Verdict::Stop("samples"));
    }
    if budget.time_ms.is_some_and(|ms| started.elapsed().as_millis() >= u128::from(ms)) {
        return Ok(Verdict::Stop("time"));
    }
    let enough = samples >= if scene.view().random().is_some() { Random::LEAST_SAMPLES } else { 2 };
    let Some(most) = budget.max_error.filter(|_| enough && is_round(samples)) else { return Ok(Verdict::GoOn) };
    let error = view.gathered.develop(context)?.error();
    let noise = error.noise.unwrap_or(0.0);
    let bias = (error.total.powi(2) - noise.powi(2)).max(0.0).sqrt();
    if error.total <= most {
        Ok(Verdict::Stop("error"))
    } else if bias > 0.7 * most && samples >= 4 && noise < bias {
        let by_step = error.discretisation.unwrap_or(0.0) > 0.5 * bias && view.can_halve_step();
        Ok(if by_step {
            Verdict::Refine
        } else if noise < 0.1 * bias {
            Verdict::Stop("floor")
        } else {
            Verdict::GoOn
        })
    } else {
        Ok(Verdict::GoOn)
    }
}
