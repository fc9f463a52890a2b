//! A field on the device: its grid fills in batches, and the volume to look at is renewed each time their number has doubled.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::context::DeviceContext;
use super::pace::Pace;
use crate::device::{Buffer, DeviceInfo};
use crate::error::Result;
use crate::technique::photon_transport::FieldPass;
use crate::technique::{Field, FieldPlan};
use crate::volume::Volume;

/// Batches of equal size: enough for the standard errors of the ledger, and a power of two for the doublings.
const BATCHES: u64 = 32;
/// Pictures that are made while a field fills, each time the batches have doubled, besides the last.
pub const PICTURES_ON_THE_WAY: u32 = BATCHES.ilog2();

/// Histories of a work-item where items are many: enough that launching an item does not count.
const HISTORIES_PER_ITEM: usize = 32;
/// Times that an item with a grid of its own comes for histories, if all are as fast: so that none works long after the others.
const SHARES_PER_ITEM: u64 = 64;
/// The grids of all items together take at most this.
const OWN_GRIDS_BYTES: usize = 1 << 27;

/// How many items work at a time with a grid each, where lanes say that the device is a CPU and the grids fit.
fn own_grids(info: &DeviceInfo, cells: usize) -> Option<usize> {
    let items = info.compute_units as usize;
    (info.lanes > 1 && 8 * cells * items <= OWN_GRIDS_BYTES).then_some(items)
}

/// A field at work.
pub(super) struct FieldRun {
    field: Arc<dyn Field>,
    plan: FieldPlan,
    table: Buffer,
    parameters: Buffer,
    pass: Buffer,
    grid: Buffer,
    /// How many items have a grid of their own; none where one is shared.
    grids: Option<usize>,
    ledger: Buffer,
    /// The ledger's sums after the last batch, and what each batch added.
    ledger_before: Vec<u64>,
    ledgers: Vec<Vec<u64>>,
    done: u64,
    pace: Pace,
    pub device_time: Duration,
}

impl FieldRun {
    /// Begins what `plan` says, whose kernel is built.
    pub fn new(context: &mut DeviceContext, field: &Arc<dyn Field>, plan: FieldPlan) -> Result<Self> {
        let device = &context.device;
        let table = device.upload(bytemuck::cast_slice(&plan.table), 8)?;
        let parameters = device.upload(&plan.parameters, 0)?;
        let pass = device.allocate(size_of::<FieldPass>())?;
        let grids = own_grids(device.info(), plan.cells);
        let grid = device.upload(&vec![0; 8 * plan.cells * grids.unwrap_or(1)], 0)?;
        // Behind the ledger is the number of histories that items have taken.
        let ledger = device.upload(&vec![0; 8 * (plan.ledger + 1)], 0)?;
        let ledger_before = vec![0; plan.ledger];
        let (ledgers, done, device_time) = (Vec::new(), 0, Duration::ZERO);
        let pace = Pace::new(device.info(), 1.0, None);
        Ok(Self {
            field: field.clone(),
            plan,
            table,
            parameters,
            pass,
            grid,
            grids,
            ledger,
            ledger_before,
            ledgers,
            done,
            pace,
            device_time,
        })
    }

    pub fn reasons(&self) -> &[String] {
        &self.plan.reasons
    }

    pub fn is_done(&self) -> bool {
        self.done >= self.plan.histories
    }

    /// The first history after batch `batch`.
    fn batch_end(&self, batch: usize) -> u64 {
        let batches = BATCHES.min(self.plan.histories);
        (u128::from(self.plan.histories) * (batch as u128 + 1) / u128::from(batches)) as u64
    }

    /// Works for about `slice`; `true` when the number of finished batches has reached a power of two.
    pub fn slice(&mut self, context: &mut DeviceContext, slice: Duration) -> Result<bool> {
        let info = context.device.info();
        let (stride, wanted) = match self.grids {
            // A few items that take histories as long as there are any: their lanes are refilled until the last.
            Some(grids) => (info.local_size, grids),
            None => (1, self.pace.items(info, slice, HISTORIES_PER_ITEM)),
        };
        let end = self.batch_end(self.ledgers.len());
        let fits = self.pace.items(info, slice, 1) as u64;
        let count = fits.max(wanted as u64).min(end - self.done);
        let shares = wanted as u64 * if self.grids.is_some() { SHARES_PER_ITEM } else { 1 };
        let per_item = count.div_ceil(shares).max(u64::from(info.lanes));
        let seed = self.field.seed();
        let pass = FieldPass {
            first: [self.done as u32, (self.done >> 32) as u32],
            count: count as u32,
            per_item: per_item as u32,
            stride: stride as u32,
            own_grids: self.grids.is_some().into(),
            taken_at: self.plan.ledger as i32,
            seed: [seed as u32, (seed >> 32) as u32],
        };
        context.device.write(&mut self.pass, 0, bytemuck::bytes_of(&pass))?;
        context.device.write(&mut self.ledger, 8 * self.plan.ledger, &[0; 8])?;
        let items = wanted.min(count.div_ceil(per_item) as usize) * stride;
        let arguments = [
            ("pass", &self.pass),
            ("params", &self.parameters),
            ("table", &self.table),
            ("grid", &self.grid),
            ("ledger", &self.ledger),
        ];
        let took = context.device.run(&self.plan.variant, &arguments, items)?;
        self.pace.learn(count as usize, 1, took);
        self.device_time += took;
        self.done += count;
        if self.done < end {
            return Ok(false);
        }
        self.close_batch(context)?;
        Ok(self.is_done() || self.ledgers.len().is_power_of_two())
    }

    /// Ends the simulation with what there is.
    pub fn cut(&mut self, context: &DeviceContext) -> Result<()> {
        self.plan.histories = self.done;
        self.close_batch(context)
    }

    fn close_batch(&mut self, context: &DeviceContext) -> Result<()> {
        let mut sums = vec![0u64; self.plan.ledger];
        context.device.read(&self.ledger, 0, &mut sums)?;
        self.ledgers
            .push(sums.iter().zip(&self.ledger_before).map(|(now, before)| now.wrapping_sub(*before)).collect());
        self.ledger_before = sums;
        Ok(())
    }

    /// The volume and the result so far.
    pub fn finish(&self, context: &DeviceContext) -> Result<(Arc<Volume>, Value)> {
        let mut grid = vec![0u64; self.plan.cells * self.grids.unwrap_or(1)];
        context.device.read(&self.grid, 0, &mut grid)?;
        let (sums, others) = grid.split_at_mut(self.plan.cells);
        for own in others.chunks_exact(self.plan.cells) {
            sums.iter_mut().zip(own).for_each(|(sum, v)| *sum = sum.wrapping_add(*v));
        }
        grid.truncate(self.plan.cells);
        let result = self.field.finish(&grid, &self.ledgers, self.done)?;
        let mut value = result.result;
        value["photons_per_ms"] = (self.done as f64 / self.device_time.as_secs_f64().max(1e-9) / 1e3).into();
        Ok((Arc::new(result.volume), value))
    }
}
