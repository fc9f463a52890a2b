//! What a study leaves: JSON from which its chart and its tables are made.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::measure::Measured;

/// Where and on what the numbers were taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor, as the system names it.
    pub processor: String,
    /// Threads that run at a time.
    pub threads: usize,
    /// The OpenCL device, its platform with its version, and its driver.
    pub device: String,
    /// See `device`.
    pub platform: String,
    /// See `device`.
    pub driver: String,
    /// Rays or photons of a work-item.
    pub lanes: u32,
    /// This program's version.
    pub version: String,
    /// The commit that it was built from, if known.
    pub commit: String,
    /// When, in seconds since 1970.
    pub unix_s: u64,
}

impl Machine {
    /// True if it is the same but for the time.
    pub fn is_same(&self, other: &Self) -> bool {
        Self { unix_s: other.unix_s, ..self.clone() } == *other
    }
}

/// One study: a case with its settings measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its name in `/v1/studies`.
    pub name: String,
    /// What it is, in a line.
    pub title: String,
    /// What the settings are compared with.
    pub truth: String,
    /// How well the truth itself is known, relative to its mean: errors below it are not told apart.
    pub truth_known_to: f64,
    /// True if it is the short form.
    pub quick: bool,
    /// Where it was measured.
    pub machine: Machine,
    /// Settings of one kind each.
    pub lines: Vec<Line>,
    /// The fastest setting for an error.
    pub equal_error: Vec<Choice>,
    /// The best setting for a time.
    pub equal_time: Vec<Choice>,
}

/// Settings that differ by one number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// A technique with its options.
    pub name: String,
    /// What the settings differ by.
    pub of: String,
    /// The power of that number that the error should follow, where there is one.
    pub expected_slope: Option<f64>,
    /// The power that it follows.
    pub slope: Option<f64>,
    /// The settings.
    pub points: Vec<Point>,
}

/// One setting, measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The number that the line's settings differ by.
    pub at: f64,
    /// Time on the device, the median of the runs.
    pub device_ms: f64,
    /// Time from asking to the final frame, the median of the runs.
    pub wall_ms: f64,
    /// What it is wrong by.
    #[serde(flatten)]
    pub error: Measured,
    /// How different its picture looks, where it is one and the program has the feature `flip`.
    pub flip: Option<f64>,
    /// What its reply says its error is.
    pub stated_error: Option<f64>,
    /// Samples per pixel.
    pub samples: u64,
    /// Runs with seeds of their own.
    pub runs: usize,
    /// Bytes of the film and the field.
    pub bytes: u64,
    /// What must never be silent.
    pub counts: Value,
    /// The codes of its warnings.
    pub warnings: Vec<String>,
    /// True if no other setting is both faster and better.
    pub front: bool,
    /// The request.
    pub request: Value,
}

/// What to choose for an error or a time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The error (relative) or the time (device milliseconds) that it has to stay within.
    pub bound: f64,
    /// The line and the number of the setting; none where no setting does.
    pub setting: Option<String>,
    /// Its device time.
    pub device_ms: Option<f64>,
    /// Its error.
    pub rmse: Option<f64>,
}
