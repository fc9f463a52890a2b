//! The choice of the OpenCL device, and its description.

use opencl3::device::{CL_DEVICE_TYPE_ALL, CL_DEVICE_TYPE_CPU, CL_DEVICE_TYPE_GPU, Device as ClDevice};
use opencl3::platform::{Platform, get_platforms};
use serde::Serialize;

use crate::error::{Error, Result};

/// The description of an OpenCL device, as `GET /v1/device` and `cloudchamber device` show it.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceInfo {
    /// The OpenCL platform, such as `Portable Computing Language`.
    pub platform: String,
    /// The platform's version text.
    pub platform_version: String,
    /// The device's name.
    pub device: String,
    /// `cpu`, `gpu` or `other`.
    pub kind: &'static str,
    /// The OpenCL version that the device supports.
    pub version: String,
    /// The driver's version.
    pub driver: String,
    /// Compute units (cores).
    pub compute_units: u32,
    /// The clock in MHz, as the driver states it.
    pub clock_mhz: u32,
    /// Device memory in bytes.
    pub global_memory_bytes: u64,
    /// The largest single buffer in bytes.
    pub largest_buffer_bytes: u64,
    /// Local memory of a work-group in bytes.
    pub local_memory_bytes: u64,
    /// The largest work-group.
    pub largest_work_group: usize,
    /// Floats in the device's preferred vector, which decides the number of lanes.
    pub native_vector_width_float: u32,
    /// True if images (textures) are supported.
    pub image_support: bool,
    /// Formats of 3D images, as `order/type` in OpenCL's names; known once the device is opened.
    pub image_formats_3d: Vec<String>,
    /// The largest 3D image, voxels a side.
    pub largest_image_3d: [usize; 3],
    /// The ways to read images: filters, and addressing beyond the edge.
    pub sampler_modes: &'static [&'static str],
    /// True if views read volumes as images, filtered by the device's sampler; otherwise from buffers, by the kernels.
    pub volumes_are_images: bool,
    /// The source of samples (image or buffer) in words, with its precision.
    pub volume_sampling: &'static str,
    /// True if the device has 64-bit integer atomics (photon transport needs them).
    pub int64_atomics: bool,
    /// Rays or photons that one work-item carries here.
    pub lanes: u32,
    /// The instruction set that kernels are compiled for, such as `AVX2`; known once the device is opened.
    pub level: &'static str,
    /// Attempts that failed before this one, such as more lanes, in words.
    pub gave_up: Vec<String>,
    /// Work-items in a work-group here.
    pub local_size: usize,
}

/// The modes that OpenCL C 1.2 guarantees if a device has images.
const SAMPLER_MODES: &[&str] = &[
    "filter nearest",
    "filter linear",
    "address none",
    "address clamp",
    "address clamp_to_edge",
    "address repeat (normalised coordinates)",
    "address mirrored_repeat (normalised coordinates)",
];
/// Work-items of a work-group on a GPU.
pub(super) const GPU_GROUP: usize = 64;
const FROM_BUFFERS: &str =
    "buffer: interpolated by the kernels in single precision (bytes: weights of 15 bits along x)";
const FROM_IMAGES: &str = "image: trilinear by the device's sampler, whose weights have 8 fractional bits on a GPU";

impl DeviceInfo {
    /// True if it is a PoCL device. PoCL compiles at the first launch, and keeps the result for other processes too.
    pub fn is_pocl(&self) -> bool {
        self.platform.contains("Portable Computing Language")
    }

    /// Selects images for volumes if `target` says so, or by default on a GPU that supports them. Then a work-item is one ray.
    pub(super) fn use_images(&mut self, target: Option<bool>) {
        self.volumes_are_images = self.image_support && target.unwrap_or(self.kind == "gpu" && self.lanes == 1);
        if self.volumes_are_images {
            self.lanes = 1;
            self.volume_sampling = FROM_IMAGES;
        }
    }
}

/// Advice for a machine without a usable OpenCL device.
pub const NO_DEVICE: &str = "there is no usable OpenCL device: install PoCL for the processor (Debian and Ubuntu: \
    apt install pocl-opencl-icd ocl-icd-libopencl1 binutils) or the graphics card's OpenCL driver; `cloudchamber device` lists what \
    there is, --device NAME chooses, and --lanes 4 or --lanes 1 asks for less of the compiler";

fn cl<T>(result: std::result::Result<T, opencl3::error_codes::ClError>) -> Result<T> {
    result.map_err(|e| Error::internal(format!("OpenCL: {e}")))
}

/// The lanes for a device: its own vector width on a CPU, 1 on anything else. `forced` (4, 8, 16 or 1) wins.
fn lanes_for(kind: &str, width: u32, forced: Option<u32>) -> u32 {
    forced.unwrap_or(match (kind, width) {
        ("cpu", 16..) => 16,
        ("cpu", 8..=15) => 8,
        ("cpu", 4..=7) => 4,
        _ => 1,
    })
}

fn describe(platform: &Platform, device: &ClDevice, forced_lanes: Option<u32>) -> Result<DeviceInfo> {
    let bits = cl(device.dev_type())?;
    let kind = match bits {
        t if t & CL_DEVICE_TYPE_CPU != 0 => "cpu",
        t if t & CL_DEVICE_TYPE_GPU != 0 => "gpu",
        _ => "other",
    };
    let width = cl(device.native_vector_width_float())?;
    let image_support = cl(device.image_support())?;
    let lanes = lanes_for(kind, width, forced_lanes);
    Ok(DeviceInfo {
        platform: cl(platform.name())?,
        platform_version: cl(platform.version())?,
        device: cl(device.name())?.trim().to_owned(),
        kind,
        version: cl(device.version())?,
        driver: cl(device.driver_version())?,
        compute_units: cl(device.max_compute_units())?,
        clock_mhz: cl(device.max_clock_frequency())?,
        global_memory_bytes: cl(device.global_mem_size())?,
        largest_buffer_bytes: cl(device.max_mem_alloc_size())?,
        local_memory_bytes: cl(device.local_mem_size())?,
        largest_work_group: cl(device.max_work_group_size())?,
        native_vector_width_float: width,
        image_support,
        largest_image_3d: if image_support {
            [cl(device.image3d_max_width())?, cl(device.image3d_max_height())?, cl(device.image3d_max_depth())?]
        } else {
            [0; 3]
        },
        image_formats_3d: Vec::new(),
        sampler_modes: if image_support { SAMPLER_MODES } else { &[] },
        volumes_are_images: false,
        volume_sampling: FROM_BUFFERS,
        int64_atomics: cl(device.extensions())?.contains("cl_khr_int64_base_atomics"),
        lanes,
        level: "",
        gave_up: Vec::new(),
        // A CPU work-item is already a packet, so a group is only the unit that threads share out; a GPU needs whole warps.
        local_size: if kind == "gpu" { GPU_GROUP } else { 4 },
    })
}

/// Every OpenCL device here, with its description.
///
/// # Errors
/// [`Error::Internal`] if there is no OpenCL at all, with advice on its installation.
pub fn list(forced_lanes: Option<u32>) -> Result<Vec<(ClDevice, DeviceInfo)>> {
    let missing = NO_DEVICE;
    // The ICD loader is opened at run time. Without it, cl3 panics in its lazy initialiser instead of returning an error.
    let platforms = std::panic::catch_unwind(get_platforms)
        .map_err(|_| Error::internal(missing))?
        .map_err(|e| Error::internal(format!("{missing} ({e})")))?;
    let mut found = Vec::new();
    for platform in platforms {
        for id in platform.get_devices(CL_DEVICE_TYPE_ALL).unwrap_or_default() {
            let device = ClDevice::new(id);
            let info = describe(&platform, &device, forced_lanes)?;
            found.push((device, info));
        }
    }
    if found.is_empty() { Err(Error::internal(missing)) } else { Ok(found) }
}

/// The device for a target: `pocl` (or `cpu`) the first CPU, PoCL's before others; `gpu` the first GPU; else the first whose
/// platform or name contains the target, in any case.
///
/// # Errors
/// [`Error::Internal`] if none fits; the message lists the devices.
pub fn select(target: &str, forced_lanes: Option<u32>) -> Result<(ClDevice, DeviceInfo)> {
    let devices = list(forced_lanes)?;
    let names: Vec<String> = devices.iter().map(|(_, i)| format!("{} / {}", i.platform, i.device)).collect();
    let lower = target.to_lowercase();
    let rank = |i: &DeviceInfo| match lower.as_str() {
        "pocl" | "cpu" | "" => (i.kind == "cpu").then_some(if i.is_pocl() { 0 } else { 1 }),
        "gpu" => (i.kind == "gpu").then_some(0),
        text => (i.platform.to_lowercase().contains(text) || i.device.to_lowercase().contains(text)).then_some(0),
    };
    devices
        .into_iter()
        .filter_map(|(d, i)| rank(&i).map(|r| (r, d, i)))
        .min_by_key(|(r, _, _)| *r)
        .map(|(_, d, i)| (d, i))
        .ok_or_else(|| {
            Error::internal(format!("no OpenCL device fits --device {target}; there are: {}", names.join(", ")))
        })
}
