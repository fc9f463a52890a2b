//! The sets of samples that a probe takes.

use crate::film::{FIRST_PROBED, MOST_FOR_STEP, probed_samples};
use crate::technique::LONGEST_STEP_VOXELS;

/// The most samples of a pixel in a pass.
pub const MOST: u32 = 64;
/// The longest of the shorter steps, in voxels. What is thinner than a step may be missed by half of it, too.
const LONGEST_FINE: f32 = 0.5;

/// A step of a set of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    Same,
    Fine,
    Twice,
}

/// The sets of samples: the step of each, and its random stream. The picture has stream 0, a moving picture 2. Of few samples there are not all sets.
pub const KINDS: [(Step, u32); 5] =
    [(Step::Same, 3), (Step::Fine, 3), (Step::Same, 4), (Step::Fine, 4), (Step::Twice, 3)];
pub const QUICK_KINDS: usize = 2;
/// The sets, by their places in [`KINDS`].
pub const SAME: [usize; 2] = [0, 2];
pub const FINE: [usize; 2] = [1, 3];
pub const TWICE: usize = 4;

/// The step of a picture, world units, whether it plays a part, the smallest voxel side, and whether rays of other steps go to their end, where the
/// picture's end early.
#[derive(Debug, Clone, Copy)]
pub struct Steps {
    pub step: f32,
    pub stepless: bool,
    pub smallest_side: f32,
    pub to_the_end: bool,
}

impl Steps {
    /// True if a step may pass over what the grid holds. What it misses is rare, and many pixels are to look for it.
    pub fn is_coarse(&self) -> bool {
        !self.stepless && f64::from(self.step) > LONGEST_STEP_VOXELS * f64::from(self.smallest_side)
    }

    pub fn of(&self, step: Step) -> f32 {
        match step {
            Step::Same => self.step,
            Step::Fine => (0.5 * self.step).min(LONGEST_FINE * self.smallest_side),
            Step::Twice => 2.0 * self.step,
        }
    }
}

/// A set of samples of the probe's pixels.
pub struct Set {
    pub step: Step,
    pub stream: u32,
    /// Its clusters are every so many of the probe's, each way.
    pub sparse: usize,
    pub samples: u32,
    /// The sum of luminance of every pixel.
    pub sums: Vec<f64>,
    /// The mean after as many samples as judge the step.
    pub early: Vec<f64>,
}

impl Set {
    pub fn mean(&self, pixel: usize) -> f64 {
        self.sums[pixel] / f64::from(self.samples)
    }

    /// The samples that it should have beside a picture of `samples` samples.
    pub fn wanted(&self, samples: u32) -> u32 {
        probed_samples(samples, if self.step == Step::Same { samples } else { MOST_FOR_STEP })
    }

    /// The samples of its next pass. They are the same whenever it is run, so that the error is, too.
    pub fn next(&self) -> u32 {
        if self.samples == 0 { FIRST_PROBED } else { self.samples.min(MOST) }
    }
}
