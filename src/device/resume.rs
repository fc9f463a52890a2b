//! Launches that are bounded in steps. A work-item continues its unfinished work in the next launch (`kernels/shared/resume.h`).

use std::time::Duration;

use super::numbers::define;
use super::{Buffer, Device};
use crate::error::Result;

/// Words before those of all work-items, and words of a work-item before its lanes': `RESUME_HEADER`.
const HEADER: usize = 16;
/// The range of steps: fewer are not worth a launch, and more cannot be counted.
const STEPS: [u32; 2] = [1 << 6, 1 << 28];
/// The approximate most bytes of the state of all work-items of a launch.
const MOST_BYTES: usize = 1 << 26;
/// The least and the greatest factor by which the steps change from one launch to the next.
const CHANGE: [f64; 2] = [0.25, 4.0];

/// The state of work-items between launches, and the number of steps of a launch.
pub struct Resume {
    state: Buffer,
    /// Words of a lane.
    words: usize,
    steps: u32,
    /// The number of times that work-items have had more to do, as the state counts it.
    counted: u32,
    has_more: bool,
}

impl Resume {
    /// The state of a kernel whose lanes keep `words` words.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room.
    pub fn new(device: &Device, words: usize) -> Result<Self> {
        let state = device.upload(&[0; 4 * HEADER], 0)?;
        Ok(Self { state, words, steps: device.first_steps(), counted: 0, has_more: false })
    }

    /// The `#define` of a kernel's state, `{name}_STATE_WORDS`: words of a lane.
    pub fn opencl_text(name: &str, words: usize) -> String {
        define("RESUME_HEADER", HEADER) + &define(&format!("{name}_STATE_WORDS"), words)
    }

    /// The same for a kernel whose work-item is a beam of packets: words of a lane for each packet.
    pub fn opencl_text_of_beams(name: &str, words: usize) -> String {
        define("RESUME_HEADER", HEADER) + &define(&format!("{name}_STATE_WORDS"), format!("({words} * PACKETS)"))
    }

    /// The kernel's `state`.
    pub fn state(&self) -> &Buffer {
        &self.state
    }

    /// Steps that a work-item may take in the next launch.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// True if work-items of the last launch have more to do. The next launch must be of the same work-items, and resume them.
    pub fn has_more(&self) -> bool {
        self.has_more
    }

    /// The most work-items of a launch: whole work-groups whose state has room.
    pub fn most_items(&self, device: &Device) -> usize {
        let local = device.info().local_size;
        (MOST_BYTES / self.bytes_per_item(device) / local).max(1) * local
    }

    fn bytes_per_item(&self, device: &Device) -> usize {
        4 * (HEADER + self.words * device.info().lanes as usize)
    }

    /// Prepares a launch of `items` work-items.
    ///
    /// # Errors
    /// As [`Resume::new`].
    pub fn before(&mut self, device: &Device, items: usize) -> Result<()> {
        let items = items.next_multiple_of(device.info().local_size);
        let bytes = 4 * HEADER + items * self.bytes_per_item(device);
        if self.state.len() < bytes {
            self.state = device.allocate(bytes)?;
            self.counted = 0;
            device.write(&mut self.state, 0, &[0; 4])?;
        }
        Ok(())
    }

    /// Notes if the launch has left work undone, and sets the steps of the next launch so that it fits in `slice`; `took` is the time of this one.
    ///
    /// # Errors
    /// As [`Device::read`].
    pub fn after(&mut self, device: &Device, slice: Duration, took: Duration) -> Result<()> {
        let mut counted = [0u32];
        device.read(&self.state, 0, &mut counted)?;
        self.has_more = counted[0] != self.counted;
        self.counted = counted[0];
        if self.has_more {
            let change = (slice.as_secs_f64() / took.as_secs_f64().max(1e-6)).clamp(CHANGE[0], CHANGE[1]);
            self.steps = ((f64::from(self.steps) * change) as u32).clamp(STEPS[0], STEPS[1]);
        }
        Ok(())
    }
}
