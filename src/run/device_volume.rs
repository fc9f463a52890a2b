//! A volume on the device, with the tables and distances that views have needed: a client that turns a camera asks for the same again and again.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use crate::device::cells::Cells;
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::technique::PreparedView;

/// The number of entries of each kind that are kept for a volume.
const KEPT: usize = 8;

/// The bytes that a kernel may read behind a table.
const TABLE_PADDING: usize = 8;

/// The most recent values with their keys. The last one used comes last.
struct Kept<K, V>(RefCell<Vec<(K, V)>>);

impl<K: PartialEq, V: Clone> Kept<K, V> {
    fn get_or_make(&self, key: K, make: impl FnOnce() -> Result<V>) -> Result<V> {
        let mut kept = self.0.borrow_mut();
        let used = match kept.iter().position(|(other, _)| *other == key) {
            Some(at) => kept.remove(at),
            None => (key, make()?),
        };
        if kept.len() == KEPT {
            kept.remove(0);
        }
        let value = used.1.clone();
        kept.push(used);
        Ok(value)
    }
}

/// A volume on the device.
pub(super) struct DeviceVolume {
    pub voxels: Arc<Buffer>,
    pub cells: Cells,
    /// Distances by intervals of raw values and by the overshoot, as bits.
    distances: Kept<(Vec<[u32; 2]>, u32), Distances>,
    /// Tables by a technique's own parameters and by the step, as bits.
    tables: Kept<(Arc<str>, u32), Rc<Buffer>>,
}

/// The distances of macro-cells, and the number of empty ones.
#[derive(Clone)]
pub(super) struct Distances {
    pub buffer: Rc<Buffer>,
    pub empty: usize,
}

impl DeviceVolume {
    pub fn new(voxels: Arc<Buffer>, cells: Cells) -> Self {
        Self { voxels, cells, distances: Kept(RefCell::default()), tables: Kept(RefCell::default()) }
    }

    pub fn bytes(&self) -> usize {
        self.voxels.len() + self.cells.ranges.len()
    }

    /// The distance of each cell from a value in `intervals`: [`Cells::distances`].
    pub fn distances(&self, device: &mut Device, intervals: &[[f32; 2]], overshoot: f32) -> Result<Distances> {
        let key = (intervals.iter().map(|ends| ends.map(f32::to_bits)).collect(), overshoot.to_bits());
        self.distances.get_or_make(key, || {
            let buffer = self.cells.distances(device, intervals, overshoot)?;
            let mut bytes = vec![0u8; self.cells.dims().iter().product()];
            device.read(&buffer, 0, &mut bytes)?;
            Ok(Distances { buffer: Rc::new(buffer), empty: bytes.iter().filter(|d| **d > 0).count() })
        })
    }

    /// The table of a view of this volume for a step; `own` is the technique with its own parameters.
    pub fn table(&self, device: &Device, own: &Arc<str>, view: &dyn PreparedView, step: f32) -> Result<Rc<Buffer>> {
        self.tables.get_or_make((own.clone(), step.to_bits()), || upload_table(device, view, step))
    }
}

/// Uploads the table of a view for a step.
pub(super) fn upload_table(device: &Device, view: &dyn PreparedView, step: f32) -> Result<Rc<Buffer>> {
    device.upload(bytemuck::cast_slice(&view.table(step)), TABLE_PADDING).map(Rc::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_again_is_made_once_and_what_is_not_goes() {
        let (kept, mut made) = (Kept(RefCell::default()), Vec::new());
        let mut get = |key: usize| {
            let value = kept.get_or_make(key, || {
                made.push(key);
                Ok(10 * key)
            });
            assert_eq!(value.ok(), Some(10 * key));
        };
        // 0 is asked for between all others.
        (1..=2 * KEPT).for_each(|key| [0, key].map(&mut get).into_iter().for_each(drop));
        get(1);
        assert_eq!(made, (0..=2 * KEPT).chain([1]).collect::<Vec<_>>());
        assert_eq!(kept.0.borrow().len(), KEPT);
    }
}
