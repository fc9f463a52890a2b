//! The only module that uses opencl3 and `unsafe`: one context, its programs and buffers, and the launches of kernels.
//!
//! A [`Device`] lives on the thread that opened it (the job engine's), so that everything else stays free of OpenCL.

mod buffer;
pub mod cells;
pub mod encode;
pub mod enums;
pub mod grid;
mod host;
mod images;
mod include;
mod launch;
mod level;
pub mod numbers;
pub mod program;
pub mod reduce;
mod resume;
mod select;
mod signature;
mod slice_length;
pub mod structs;
pub mod variance;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use opencl3::command_queue::CommandQueue;
use opencl3::context::Context;
use opencl3::kernel::Kernel;
use opencl3::program::Program;

pub use buffer::Buffer;
pub use host::{give_way, keep_compiled_kernels_in, leave};
pub use launch::Range;
pub use resume::Resume;
pub use select::{DeviceInfo, NO_DEVICE, list, select};
pub use signature::Parameter;
pub use slice_length::SliceLength;

use crate::error::{Error, Result};
use buffer::Memory;
use launch::Built;
use program::{Source, Variant};

/// Steps of a work-item in the first launch: a few milliseconds of any kernel.
const FIRST_STEPS: u32 = 1 << 14;

/// The choice of a device and of its kernels.
#[derive(Debug, Clone)]
pub struct DeviceConfig {
    /// `pocl`, `gpu`, or part of a platform's or device's name.
    pub target: String,
    /// The number of lanes (1, 4, 8 or 16) in place of the device's own.
    pub lanes: Option<u32>,
    /// The folder from which kernel files are read instead of the binary.
    pub kernels: Option<PathBuf>,
    /// True if views sample volumes as 3D images; by default on a GPU that supports them.
    pub images: Option<bool>,
    /// True if a compiler's warning fails a build, as in tests. In service it would disable a technique for nothing.
    pub strict: bool,
    /// Steps that a work-item may take in the first launch. Tests ask for few, so that launches leave work undone.
    pub first_steps: u32,
    /// This program, which compiles kernels ahead in processes of its own, if given; else each kernel is built when first used.
    pub compiler: Option<PathBuf>,
}

impl DeviceConfig {
    /// The CPU's PoCL with its own defaults; each kernel is built when first used.
    pub fn pocl() -> Self {
        Self {
            target: "pocl".into(),
            lanes: None,
            kernels: None,
            images: None,
            strict: false,
            first_steps: FIRST_STEPS,
            compiler: None,
        }
    }
}

/// The device: one OpenCL context, its queue, and the kernels built so far.
pub struct Device {
    info: DeviceInfo,
    context: Context,
    queue: CommandQueue,
    /// The queue of those who read grids on other threads.
    reads: Arc<CommandQueue>,
    id: opencl3::types::cl_device_id,
    kernels: HashMap<Variant, Built>,
    /// The programs of files with several kernel functions, by the variant of the function that has the file's name.
    programs: HashMap<Variant, Program>,
    overrides: Option<PathBuf>,
    strict: bool,
    first_steps: u32,
}

fn cl<T>(doing: &str, result: std::result::Result<T, opencl3::error_codes::ClError>) -> Result<T> {
    result.map_err(|e| Error::internal(format!("OpenCL, {doing}: {e}")))
}

impl Device {
    /// Opens the device that `config` names.
    ///
    /// # Errors
    /// [`Error::Internal`] if there is none or OpenCL fails.
    pub fn open(config: &DeviceConfig) -> Result<Self> {
        let (device, mut info) = select(&config.target, config.lanes)?;
        info.use_images(config.images);
        let context = cl("creating the context", Context::from_device(&device))?;
        // The call is the OpenCL 1.x form, which both PoCL 3.1 and NVIDIA's OpenCL have.
        let queue = || cl("creating a queue", CommandQueue::create_default(&context, 0));
        let (queue, reads) = (queue()?, Arc::new(queue()?));
        info.image_formats_3d = images::formats(&context);
        let (kernels, programs) = Default::default();
        let (id, strict, first_steps) = (device.id(), config.strict, config.first_steps);
        let overrides = None;
        let mut device = Self { info, id, context, queue, reads, kernels, programs, overrides, strict, first_steps };
        device.info.level = level::of(&mut device)?;
        device.overrides = config.kernels.clone();
        Ok(device)
    }

    /// The description of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Steps that a work-item may take in the first launch.
    pub fn first_steps(&self) -> u32 {
        self.first_steps
    }

    /// Adds the attempts that were given up before the device was opened to its description.
    pub fn note_given_up(&mut self, gave_up: Vec<String>) {
        self.info.gave_up = gave_up;
    }

    /// True if a variant is built.
    pub fn is_built(&self, variant: &Variant) -> bool {
        self.kernels.contains_key(variant)
    }

    /// The build options of a variant on this device.
    fn options(&self, variant: &Variant) -> String {
        variant.options(self.info.lanes, self.info.volumes_are_images, self.strict)
    }

    /// A hash of everything on which the compiled form of a variant depends: its text, its options, the device and its driver.
    ///
    /// # Errors
    /// [`Error::Internal`] if a kernel file is missing.
    pub fn fingerprint(&self, source: &Source, variant: &Variant) -> Result<String> {
        let (text, info) = (source.text(self.overrides.as_deref())?, &self.info);
        let all = [&text, &self.options(variant), &info.platform_version, &info.device, &info.driver, info.level];
        Ok(blake3::hash(all.join("\0").as_bytes()).to_hex()[..32].to_owned())
    }

    /// Builds a variant unless it is built already. PoCL really compiles at the first launch, so a caller that wants it warm launches it once.
    ///
    /// # Errors
    /// [`Error::Internal`] with the build log.
    pub fn build(&mut self, source: &Source, variant: &Variant) -> Result<()> {
        if self.kernels.contains_key(variant) {
            return Ok(());
        }
        let text = source.text(self.overrides.as_deref())?;
        let key = variant.of_function(variant.kernel);
        if !self.programs.contains_key(&key) {
            self.programs.insert(key, self.program(&text, variant)?);
        }
        let kernel = cl("creating a kernel", Kernel::create(&self.programs[&key], variant.function))?;
        let parameters = signature::parameters(&text, variant.function)?;
        let count = cl("asking for the number of arguments", kernel.num_args())?;
        if count as usize != parameters.len() {
            let said = format!("{}: {} parameters in its text, {count} compiled", variant.label(), parameters.len());
            return Err(Error::internal(said));
        }
        self.kernels.insert(*variant, Built { kernel, parameters });
        Ok(())
    }

    fn program(&self, text: &str, variant: &Variant) -> Result<Program> {
        let mut program = cl("creating a program", Program::create_from_source(&self.context, text))?;
        match program.build(&[self.id], &self.options(variant)) {
            Ok(()) => Ok(program),
            Err(code) => {
                let log = program.get_build_log(self.id).unwrap_or_default();
                Err(Error::internal(format!("building {}: {code}\n{log}", variant.label())))
            }
        }
    }
}
