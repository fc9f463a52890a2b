//! The distances of macro-cells for a view's kernel: from each cell to anything that the view shows.

use std::rc::Rc;

use super::context::DeviceContext;
use super::device_volume::DeviceVolume;
use crate::device::Buffer;
use crate::error::Result;
use crate::scene::interpolation::Interpolation;
use crate::technique::{CellUse, ViewPlan};
use crate::volume::Volume;

/// The distance of each cell from the values that the plan shows. They are all 0 if nothing is skipped, and `None` if the kernel reads the cells'
/// ranges instead.
pub(super) fn distances(
    context: &mut DeviceContext,
    on_device: &DeviceVolume,
    volume: &Volume,
    plan: &mut ViewPlan,
) -> Result<Option<Rc<Buffer>>> {
    let [wide, high, deep] = on_device.cells.dims();
    let values = match &plan.cells {
        CellUse::Distances(values) => values,
        CellUse::Ranges => return Ok(None),
        CellUse::None => return context.device.upload(&vec![0; wide * high * deep], 0).map(|zero| Some(Rc::new(zero))),
    };
    // Raw values, rounded outwards.
    let raw = |v: f64| (v - volume.inter()) / volume.slope();
    let intervals: Vec<[f32; 2]> = values
        .iter()
        .map(|&[low, high]| {
            let ends = [raw(low).min(raw(high)) as f32, raw(low).max(raw(high)) as f32];
            [ends[0].next_down(), ends[1].next_up()]
        })
        .collect();
    // Catmull-Rom's weights sum to 1 and their magnitudes to at most 1.25 along an axis: (1.25³ − 1) / 2 of the range.
    let overshoot =
        if plan.variant.features.contains(&("INTERPOLATION", Interpolation::CatmullRom.code())) { 0.477 } else { 0.0 };
    let distances = on_device.distances(&mut context.device, &intervals, overshoot)?;
    plan.reasons.push(format!("{} of {} macro-cells are empty under it", distances.empty, wide * high * deep));
    Ok(Some(distances.buffer))
}
