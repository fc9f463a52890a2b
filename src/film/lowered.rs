//! The quality that a picture lacks because it had to come in time.

/// What a frame has less of than was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lowered {
    /// Pixels that a sample stands for, along a side.
    pub stride: u32,
    /// The step, of the one that was asked for.
    pub step: f32,
}

impl Default for Lowered {
    fn default() -> Self {
        Self { stride: 1, step: 1.0 }
    }
}

impl Lowered {
    /// True if it lacks nothing.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// In words, for a reader.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.stride > 1 {
            words.push(format!("resolution: one pixel in {}", self.stride * self.stride));
        }
        if self.step > 1.0 {
            words.push(format!("step: {} times as long", self.step));
        }
        words
    }
}
