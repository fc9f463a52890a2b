//! The device: structs have the host's layout, every variant builds without a warning, a tiny case of each kernel runs clean under oclgrind, and
//! kernels are launched as they are asked for.

pub(crate) mod builds;
mod cells;
mod encode;
mod grids;
mod images;
mod launches;
mod names;
mod oclgrind;
mod reductions;
mod structs;
mod variances;

use std::path::Path;

use cloudchamber::device::{Device, DeviceConfig};

fn open(lanes: Option<u32>, kernels: Option<&Path>) -> Device {
    let _opening = crate::common::opening();
    Device::open(&DeviceConfig { lanes, kernels: kernels.map(Path::to_owned), strict: true, ..DeviceConfig::pocl() })
        .unwrap()
}
