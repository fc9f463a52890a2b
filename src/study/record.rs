//! The record of a study: JSON from which its chart and its tables are made.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::measure::Measured;

/// The machine and the program that the numbers were taken on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor, as the system names it.
    pub processor: String,
    /// The number of threads that run at a time.
    pub threads: usize,
    /// The OpenCL device.
    pub device: String,
    /// The OpenCL platform with its version.
    pub platform: String,
    /// The driver of the device.
    pub driver: String,
    /// The number of rays or photons of a work-item.
    pub lanes: u32,
    /// This program's version.
    pub version: String,
    /// The commit that it was built from, if known.
    pub commit: String,
    /// The time of the measurement, in seconds since 1970.
    pub unix_s: u64,
}

impl Machine {
    /// True if the two are the same but for the time.
    pub fn is_same(&self, other: &Self) -> bool {
        Self { unix_s: other.unix_s, ..self.clone() } == *other
    }
}

/// One study: a case with its settings measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its name in `/v1/studies`.
    pub name: String,
    /// Its title, a line of words.
    pub title: String,
    /// The truth that the settings are compared with.
    pub truth: String,
    /// The error of the truth itself, relative to its mean. Errors below it are not told apart.
    pub truth_known_to: f64,
    /// True if it is the short form.
    pub quick: bool,
    /// The machine of the measurement.
    pub machine: Machine,
    /// The lines, each with settings of one kind.
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
    /// The parameter by which the settings differ.
    pub of: String,
    /// The power of that parameter that the error should follow, if there is one.
    pub expected_slope: Option<f64>,
    /// The power that the error follows.
    pub slope: Option<f64>,
    /// The settings.
    pub points: Vec<Point>,
}

/// One setting, measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The value of the parameter by which the line's settings differ.
    pub at: f64,
    /// The time on the device, the median of the runs.
    pub device_ms: f64,
    /// The time from asking to the final frame, the median of the runs.
    pub wall_ms: f64,
    /// Its errors.
    #[serde(flatten)]
    pub error: Measured,
    /// The visible difference of its picture, if it has one and the program has the feature `flip`.
    pub flip: Option<f64>,
    /// The error that its reply states.
    pub stated_error: Option<f64>,
    /// Samples per pixel.
    pub samples: u64,
    /// The number of runs with seeds of their own.
    pub runs: usize,
    /// The bytes of the film and the field.
    pub bytes: u64,
    /// The counts that must never be silent.
    pub counts: Value,
    /// The codes of its warnings.
    pub warnings: Vec<String>,
    /// True if no other setting is both faster and better.
    pub front: bool,
    /// The request.
    pub request: Value,
}

/// The setting to choose for an error or a time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The error (relative) or the time (device milliseconds) that it has to stay within.
    pub bound: f64,
    /// The line and the number of the setting; `None` if no setting stays within it.
    pub setting: Option<String>,
    /// Its device time.
    pub device_ms: Option<f64>,
    /// Its error.
    pub rmse: Option<f64>,
}
