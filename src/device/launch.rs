//! Launches: a built kernel, its arguments by name, and the number of work-items.

use std::ptr;
use std::time::{Duration, Instant};

use opencl3::kernel::Kernel;
use opencl3::memory::ClMem;
use opencl3::types::cl_mem;

use super::program::Variant;
use super::select::GPU_GROUP;
use super::signature::{self, Parameter};
use super::{Buffer, Device, Memory, cl};
use crate::error::{Error, Result};

/// The number of work-items of a launch, along one to three dimensions. A number alone is one dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    /// Along one dimension.
    One(usize),
    /// Along two; neighbours in the first are next to each other in a work-group.
    Two([usize; 2]),
    /// Along three.
    Three([usize; 3]),
}

impl From<usize> for Range {
    fn from(items: usize) -> Self {
        Self::One(items)
    }
}

impl From<[usize; 2]> for Range {
    fn from(items: [usize; 2]) -> Self {
        Self::Two(items)
    }
}

impl From<[usize; 3]> for Range {
    fn from(items: [usize; 3]) -> Self {
        Self::Three(items)
    }
}

impl Range {
    fn dimensions(self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Two(_) => 2,
            Self::Three(_) => 3,
        }
    }

    /// The numbers of work-items along three dimensions, of the launch and of a work-group of `group` items. Dimensions that the range does not have
    /// are 1.
    ///
    /// A range's number of dimensions alone decides the size of its work-groups: PoCL compiles a kernel anew for each size, at its first launch,
    /// which takes from 60 ms to seconds. On a processor, where groups are small, they are a row in all three cases, so that PoCL has a single size
    /// to compile for.
    fn sizes(self, group: usize) -> ([usize; 3], [usize; 3]) {
        let (items, compact) = match self {
            Self::One(n) => ([n, 1, 1], [GPU_GROUP, 1, 1]),
            Self::Two([x, y]) => ([x, y, 1], [8, 8, 1]),
            Self::Three(items) => (items, [4, 4, 4]),
        };
        let local = if group == GPU_GROUP { compact } else { [group, 1, 1] };
        (std::array::from_fn(|a| items[a].div_ceil(local[a]) * local[a]), local)
    }
}

/// A kernel that is built, and the names of its parameters in order.
pub(super) struct Built {
    pub kernel: Kernel,
    pub parameters: Vec<Parameter>,
}

impl Device {
    fn built(&self, variant: &Variant) -> Result<&Built> {
        self.kernels.get(variant).ok_or_else(|| Error::internal(format!("{} is not built", variant.label())))
    }

    /// The parameters of a built variant.
    ///
    /// # Errors
    /// [`Error::Internal`] if it is not built.
    pub fn parameters(&self, variant: &Variant) -> Result<&[Parameter]> {
        self.built(variant).map(|built| built.parameters.as_slice())
    }

    /// Runs a built variant over a range of work-items, waits, and returns the device's time.
    ///
    /// `arguments` are the kernel's buffers by the names of its parameters, in any order. The kernel itself keeps within them and returns
    /// at once for items past its work, since the range is rounded up to whole work-groups. There is no global offset: PoCL would compile
    /// the kernel anew for one, at its first launch.
    ///
    /// # Errors
    /// [`Error::Internal`] if the variant is not built, an argument is unknown, doubled or missing, or OpenCL fails.
    pub fn run(&self, variant: &Variant, arguments: &[(&str, &Buffer)], range: impl Into<Range>) -> Result<Duration> {
        let Built { kernel, parameters } = self.built(variant)?;
        let places = signature::places(parameters, arguments.iter().map(|(name, _)| *name))
            .map_err(|e| Error::internal(format!("{}: {e}", variant.label())))?;
        for (place, (_, buffer)) in places.into_iter().zip(arguments) {
            let memory: cl_mem = match &buffer.memory {
                Memory::Bytes(memory) => memory.get(),
                Memory::Image(image) => image.get(),
            };
            // SAFETY: every kernel argument here is a buffer, for which clSetKernelArg takes a cl_mem of this context.
            cl("setting an argument", unsafe { kernel.set_arg(place as u32, &memory) })?;
        }
        let range = range.into();
        let (global, local) = range.sizes(self.info.local_size);
        let dimensions = range.dimensions() as u32;
        let started = Instant::now();
        // SAFETY: the sizes are arrays of three elements for at most three dimensions, alive through the call; no offset is given;
        // the arguments are set.
        let event = unsafe {
            let (global, local) = (global.as_ptr(), local.as_ptr());
            self.queue.enqueue_nd_range_kernel(kernel.get(), dimensions, ptr::null(), global, local, &[])
        };
        cl("launching a kernel", event)?;
        cl("waiting for the device", self.queue.finish())?;
        Ok(started.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_whole_work_groups() {
        assert_eq!(Range::from(5).sizes(4), ([8, 1, 1], [4, 1, 1]));
        assert_eq!(Range::from([5, 3]).sizes(4), ([8, 3, 1], [4, 1, 1]));
        assert_eq!(Range::from([4, 3, 2]).sizes(4), ([4, 3, 2], [4, 1, 1]));
        assert_eq!(Range::from(65).sizes(64), ([128, 1, 1], [64, 1, 1]));
        assert_eq!(Range::from([9, 8]).sizes(64), ([16, 8, 1], [8, 8, 1]));
        assert_eq!(Range::from([4, 5, 1]).sizes(64), ([4, 8, 4], [4, 4, 4]));
    }
}
