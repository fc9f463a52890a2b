//! A field on the device: its grid fills in batches, and the volume to look at is renewed each time their number has doubled.

use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::context::{DeviceContext, warm};
use super::pace::Pace;
use crate::device::Buffer;
use crate::error::{Error, Result};
use crate::technique::photon_transport::FieldPass;
use crate::technique::{self, Field, FieldPlan};
use crate::volume::Volume;

/// Batches of equal size: enough for the standard errors of the ledger, and a power of two for the doublings.
const BATCHES: u64 = 32;

/// A field at work.
pub(super) struct FieldRun {
    field: Arc<dyn Field>,
    plan: FieldPlan,
    table: Buffer,
    parameters: Buffer,
    pass: Buffer,
    grid: Buffer,
    ledger: Buffer,
    /// The ledger's sums after the last batch, and what each batch added.
    ledger_before: Vec<u64>,
    ledgers: Vec<Vec<u64>>,
    done: u64,
    pace: Pace,
    pub device_time: Duration,
}

impl FieldRun {
    pub fn new(context: &mut DeviceContext, field: &Arc<dyn Field>) -> Result<Self> {
        let plan = field.plan()?;
        let technique = technique::find(plan.variant.kernel);
        let source = technique.ok_or_else(|| Error::internal("a field whose kernel is no technique's"))?.source;
        warm(&mut context.device, &source(), &plan.variant)?;
        let device = &context.device;
        let table = device.upload(bytemuck::cast_slice(&plan.table), 8)?;
        let parameters = device.upload(&plan.parameters, 0)?;
        let pass = device.allocate(size_of::<FieldPass>())?;
        let grid = device.upload(&vec![0; 8 * plan.cells], 0)?;
        let ledger = device.upload(&vec![0; 8 * plan.ledger], 0)?;
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
        // A lane takes several histories one after the other, so that lanes which end early are refilled; but every core gets at
        // least two work-groups of a slice.
        let groups = 2 * info.compute_units as usize;
        let fits = self.pace.items(info, slice, info.lanes as usize) / (info.local_size * groups);
        let per_lane = (fits as u32).clamp(1, self.plan.histories_per_lane);
        let per_item = u64::from(info.lanes * per_lane);
        let end = self.batch_end(self.ledgers.len());
        let items = self.pace.items(info, slice, per_item as usize) as u64;
        let count = (items * per_item).min(end - self.done);
        let seed = self.field.seed();
        let pass = FieldPass {
            first: [self.done as u32, (self.done >> 32) as u32],
            count: count as u32,
            per_lane,
            seed: [seed as u32, (seed >> 32) as u32],
        };
        context.device.write(&mut self.pass, 0, bytemuck::bytes_of(&pass))?;
        let items = count.div_ceil(per_item) as usize;
        let arguments = [&self.pass, &self.parameters, &self.table, &self.grid, &self.ledger];
        let took = context.device.run(&self.plan.variant, &arguments, items)?;
        self.pace.learn(items, per_item as usize, took);
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
        let mut grid = vec![0u64; self.plan.cells];
        context.device.read(&self.grid, 0, &mut grid)?;
        let result = self.field.finish(&grid, &self.ledgers, self.done)?;
        let mut value = result.result;
        value["photons_per_ms"] = (self.done as f64 / self.device_time.as_secs_f64().max(1e-9) / 1e3).into();
        Ok((Arc::new(result.volume), value))
    }
}
