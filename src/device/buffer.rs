//! Memory of the device, and the ways to it from the host.

use std::ptr;

use opencl3::command_queue::CommandQueue;
use opencl3::memory::{Buffer as ClBuffer, CL_MEM_COPY_HOST_PTR, CL_MEM_READ_WRITE, Image};
use opencl3::types::{CL_BLOCKING, cl_uchar};

use super::{Device, cl};
use crate::error::{Error, Result};

/// Uploads of fewer bytes than this are copied to add their padding.
const SMALL: usize = 1 << 20;

/// Bytes on the device: a buffer, or a volume's voxels as a 3D image, which only kernels read.
pub struct Buffer {
    pub(super) memory: Memory,
    pub(super) bytes: usize,
}

pub(super) enum Memory {
    Bytes(ClBuffer<cl_uchar>),
    Image(Image),
}

// SAFETY: a memory object is a handle that OpenCL permits all threads to use at once. A reference permits nothing but to read from it and to name it
// as an argument.
unsafe impl Sync for Buffer {}

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

impl Device {
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

    /// Copies the first `bytes` bytes of a buffer to another.
    ///
    /// # Errors
    /// As [`Device::write`].
    pub fn copy(&self, from: &Buffer, to: &mut Buffer, bytes: usize) -> Result<()> {
        let fits = bytes <= from.bytes.min(to.bytes);
        let (true, Memory::Bytes(source), Memory::Bytes(target)) = (fits, &from.memory, &mut to.memory) else {
            return Err(Error::internal("a copy past the end of a device buffer, or of an image"));
        };
        // SAFETY: both ranges were checked above.
        let event = unsafe { self.queue.enqueue_copy_buffer(source, target, 0, 0, bytes, &[]) };
        cl("copying a buffer", event)?;
        cl("waiting for the device", self.queue.finish())
    }

    /// Reads from `offset` until `out` is full.
    ///
    /// # Errors
    /// As [`Device::write`].
    pub fn read<T: bytemuck::Pod>(&self, buffer: &Buffer, offset: usize, out: &mut [T]) -> Result<()> {
        read(&self.queue, buffer, offset, out)
    }

    /// Reads `rows` rows of `length` values each, which begin every `pitch` bytes from `offset` on.
    ///
    /// # Errors
    /// [`Error::Internal`] if they are not all in the buffer, or when OpenCL fails.
    pub fn read_rows<T: bytemuck::Pod>(
        &self,
        buffer: &Buffer,
        offset: usize,
        pitch: usize,
        rows: usize,
        length: usize,
    ) -> Result<Vec<T>> {
        let mut out = vec![T::zeroed(); rows * length];
        let width = length * size_of::<T>();
        if out.is_empty() {
            return Ok(out);
        }
        let fits = width <= pitch && offset + (rows - 1) * pitch + width <= buffer.bytes;
        let (true, Memory::Bytes(memory)) = (fits, &buffer.memory) else {
            return Err(Error::internal("a read past the end of a device buffer, or of an image"));
        };
        let (from, to, region) = ([offset % pitch, offset / pitch, 0], [0; 3], [width, rows, 1]);
        let data = out.as_mut_ptr().cast();
        // SAFETY: the range was checked above, `out` has `rows` × `width` bytes of plain data, and the call blocks until it is filled.
        let event = unsafe {
            self.queue.enqueue_read_buffer_rect(
                memory,
                CL_BLOCKING,
                from.as_ptr(),
                to.as_ptr(),
                region.as_ptr(),
                pitch,
                0,
                width,
                0,
                data,
                &[],
            )
        };
        cl("reading rows of a buffer", event)?;
        Ok(out)
    }
}

/// [`Device::read`] by a queue of the device.
pub(super) fn read<T: bytemuck::Pod>(
    queue: &CommandQueue,
    buffer: &Buffer,
    offset: usize,
    out: &mut [T],
) -> Result<()> {
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(out);
    if bytes.is_empty() {
        return Ok(());
    }
    let (true, Memory::Bytes(memory)) = (offset + bytes.len() <= buffer.bytes, &buffer.memory) else {
        return Err(Error::internal("a read past the end of a device buffer, or of an image"));
    };
    // SAFETY: the range was checked above, `bytes` is plain data, and the call blocks until it is filled.
    let event = unsafe { queue.enqueue_read_buffer(memory, CL_BLOCKING, offset, bytes, &[]) };
    cl("reading a buffer", event).map(drop)
}
