//! The study: speed against accuracy, and the failures of methods.
//!
//! A [`Case`] is a scene with a truth that the technique under test had no part in: a closed form, a published table, a double-precision
//! reference of the host (`oracle`), or a long run of another unbiased technique. A [`Setting`] is a technique with its options. Each is
//! run with several seeds; `measure` gives its errors, and `fit` finds the best settings.
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
pub mod honesty;
pub mod measure;
pub mod oracle;
mod page;
pub mod planner;
pub mod record;
pub mod results;
mod run;
pub mod stability;
mod table;
pub mod verdict;

pub use cases::CASES;
use run::field_of;
pub use run::{ERRORS, machine, study};
pub use table::table;

use serde_json::{Value, json};

use crate::error::Result;
use bench::{Bench, Reads};

/// The amount of work that is put into a study.
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

/// A scene with a truth, and the settings that are tried on it.
pub struct Case {
    /// Its name, in the name of its file and in `/v1/studies`.
    pub name: &'static str,
    /// Its title, a line of words.
    pub title: &'static str,
    /// The user's scene like it, as the end of "you have …".
    pub when: &'static str,
    /// The choice for such a scene, in plain words.
    pub choose: &'static str,
    /// The function that makes its truth and its settings. It gives the reason instead if something that it needs is not on this machine.
    pub trial: fn(&Bench, Scale) -> Result<std::result::Result<Trial, String>>,
}

/// The truth of a case and the settings that are tried.
pub struct Trial {
    /// The truth that they are compared with.
    pub truth: Truth,
    /// The settings by line, in their order.
    pub settings: Vec<Setting>,
}

/// The true values of a case.
pub struct Truth {
    /// The source of the values, in words.
    pub words: String,
    /// The means over whole pixels, or numbers of a ledger.
    pub values: Vec<f64>,
    /// The values at the pixels' centres, for settings of one sample. Without them, `values` serve for these settings too.
    pub centres: Option<Vec<f64>>,
    /// The width and the height, if the truth is a picture.
    pub size: Option<[usize; 2]>,
    /// The error of the truth itself, relative to its mean.
    pub known_to: f64,
}

/// A technique with its options.
#[derive(Clone)]
pub struct Setting {
    /// The line that it belongs to.
    pub line: String,
    /// The parameter by which the settings of the line differ.
    pub of: &'static str,
    /// The value of this parameter.
    pub at: f64,
    /// The power of `at` that the error should follow.
    pub expected_slope: Option<f64>,
    /// The numbers that are read from a run.
    pub reads: Reads,
    /// True if it looks at the pixels' centres alone.
    pub centres: bool,
    /// True if its errors are random, so that they differ from seed to seed.
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

    /// The same setting with another reading.
    pub fn reading(self, reads: Reads) -> Self {
        Self { reads, ..self }
    }
}

/// A render request of a view.
pub fn view(technique: &str, volume: &Value, camera: &Value, side: usize, samples: u64, own: &Value) -> Value {
    json!({"technique": technique, "volume": volume, "camera": camera, "image": {"width": side, "height": side},
        "budget": {"samples": samples}, technique: own})
}

/// A render request of a simulation, of which only the ledger is read.
pub fn simulation(parameters: &Value) -> Value {
    json!({"technique": "projection", "volume": {"photon_transport": parameters},
        "image": {"width": 8, "height": 8}, "budget": {"samples": 1}})
}
