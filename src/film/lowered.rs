//! The loss of quality of a picture that had to come in time.

/// The reductions of a frame against the one that was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lowered {
    /// The number of pixels along a side that one sample stands for.
    pub stride: u32,
    /// The step as a multiple of the one that was asked for.
    pub step: f32,
}

impl Default for Lowered {
    fn default() -> Self {
        Self { stride: 1, step: 1.0 }
    }
}

impl Lowered {
    /// True if nothing is reduced.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The reductions in words, for a reader.
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
