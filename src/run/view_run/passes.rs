//! The passes of a view: the choice of the next one, and a slice of it.

use std::time::Duration;

use super::ViewRun;
use crate::device::structs::View as DeviceView;
use crate::error::Result;
use crate::run::context::DeviceContext;
use crate::run::gathered::Pass;
use crate::run::layer::Layer;

/// The shortest slice that tells the speed of a kernel. Shorter slices each wait for their longest rays.
const TELLING_SLICE: Duration = Duration::from_millis(10);

impl ViewRun {
    /// Works for about `slice` and returns the pass that it finished, if any.
    pub fn slice(&mut self, context: &mut DeviceContext, slice: Duration) -> Result<Option<Pass>> {
        let pass = match self.pass {
            Some(pass) => pass,
            None => self.begin(context)?,
        };
        let (beams, rays) = self.gathered.layer(pass).items(context.device.info().lanes as usize);
        let (items, before) = match self.undone.take() {
            Some(undone) => undone,
            None => (self.items(&context.device, slice, rays).min(beams - self.cursor), Duration::ZERO),
        };
        let took = self.launch(&context.device, pass, items, slice, before > Duration::ZERO)?;
        self.device_time += took;
        self.pass_time += took;
        self.shortest_slice = self.shortest_slice.min(slice);
        if self.is_bounded(&context.device) && self.resume.has_more() {
            self.undone = Some((items, before + took));
            return Ok(None);
        }
        self.slice_length.learn(items, rays, before + took);
        self.cursor += items;
        if self.cursor < beams {
            return Ok(None);
        }
        if let (Pass::Moving, Some(moving)) = (pass, &self.gathered.moving) {
            let [width, height] = self.gathered.size;
            self.ray_ms = Some(moving.ray_ms(self.pass_time.as_secs_f64() * 1e3, width * height));
        }
        if pass == Pass::Main {
            self.ray_ms = None;
            let [width, height] = self.gathered.size;
            if self.shortest_slice >= TELLING_SLICE {
                context.measured(&self.plan.variant, width * height, self.pass_time);
            }
        }
        (self.pass, self.cursor) = (None, 0);
        if pass == Pass::Probe {
            self.gathered.probe_passed(context)?;
            return Ok(Some(pass));
        }
        self.gathered.layer_mut(pass).passed();
        if pass == Pass::Main {
            self.gathered.keep_round(context, self.device_time)?;
        }
        Ok(Some(pass))
    }

    /// Chooses the next pass.
    fn begin(&mut self, context: &DeviceContext) -> Result<Pass> {
        self.gathered.will_change();
        let samples = self.samples();
        let pass = self.gathered.next_pass(self.is_followed && !self.quick, self.wants_error());
        let adaptive = pass == Pass::Main && self.random.is_some_and(|r| r.adaptive);
        self.gathered.layer_mut(pass).choose_tiles(context, adaptive)?;
        if pass == Pass::Main && samples == 0 {
            // The counts are of the picture, not of its preview.
            context.device.write(&mut self.gathered.counts, 0, &[0; 32])?;
        }
        if pass == Pass::Probe {
            self.gathered.begin_probe(context)?;
        }
        self.pass_view = self.view_of(self.gathered.layer(pass));
        self.pass = Some(pass);
        (self.pass_time, self.shortest_slice) = (Duration::ZERO, Duration::MAX);
        Ok(pass)
    }

    /// The device's view for a pass.
    fn view_of(&self, layer: &Layer) -> DeviceView {
        let [width, height] = layer.film_size().map(|n| n as i32);
        let held = if layer.batch.is_some() { 0 } else { layer.samples as i32 };
        DeviceView {
            width,
            height,
            stride: layer.picture_stride as i32,
            sample: layer.samples as i32,
            held,
            batch: layer.batch.map_or([0; 2], |b| [b.across as i32, b.down as i32]),
            own_places: (layer.batch.is_some() || self.scene.has_own_places()).into(),
            origin: layer.origin.map(|n| (n * (layer.picture_stride / layer.stride)) as i32),
            cluster: layer.batch.map_or(0, |b| b.cluster as i32),
            stream: layer.stream,
            offset: self.places.at(layer.samples).to_array(),
            step: layer.step,
            ..self.view
        }
    }

    /// True if the error is asked for before there are many samples: of a picture that somebody watches, or that may be the last one.
    fn wants_error(&self) -> bool {
        let budget = self.scene.budget();
        let may_stop = budget.max_error.is_some() || budget.time_ms.is_some() || budget.samples <= self.samples();
        self.is_followed || may_stop
    }

    /// True if the error of the picture is about to be known better.
    pub fn owes_probe(&self) -> bool {
        self.gathered.owes_probe(self.wants_error())
    }
}
