//! The pictures of a pilot after fewer samples, for the planner.

use std::sync::Arc;
use std::time::Duration;

use super::context::DeviceContext;
use super::layer::Layer;
use crate::error::Result;
use crate::film::{Round, pilot_rounds};

/// The rounds of a pilot's picture. Other pictures keep none.
pub(super) struct Rounds {
    pilot: bool,
    kept: Vec<Arc<Round>>,
}

impl Rounds {
    pub fn new(pilot: bool) -> Self {
        Self { pilot, kept: Vec::new() }
    }

    /// Forgets the rounds, as for another camera or step.
    pub fn forget(&mut self) {
        self.kept.clear();
    }

    /// Keeps the picture if its samples are as many as the pilot's next round has.
    pub fn passed(&mut self, context: &DeviceContext, layer: &Layer, device_time: Duration) -> Result<()> {
        let samples = layer.samples;
        if !self.pilot || pilot_rounds().nth(self.kept.len()) != Some(samples) {
            return Ok(());
        }
        let main = layer.read(context, false)?;
        let luminance = (0..main.pixels()).map(|i| main.luminance(i) as f32).collect();
        self.kept.push(Arc::new(Round { samples, device_ms: device_time.as_secs_f64() * 1e3, luminance }));
        Ok(())
    }

    /// All pictures that a pilot has kept.
    pub fn all(&self) -> Vec<Arc<Round>> {
        self.kept.clone()
    }
}
