//! The only module that uses opencl3 and `unsafe`: one context, its programs and buffers, and the launches of kernels.
//!
//! A [`Device`] lives on the thread that opened it (the job engine's), so that everything else stays free of OpenCL.

pub mod cells;
pub mod encode;
pub mod enums;
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

use std::collections::HashMap;
use std::path::PathBuf;
use std::ptr;

use opencl3::command_queue::CommandQueue;
use opencl3::context::Context;
use opencl3::kernel::Kernel;
use opencl3::memory::{Buffer as ClBuffer, CL_MEM_COPY_HOST_PTR, CL_MEM_READ_WRITE, Image};
use opencl3::program::Program;
use opencl3::types::{CL_BLOCKING, cl_uchar};

pub use host::{give_way, keep_compiled_kernels_in, leave};
pub use launch::Range;
pub use resume::Resume;
pub use select::{DeviceInfo, NO_DEVICE, list, select};
pub use signature::Parameter;
pub use slice_length::SliceLength;

use crate::error::{Error, Result};
use launch::Built;
use program::{Source, Variant};

/// Steps of a work-item in the first launch: a few milliseconds of any kernel.
const FIRST_STEPS: u32 = 1 << 14;
/// Uploads of fewer bytes than this are copied to add their padding.
const SMALL: usize = 1 << 20;

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

/// Bytes on the device: a buffer, or a volume's voxels as a 3D image, which only kernels read.
pub struct Buffer {
    memory: Memory,
    bytes: usize,
}

enum Memory {
    Bytes(ClBuffer<cl_uchar>),
    Image(Image),
}

impl Buffer {
    /// Its size in bytes.
    pub fn len(&self) -> usize {
        self.bytes
    }

    /// True if it has no bytes: never, since OpenCL permits no empty buffer.
    pub fn is_empty(&self) -> bool {
        self.bytes == 0
    }
}

/// The device: one OpenCL context, its queue, and the kernels built so far.
pub struct Device {
    info: DeviceInfo,
    context: Context,
    queue: CommandQueue,
    id: opencl3::types::cl_device_id,
    kernels: HashMap<Variant, Built>,
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
        let queue = cl("creating the queue", CommandQueue::create_default(&context, 0))?;
        info.image_formats_3d = images::formats(&context);
        let (kernels, strict, first_steps) = (HashMap::new(), config.strict, config.first_steps);
        let mut device = Self { info, id: device.id(), context, queue, kernels, overrides: None, strict, first_steps };
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
        let mut program = cl("creating a program", Program::create_from_source(&self.context, &text))?;
        if let Err(code) = program.build(&[self.id], &self.options(variant)) {
            let log = program.get_build_log(self.id).unwrap_or_default();
            return Err(Error::internal(format!("building {}: {code}\n{log}", variant.label())));
        }
        let kernel = cl("creating a kernel", Kernel::create(&program, variant.function))?;
        let parameters = signature::parameters(&text, variant.function)?;
        let count = cl("asking for the number of arguments", kernel.num_args())?;
        if count as usize != parameters.len() {
            let said = format!("{}: {} parameters in its text, {count} compiled", variant.label(), parameters.len());
            return Err(Error::internal(said));
        }
        self.kernels.insert(*variant, Built { kernel, parameters });
        Ok(())
    }

    /// A buffer of `bytes` bytes (at least 1), not yet written.
    ///
    /// # Errors
    /// [`Error::Internal`] if the device has no room.
    pub fn allocate(&self, bytes: usize) -> Result<Buffer> {
        let bytes = bytes.max(1);
        // SAFETY: no host pointer is given, so no memory of ours has to be valid.
        let memory = unsafe { ClBuffer::create(&self.context, CL_MEM_READ_WRITE, bytes, ptr::null_mut()) };
        Ok(Buffer { memory: Memory::Bytes(cl("allocating a buffer", memory)?), bytes })
    }

    /// A buffer that holds `data`, which is not empty. It needs no command in the queue; a command takes as long as some hundred kilobytes.
    fn allocate_with(&self, data: &mut [u8]) -> Result<Buffer> {
        let (flags, host) = (CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, data.as_mut_ptr().cast());
        // SAFETY: `host` points to as many bytes as the call copies, and the copy ends before the call returns.
        let memory = unsafe { ClBuffer::create(&self.context, flags, data.len(), host) };
        Ok(Buffer { memory: Memory::Bytes(cl("allocating a buffer", memory)?), bytes: data.len() })
    }

    /// A buffer of `bytes` bytes with undefined content: `room` if that is as large. Memory that has been in use is available at once; the system
    /// hands out each page of new memory when it is first touched.
    ///
    /// # Errors
    /// As [`Device::allocate`].
    pub fn allocate_in(&self, room: Option<Buffer>, bytes: usize) -> Result<Buffer> {
        room.filter(|room| room.bytes == bytes).map_or_else(|| self.allocate(bytes), Ok)
    }

    /// A buffer that holds `data` and `padding` zero bytes behind it.
    ///
    /// # Errors
    /// As [`Device::allocate`].
    pub fn upload(&self, data: &[u8], padding: usize) -> Result<Buffer> {
        if data.len() < SMALL {
            let mut padded = [data, &vec![0; padding]].concat();
            padded.resize(padded.len().max(1), 0);
            return self.allocate_with(&mut padded);
        }
        let mut buffer = self.allocate(data.len() + padding)?;
        self.write(&mut buffer, 0, data)?;
        self.write(&mut buffer, data.len(), &vec![0; padding])?;
        Ok(buffer)
    }

    /// Writes `data` at `offset`.
    ///
    /// # Errors
    /// [`Error::Internal`] if it does not fit or OpenCL fails.
    pub fn write(&self, buffer: &mut Buffer, offset: usize, data: &[u8]) -> Result<()> {
        if data.is_empty() {
            return Ok(());
        }
        let (true, Memory::Bytes(memory)) = (offset + data.len() <= buffer.bytes, &mut buffer.memory) else {
            return Err(Error::internal("a write past the end of a device buffer, or to an image"));
        };
        // SAFETY: the range was checked above, and the call blocks until `data` has been read.
        let event = unsafe { self.queue.enqueue_write_buffer(memory, CL_BLOCKING, offset, data, &[]) };
        cl("writing a buffer", event).map(drop)
    }

    /// Reads from `offset` until `out` is full.
    ///
    /// # Errors
    /// As [`Device::write`].
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer, offset: usize, out: &mut [T]) -> Result<()> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(out);
        if bytes.is_empty() {
            return Ok(());
        }
        let (true, Memory::Bytes(memory)) = (offset + bytes.len() <= buffer.bytes, &buffer.memory) else {
            return Err(Error::internal("a read past the end of a device buffer, or of an image"));
        };
        // SAFETY: the range was checked above, `bytes` is plain data, and the call blocks until it is filled.
        let event = unsafe { self.queue.enqueue_read_buffer(memory, CL_BLOCKING, offset, bytes, &[]) };
        cl("reading a buffer", event).map(drop)
    }
}
