//! Scenes as pilots: what the planner renders, unseen, to know a picture before it is made.

use super::Scene;
use super::budget::Budget;
use super::region::Region;

/// What is different in a pilot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pilot {
    region: Region,
    own_places: bool,
    probed: bool,
}

impl Scene {
    /// The scene as a pilot: only these pixels of the picture, with this number of samples, and with the pictures after fewer samples.
    pub(crate) fn into_pilot(self, region: Region, samples: u32) -> Self {
        let budget = Budget { samples, time_ms: None, max_error: None };
        Self { pilot: Some(Pilot { region, own_places: false, probed: false }), budget, ..self }
    }

    /// The pilot with the probe that its picture would have.
    pub(crate) fn with_probe(self) -> Self {
        Self { pilot: self.pilot.map(|pilot| Pilot { probed: true, ..pilot }), ..self }
    }

    /// The pilot with places of its own in each pixel. Those of random paths are shared anyway.
    pub(crate) fn with_own_places(self) -> Self {
        Self { pilot: self.pilot.map(|pilot| Pilot { own_places: true, ..pilot }), ..self }
    }

    /// The same scene with another seed, but with the same places in a pixel: a pilot's have the picture's error.
    pub(crate) fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// True if it has only some of its pixels, for a planner.
    pub(crate) fn is_pilot(&self) -> bool {
        self.pilot.is_some()
    }

    /// True if it has a probe, were its samples spread evenly.
    pub(crate) fn is_probed(&self) -> bool {
        self.pilot.is_none_or(|pilot| pilot.probed)
    }

    /// True if each pixel has places of its own.
    pub(crate) fn has_own_places(&self) -> bool {
        self.pilot.is_some_and(|pilot| pilot.own_places)
    }

    /// The pixels of the picture that it has: all of them, except for a pilot.
    pub(crate) fn region(&self) -> Region {
        self.pilot.map_or(Region::every(1, self.image), |pilot| pilot.region)
    }
}
