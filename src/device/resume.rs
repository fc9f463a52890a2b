//! Launches that are bounded in steps: what a work-item has not done by then it does in the next launch (`kernels/shared/resume.h`).

use std::time::Duration;

use super::numbers::define;
use super::{Buffer, Device};
use crate::error::Result;

/// Words before the work-items' own, and before the lanes' words of each: `RESUME_HEADER`.
const HEADER: usize = 16;
/// Fewer or more steps than these are not worth a launch or cannot be counted.
const STEPS: [u32; 2] = [1 << 6, 1 << 28];
/// The state of all work-items of a launch takes at most about this.
const MOST_BYTES: usize = 1 << 26;
/// By how much the steps change from one launch to the next, at most.
const CHANGE: [f64; 2] = [0.25, 4.0];

/// The state of work-items between launches, and how many steps a launch may take.
pub struct Resume {
    state: Buffer,
    /// Words of a lane.
    words: usize,
    steps: u32,
    /// How often work-items have had more to do, as the state counts it.
    counted: u32,
    has_more: bool,
}

impl Resume {
    /// For a kernel whose lanes keep so many words.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device has no room.
    pub fn new(device: &Device, words: usize) -> Result<Self> {
        let state = device.upload(&[0; 4 * HEADER], 0)?;
        Ok(Self { state, words, steps: device.first_steps(), counted: 0, has_more: false })
    }

    /// The `#define` of a kernel's state, `{name}_STATE_WORDS`: words of a lane.
    pub fn opencl_text(name: &str, words: usize) -> String {
        define("RESUME_HEADER", HEADER) + &define(&format!("{name}_STATE_WORDS"), words)
    }

    /// The same of a kernel whose work-item is a beam of packets: words of a lane for each packet.
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

    /// True if work-items of the last launch have more to do: the next one has to be of the same, and resume them.
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

    /// Makes ready for a launch of `items` work-items.
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

    /// Learns whether a launch has left anything undone, and how many steps fit in `slice` where it took so long.
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
