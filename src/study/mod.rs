//! The study: speed against accuracy, and where methods fail.
//!
//! A [`Case`] is a scene with a truth that the technique under test had no part in: a closed form, a published table, a
//! double-precision reference of the host (`oracle`), or a long run of another unbiased technique. A [`Setting`] is a technique
//! with its options. Each is run with several seeds; `measure` says what it is wrong by, `fit` what its error follows.
//!
//! A technique joins with a file in `cases/` and a line in [`CASES`].

pub mod bench;
mod by_force;
pub mod cases;
pub mod draw;
pub mod experiments;
pub mod fit;
#[cfg(feature = "flip")]
pub mod flip;
pub mod measure;
pub mod oracle;
mod page;
pub mod planner;
pub mod record;
mod run;
pub mod shelf;
pub mod stability;
mod table;
pub mod verdict;

pub use cases::CASES;
pub use run::{ERRORS, machine, study};
pub use table::table;

use serde_json::{Value, json};

use crate::error::Result;
use bench::{Bench, Reads};

/// How much work is put into a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Seconds a case: the shape of the chart, fewer seeds and settings.
    Quick,
    /// Minutes a case: the committed numbers.
    Full,
}

impl Scale {
    /// One of two numbers.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        if self == Self::Quick { quick } else { full }
    }

    /// Runs with seeds of their own.
    pub fn runs(self) -> usize {
        self.pick(4, 8)
    }
}

/// A scene with a truth, and what is tried on it.
pub struct Case {
    /// Its name: of its file, and in `/v1/studies`.
    pub name: &'static str,
    /// What it is, in a line.
    pub title: &'static str,
    /// Of whom has a scene like it: "you have …",
    pub when: &'static str,
    /// and what to choose then, in plain words.
    pub choose: &'static str,
    /// Makes its truth and its settings; none where what it needs is not on this machine, with what that is.
    pub trial: fn(&Bench, Scale) -> Result<std::result::Result<Trial, String>>,
}

/// The truth of a case and the settings that are tried.
pub struct Trial {
    /// What they are compared with.
    pub truth: Truth,
    /// By line, in their order.
    pub settings: Vec<Setting>,
}

/// What is true.
pub struct Truth {
    /// Where it comes from, in words.
    pub words: String,
    /// Means over whole pixels, or numbers of a ledger.
    pub values: Vec<f64>,
    /// Of the pixels' centres, for settings of one sample; where there is none, `values` serve for them too.
    pub centres: Option<Vec<f64>>,
    /// Width and height, of a picture.
    pub size: Option<[usize; 2]>,
    /// How well it is known, relative to its mean.
    pub known_to: f64,
}

/// A technique with its options.
#[derive(Clone)]
pub struct Setting {
    /// The line that it belongs to.
    pub line: String,
    /// What the settings of the line differ by,
    pub of: &'static str,
    /// and its value here.
    pub at: f64,
    /// The power of it that the error should follow.
    pub expected_slope: Option<f64>,
    /// What is read.
    pub reads: Reads,
    /// True if it looks at the pixels' centres alone.
    pub centres: bool,
    /// True if its errors are random, so that seeds tell them.
    pub random: bool,
    /// The render request, less its seed.
    pub request: Value,
}

impl Setting {
    /// A setting of a stepping view: one sample at the pixels' centres; the error should follow `of` to the power `order`.
    pub fn stepped(line: &str, of: &'static str, at: f64, order: Option<f64>, request: Value) -> Self {
        let line = line.to_owned();
        Self { line, of, at, expected_slope: order, reads: Reads::Luminance, centres: true, random: false, request }
    }

    /// A setting of a random technique: the error should fall as the root of `at` samples or photons.
    pub fn random(line: &str, of: &'static str, at: f64, request: Value) -> Self {
        let line = line.to_owned();
        let expected_slope = Some(-0.5);
        Self { line, of, at, expected_slope, reads: Reads::Luminance, centres: false, random: true, request }
    }

    /// The same, with another reading.
    pub fn reading(self, reads: Reads) -> Self {
        Self { reads, ..self }
    }
}

/// A render request of a view.
pub fn view(technique: &str, volume: &Value, camera: &Value, side: usize, samples: u64, own: &Value) -> Value {
    json!({"technique": technique, "volume": volume, "camera": camera, "image": {"width": side, "height": side},
        "budget": {"samples": samples}, technique: own})
}

/// A render request of a simulation, of which only the ledger is looked at.
pub fn simulation(parameters: &Value) -> Value {
    json!({"technique": "projection", "volume": {"photon_transport": parameters},
        "image": {"width": 8, "height": 8}, "budget": {"samples": 1}})
}
