//! `device`: the OpenCL devices here, and the variants of the kernels.

use serde_json::{Value, json};

use crate::config::DeviceArgs;
use crate::error::{Error, Result};
use crate::{device, technique};

/// What `device` is told.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub device: DeviceArgs,
    /// List the kernels' variants instead: what each is built with, and which are built at the start
    #[arg(long)]
    pub variants: bool,
}

/// Prints the OpenCL devices here and the one that would be used.
///
/// # Errors
/// [`Error::Internal`] when there is none.
pub(super) fn show_devices(args: &DeviceArgs) -> Result<()> {
    let all: Vec<_> = device::list(args.lanes)?.into_iter().map(|(_, info)| info).collect();
    let (_, chosen) = device::select(&args.device, args.lanes)?;
    // An opened device knows more of itself. A device that cannot be opened is shown all the same.
    let used = device::Device::open(&args.device_config()).map_or(chosen, |device| device.info().clone());
    let text = serde_json::to_string_pretty(&json!({"devices": all, "would_use": used})).map_err(Error::internal)?;
    println!("{text}");
    Ok(())
}

/// Prints every variant of every kernel. A render builds those that its plan needs, and common ones are built at the start.
///
/// # Errors
/// [`Error::Internal`] when there is no device.
pub(super) fn show_variants(args: &DeviceArgs) -> Result<()> {
    let (_, used) = device::select(&args.device, args.lanes)?;
    let mut variants = Vec::new();
    for technique in technique::all() {
        let source = (technique.source)();
        for (i, variant) in (source.variants)().iter().enumerate() {
            let features: serde_json::Map<String, Value> =
                variant.features.iter().map(|(name, value)| ((*name).into(), json!(value))).collect();
            variants.push(
                json!({"kernel": variant.kernel, "voxel": variant.voxel.map(|v| format!("{v:?}").to_lowercase()),
                "features": features, "at_start": i < source.common, "options": variant.options(used.lanes, false, false)}),
            );
        }
    }
    let text =
        serde_json::to_string_pretty(&json!({"count": variants.len(), "lanes": used.lanes, "variants": variants}));
    println!("{}", text.map_err(Error::internal)?);
    Ok(())
}
