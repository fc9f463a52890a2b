//! One launch of a view's kernel: its work-items, its bound in steps, and its arguments.

use std::time::Duration;

use super::ViewRun;
use crate::device::Device;
use crate::error::Result;
use crate::run::gathered::Pass;
use crate::run::probe::Probe;

/// The greatest number of packets of a beam. Rays of so many times fewer steps than a work-item may take are not bounded.
const PACKETS: u32 = 4;
impl ViewRun {
    /// The work-items of a launch for about `slice`.
    pub(super) fn items(&self, device: &Device, slice: Duration, rays: usize) -> usize {
        let items = self.slice_length.items(device.info(), slice, rays);
        if self.is_bounded(device) { items.min(self.resume.most_items(device)) } else { items }
    }

    /// True if a work-item may have more to do than fits in a launch: random paths, or rays of very many steps.
    pub(super) fn is_bounded(&self, device: &Device) -> bool {
        let (steps, most) = (self.longest / f64::from(self.plan.step), f64::from(device.first_steps() / PACKETS));
        self.plan.state_words > 0 && (self.is_random() || steps > most)
    }

    /// Runs `items` work-items of the pass, from the cursor on, or continues the work that their last launch has left.
    pub(super) fn launch(
        &mut self,
        device: &Device,
        pass: Pass,
        items: usize,
        slice: Duration,
        resumed: bool,
    ) -> Result<Duration> {
        let bounded = self.is_bounded(device);
        self.pass_view.first_beam = self.cursor as i32;
        self.pass_view.most_steps = if bounded { self.resume.steps() } else { 0 };
        self.pass_view.resumed = resumed.into();
        device.write(&mut self.view_buffer, 0, bytemuck::bytes_of(&self.pass_view))?;
        if bounded {
            self.resume.before(device, items)?;
        }
        let layer = self.gathered.layer(pass);
        let goes_on = pass == Pass::Probe && self.gathered.probe.as_ref().is_some_and(Probe::goes_to_the_end);
        let own = self.to_the_end.as_ref().filter(|_| goes_on).unwrap_or(&self.parameters);
        let mut arguments = vec![
            ("view", &self.view_buffer),
            ("params", own),
            ("table", &*layer.table),
            ("film", &layer.buffer),
            ("counts", self.gathered.counts(pass)),
        ];
        if let Some(volume) = &self.volume {
            arguments.push(("voxels", &volume.voxels));
            arguments.push(match &self.distances {
                Some(distances) => ("distances", &**distances),
                None => ("ranges", &volume.cells.ranges),
            });
        }
        arguments.extend(layer.tiles().map(|tiles| ("tiles", tiles)));
        arguments.extend((self.plan.state_words > 0).then(|| ("state", self.resume.state())));
        let took = device.run(&self.plan.variant, &arguments, items)?;
        if bounded {
            self.resume.after(device, slice, took)?;
        }
        Ok(took)
    }
}
