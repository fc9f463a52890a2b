//! Volumes as 3D images, which a GPU interpolates in hardware.

use std::ptr;

use opencl3::context::Context;
use opencl3::memory::{self as m, Image};
use opencl3::types::{cl_image_desc, cl_image_format};

use super::{Buffer, Device, Memory, cl};
use crate::error::{Error, Result};
use crate::volume::VoxelType;

/// The formats of read-only 3D images, by OpenCL's names for the ones in use here and by number for the rest.
pub(super) fn formats(context: &Context) -> Vec<String> {
    let order = |o| match o {
        m::CL_R => "R".into(),
        m::CL_RG => "RG".into(),
        m::CL_RGBA => "RGBA".into(),
        m::CL_INTENSITY => "INTENSITY".into(),
        m::CL_LUMINANCE => "LUMINANCE".into(),
        other => format!("{other:#x}"),
    };
    let kind = |t| match t {
        m::CL_UNORM_INT8 => "UNORM_INT8".into(),
        m::CL_UNORM_INT16 => "UNORM_INT16".into(),
        m::CL_SNORM_INT16 => "SNORM_INT16".into(),
        m::CL_UNSIGNED_INT8 => "UNSIGNED_INT8".into(),
        m::CL_UNSIGNED_INT16 => "UNSIGNED_INT16".into(),
        m::CL_SIGNED_INT16 => "SIGNED_INT16".into(),
        m::CL_HALF_FLOAT => "HALF_FLOAT".into(),
        m::CL_FLOAT => "FLOAT".into(),
        other => format!("{other:#x}"),
    };
    let formats =
        context.get_supported_image_formats(m::CL_MEM_READ_ONLY, m::CL_MEM_OBJECT_IMAGE3D).unwrap_or_default();
    let name = |f: &opencl3::types::cl_image_format| -> String {
        let (order, kind): (String, String) = (order(f.image_channel_order), kind(f.image_channel_data_type));
        format!("{order}/{kind}")
    };
    formats.iter().map(name).collect()
}

/// The type as which a sampler reads each voxel type: a normalised one, so that the sampler filters it.
fn channel_type(voxel: VoxelType) -> u32 {
    match voxel {
        VoxelType::U8 => m::CL_UNORM_INT8,
        VoxelType::I16 => m::CL_SNORM_INT16,
        VoxelType::U16 => m::CL_UNORM_INT16,
        VoxelType::F32 => m::CL_FLOAT,
    }
}

impl Device {
    /// A copy of voxels as a 3D image of one channel in their own type.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room or does not support such an image.
    pub fn image_of(&self, voxels: &Buffer, voxel: VoxelType, dims: [usize; 3]) -> Result<Buffer> {
        let bytes = voxel.bytes() * dims.iter().product::<usize>();
        let (true, Memory::Bytes(from)) = (bytes <= voxels.bytes, &voxels.memory) else {
            return Err(Error::internal("an image of more voxels than there are, or of an image"));
        };
        let format = cl_image_format { image_channel_order: m::CL_R, image_channel_data_type: channel_type(voxel) };
        let description = cl_image_desc {
            image_type: m::CL_MEM_OBJECT_IMAGE3D,
            image_width: dims[0],
            image_height: dims[1],
            image_depth: dims[2],
            image_array_size: 1,
            image_row_pitch: 0,
            image_slice_pitch: 0,
            num_mip_levels: 0,
            num_samples: 0,
            buffer: ptr::null_mut(),
        };
        // SAFETY: format and description live through the call, and no host pointer is given.
        let image =
            unsafe { Image::create(&self.context, m::CL_MEM_READ_ONLY, &format, &description, ptr::null_mut()) };
        let mut image = cl("making an image", image)?;
        let origin = [0usize; 3];
        // SAFETY: the buffer has the bytes of dims voxels without padding, and both arrays have three elements and live through the call.
        let copied = unsafe {
            self.queue.enqueue_copy_buffer_to_image(from, &mut image, 0, origin.as_ptr(), dims.as_ptr(), &[])
        };
        cl("copying voxels to an image", copied)?;
        cl("waiting for the device", self.queue.finish())?;
        Ok(Buffer { memory: Memory::Image(image), bytes })
    }
}
