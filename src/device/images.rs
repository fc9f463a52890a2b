//! Volumes as 3D images, which a GPU interpolates in hardware.

use std::ptr;

use opencl3::context::Context;
use opencl3::memory::{self as m, Image};
use opencl3::types::{cl_image_desc, cl_image_format};

use super::{Buffer, Device, Memory, cl};
use crate::error::Result;
use crate::volume::{VoxelType, Voxels};

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
    /// The voxels as a 3D image of one channel in their own type.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room or does not support such an image.
    pub fn upload_image(&self, voxels: &Voxels, dims: [usize; 3]) -> Result<Buffer> {
        let bytes = voxels.as_bytes();
        let format = cl_image_format {
            image_channel_order: m::CL_R,
            image_channel_data_type: channel_type(voxels.voxel_type()),
        };
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
        let flags = m::CL_MEM_READ_ONLY | m::CL_MEM_COPY_HOST_PTR;
        let from = bytes.as_ptr().cast_mut().cast();
        // SAFETY: format and description live through the call; `from` has the bytes of dims voxels without padding, and OpenCL
        // copies them during the call and does not write.
        let image = unsafe { Image::create(&self.context, flags, &format, &description, from) };
        Ok(Buffer { memory: Memory::Image(cl("making an image", image)?), bytes: bytes.len() })
    }
}
