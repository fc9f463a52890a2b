//! The decision after a pass: the render goes on, refines its step, or stops.

use std::time::Instant;

use super::context::DeviceContext;
use super::view_run::ViewRun;
use crate::error::Result;
use crate::film::is_round;
use crate::technique::Random;

/// The decision after a pass.
pub(super) enum Next {
    GoOn,
    /// Start over with half the step.
    Refine,
    /// Stop, for this reason.
    Stop(&'static str),
}

/// Decides after a pass. The error is read after 1, 2, 3, 4, 6, 8, 12, … samples, a fixed order, so that the same request stops at the same sample. If
/// the step, not the noise, keeps the error above the requested one, the step is halved. If it cannot be halved any more, the render stops and says
/// so. An error that is not known stops nothing.
pub(super) fn next(view: &mut ViewRun, started: Instant, context: &DeviceContext) -> Result<Next> {
    let (samples, budget) = (view.samples(), view.scene().budget());
    if samples >= budget.samples {
        return Ok(Next::Stop("samples"));
    }
    if budget.time_ms.is_some_and(|ms| started.elapsed().as_millis() >= u128::from(ms)) {
        return Ok(Next::Stop("time"));
    }
    let paths = samples as usize * view.gathered.size.iter().product::<usize>();
    let enough = !view.is_random() || samples >= Random::LEAST_SAMPLES || paths >= Random::LEAST_PATHS;
    let Some(most) = budget.max_error.filter(|_| enough && is_round(samples)) else { return Ok(Next::GoOn) };
    let film = view.gathered.encode(context)?;
    let error = film.error();
    let Some(total) = error.total else { return Ok(Next::GoOn) };
    let (noise, bias) = (error.noise.unwrap_or(0.0), error.bias());
    if total <= most {
        Ok(Next::Stop("error"))
    } else if bias > 0.7 * most && samples >= 4 && noise < bias {
        // A shorter step does not bring back what is behind the ends of rays.
        let of_step = error.discretisation.unwrap_or(0.0);
        let by_step = of_step > 0.5 * bias && of_step > 2.0 * film.truncation() && view.can_halve_step();
        Ok(if by_step {
            Next::Refine
        } else if noise < 0.1 * bias {
            Next::Stop("floor")
        } else {
            Next::GoOn
        })
    } else {
        Ok(Next::GoOn)
    }
}
