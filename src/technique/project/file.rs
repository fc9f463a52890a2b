//! The file of a projection, and what is said of it.

use std::time::Duration;

use serde_json::{Value, json};

use crate::error::Result;
use crate::technique::File;
use crate::tomography::Sinogram;

/// A warning of a reply.
pub(super) fn warning(code: &str, message: String) -> Value {
    json!({"code": code, "message": message})
}

/// A sinogram as the file of an export.
pub(super) fn of(
    sinogram: &Sinogram,
    projector: &str,
    unit: &str,
    device_time: Duration,
    more_warnings: Vec<Value>,
) -> Result<File> {
    let info = sinogram.info("", true);
    let mut warnings: Vec<Value> = info.warnings.iter().map(|words| warning("data_check", words.clone())).collect();
    warnings.extend(more_warnings);
    let device_ms = 1e3 * device_time.as_secs_f64();
    let result = json!({"geometry": info.geometry, "views": info.views, "bins": info.bins, "range": info.range, "quantity": info.quantity,
        "projector": projector, "unit": unit, "device_ms": device_ms, "data_check": info.data_check, "warnings": warnings});
    Ok(File { bytes: sinogram.nrrd()?.into(), media_type: "application/octet-stream", extension: "nrrd", result })
}
