//! The pictures after fewer samples. A render keeps the last one, to compare its halves, and a pilot keeps all.

use std::sync::Arc;
use std::time::Duration;

use super::context::DeviceContext;
use super::layer::Layer;
use crate::error::Result;
use crate::film::{Halves, Round, Samples, pilot_rounds};

/// The number of samples after which a render's picture is first kept. A moving camera has had its frames by then.
const FIRST: u32 = 4;

/// The rounds of a picture.
pub(super) struct Rounds {
    pilot: bool,
    kept: Vec<Arc<Round>>,
    halves: Option<Halves>,
    /// The difference to the control after some samples, and its halves.
    step: Option<Round>,
    step_noise: Option<Halves>,
}

impl Rounds {
    pub fn new(pilot: bool) -> Self {
        Self { pilot, kept: Vec::new(), halves: None, step: None, step_noise: None }
    }

    /// Forgets the rounds, as for another camera or step.
    pub fn forget(&mut self) {
        self.kept.clear();
        (self.halves, self.step, self.step_noise) = (None, None, None);
    }

    /// Keeps the picture after 4, 8, 16, … samples, and notes its difference from the picture of half as many.
    pub fn passed(
        &mut self,
        context: &DeviceContext,
        layer: &Layer,
        control: Option<&Layer>,
        device_time: Duration,
    ) -> Result<()> {
        let samples = layer.samples;
        let whole = samples.is_power_of_two();
        let wanted = if self.pilot { self.is_next_of_pilot(samples) } else { samples >= FIRST && whole };
        if !wanted {
            return Ok(());
        }
        let main = layer.read(context, false)?;
        let luminance = (0..main.pixels()).map(|i| main.luminance(i) as f32).collect();
        let round = Round { samples, device_ms: device_time.as_secs_f64() * 1e3, luminance };
        if let Some(control) = control.filter(|control| whole && control.samples == samples) {
            let step = Round { samples, device_ms: 0.0, luminance: step_of(&control.read(context, false)?, &main) };
            let half = self.step.take().filter(|half| 2 * half.samples == samples);
            self.step_noise = half.map(|half| Halves::of(&half, &step)).or(self.step_noise);
            self.step = Some(step);
        }
        if whole {
            let half = self.kept.iter().find(|r| 2 * r.samples == samples);
            self.halves = half.map(|half| Halves::of(half, &round)).or(self.halves);
        }
        if !self.pilot {
            self.kept.clear();
        }
        self.kept.push(Arc::new(round));
        Ok(())
    }

    fn is_next_of_pilot(&self, samples: u32) -> bool {
        pilot_rounds().nth(self.kept.len()) == Some(samples)
    }

    /// The difference of the two newest pictures of which one has twice as many samples.
    pub fn halves(&self) -> Option<Halves> {
        self.halves
    }

    /// The noise of the difference to the control, by its halves.
    pub fn step_noise(&self) -> Option<Halves> {
        self.step_noise
    }

    /// All pictures that a pilot has kept, for a planner.
    pub fn on_the_way(&self) -> Vec<Arc<Round>> {
        if self.pilot { self.kept.clone() } else { Vec::new() }
    }
}

/// The difference of the control's luminance to that of the main samples at its pixels.
fn step_of(control: &Samples, main: &Samples) -> Vec<f32> {
    let at = |i: usize| (i / control.width * main.width + i % control.width) * control.stride;
    (0..control.pixels()).map(|i| (control.luminance(i) - main.luminance(at(i))) as f32).collect()
}
