//! The simulation on the device. Its grid fills in batches of photons, and a look is due each time their number has doubled.

use std::sync::Arc;
use std::time::Duration;

use super::Simulation;
use super::device::{FieldPass, STATE_WORDS};
use super::plan::DevicePlan;
use super::report::Ledgers;
use crate::device::{Buffer, Device, DeviceInfo, Resume, SliceLength, grid};
use crate::error::Result;
use crate::technique::{Look, Process, Progress, Step};

/// Batches of equal size: enough for the standard errors of the ledger, and a power of two for the doublings.
const BATCHES: u64 = 32;
/// The number of looks that are due while the grid fills, each time the batches have doubled, besides the last.
pub const LOOKS_ON_THE_WAY: u32 = BATCHES.ilog2();

/// Photons of a work-item if there are many items: enough that the launch of an item does not count.
const PHOTONS_PER_ITEM: usize = 32;
/// The number of shares that an item with its own grid takes if all are equally fast, so that none works long after the others.
const SHARES_PER_ITEM: u64 = 64;
/// The most bytes of the grids of all items together.
const OWN_GRIDS_BYTES: usize = 1 << 27;

/// The number of items that work at a time with their own grids; `None` unless the lanes show that the device is a CPU and the grids fit.
fn own_grids(info: &DeviceInfo, cells: usize) -> Option<usize> {
    let items = info.compute_units as usize;
    (info.lanes > 1 && 8 * cells * items <= OWN_GRIDS_BYTES).then_some(items)
}

/// A simulation at work.
pub(super) struct Run {
    simulation: Arc<Simulation>,
    plan: DevicePlan,
    table: Buffer,
    parameters: Buffer,
    pass: Buffer,
    grid: Buffer,
    /// The number of items that have their own grids; `None` if one grid is shared.
    grids: Option<usize>,
    ledger: Buffer,
    /// The ledger's sums after the last batch, and each batch's part of them.
    ledger_before: Vec<u64>,
    ledgers: Vec<Vec<u64>>,
    /// The photons that are done, and the batches that are complete.
    done: u64,
    total: u64,
    slice_length: SliceLength,
    resume: Resume,
    /// The launch whose photons are not all done.
    launch: Option<Launch>,
    device_time: Duration,
}

/// Photons that are launched together, in one or several launches of the kernel.
struct Launch {
    pass: FieldPass,
    items: usize,
    /// Time on the device so far.
    took: Duration,
}

impl Run {
    /// Allocates the buffers of a simulation whose kernel is built.
    pub fn new(device: &Device, simulation: Arc<Simulation>) -> Result<Self> {
        let plan = simulation.take_plan()?;
        let grids = own_grids(device.info(), plan.cells);
        Ok(Self {
            table: device.upload(bytemuck::cast_slice(&plan.table), 8)?,
            parameters: device.upload(&plan.parameters, 0)?,
            pass: device.allocate(size_of::<FieldPass>())?,
            grid: device.upload(&vec![0; 8 * plan.cells * grids.unwrap_or(1)], 0)?,
            grids,
            // Behind the ledger stands the number of photons that items have taken.
            ledger: device.upload(&vec![0; 8 * (plan.ledger + 1)], 0)?,
            ledger_before: vec![0; plan.ledger],
            ledgers: Vec::new(),
            done: 0,
            total: simulation.parameters.photons,
            slice_length: SliceLength::new(device.info(), 1.0, None),
            resume: Resume::new(device, STATE_WORDS)?,
            launch: None,
            device_time: Duration::ZERO,
            simulation,
            plan,
        })
    }

    /// The first photon after batch `batch`.
    fn batch_end(&self, batch: usize) -> u64 {
        let batches = BATCHES.min(self.total);
        (u128::from(self.total) * (batch as u128 + 1) / u128::from(batches)) as u64
    }

    fn close_batch(&mut self, device: &Device) -> Result<()> {
        let mut sums = vec![0u64; self.plan.ledger];
        device.read(&self.ledger, 0, &mut sums)?;
        let added = sums.iter().zip(&self.ledger_before).map(|(now, before)| now.wrapping_sub(*before)).collect();
        self.ledgers.push(added);
        self.ledger_before = sums;
        Ok(())
    }

    /// The next launch: photons for about `slice`, up to the end of the batch at `end`.
    fn next_launch(&self, info: &DeviceInfo, slice: Duration, end: u64) -> Launch {
        let (stride, wanted) = match self.grids {
            // A few items take photons from a shared queue until it is empty. Their lanes are refilled until then.
            Some(grids) => (info.local_size, grids),
            None => (1, self.slice_length.items(info, slice, PHOTONS_PER_ITEM)),
        };
        let fits = self.slice_length.items(info, slice, 1) as u64;
        let count = fits.max(wanted as u64).min(end - self.done);
        let shares = wanted as u64 * if self.grids.is_some() { SHARES_PER_ITEM } else { 1 };
        let per_item = count.div_ceil(shares).max(u64::from(info.lanes));
        let seed = self.simulation.parameters.seed;
        let pass = FieldPass {
            first: [self.done as u32, (self.done >> 32) as u32],
            count: count as u32,
            per_item: per_item as u32,
            stride: stride as u32,
            own_grids: self.grids.is_some().into(),
            taken_at: self.plan.ledger as i32,
            most_steps: 0,
            resumed: 0,
            seed: [seed as u32, (seed >> 32) as u32],
        };
        Launch { pass, items: wanted.min(count.div_ceil(per_item) as usize) * stride, took: Duration::ZERO }
    }

    /// Works for about `slice` on the photons of `launch`. Returns it if some are not done.
    fn work(&mut self, device: &Device, slice: Duration, mut launch: Launch) -> Result<Option<Launch>> {
        launch.pass.most_steps = self.resume.steps();
        device.write(&mut self.pass, 0, bytemuck::bytes_of(&launch.pass))?;
        self.resume.before(device, launch.items)?;
        let arguments = [
            ("pass", &self.pass),
            ("params", &self.parameters),
            ("table", &self.table),
            ("grid", &self.grid),
            ("ledger", &self.ledger),
            ("state", self.resume.state()),
        ];
        let took = device.run(&self.plan.variant, &arguments, launch.items)?;
        self.resume.after(device, slice, took)?;
        self.device_time += took;
        launch.took += took;
        if self.resume.has_more() {
            launch.pass.resumed = 1;
            return Ok(Some(launch));
        }
        self.slice_length.learn(launch.pass.count as usize, 1, launch.took);
        self.done += u64::from(launch.pass.count);
        Ok(None)
    }
}

impl Process for Run {
    type Look = Look;

    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step> {
        let end = self.batch_end(self.ledgers.len());
        let before = self.device_time;
        let launch = match self.launch.take() {
            Some(launch) => launch,
            None => {
                device.write(&mut self.ledger, 8 * self.plan.ledger, &[0; 8])?;
                self.next_launch(device.info(), slice, end)
            }
        };
        self.launch = self.work(device, slice, launch)?;
        let ends_batch = self.done >= end;
        if ends_batch {
            self.close_batch(device)?;
        }
        Ok(Step {
            progress: Progress { of: "photons", done: self.done, total: self.total },
            device_time: self.device_time - before,
            is_whole: self.launch.is_none(),
            is_look_due: ends_batch && self.ledgers.len().is_power_of_two(),
        })
    }

    fn stop(&mut self, device: &mut Device) -> Result<()> {
        self.close_batch(device)
    }

    fn look(&mut self, device: &mut Device) -> Result<Look> {
        let (size, scale) = ([self.plan.cells, self.grids.unwrap_or(1)], self.simulation.per_photon(self.done));
        let (voxels, near_overflow) = grid::of_sums(device, &self.grid, size, scale)?;
        let mut result = self.simulation.report(&Ledgers::new(&self.ledgers, self.done), near_overflow);
        let ms = 1e3 * self.device_time.as_secs_f64().max(1e-9);
        result["photons_per_ms"] = (self.done as f64 / ms).into();
        Ok(Look { voxels, result })
    }
}
