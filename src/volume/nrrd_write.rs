//! The encoding of a volume as NRRD (attached, raw), the reply of `GET …/field`.

use super::{Volume, Voxels};
use crate::error::Result;
use glam::DVec3;

/// The NRRD bytes of a volume: its voxels in their own type, little-endian, with the axes and the centre of the first voxel in world units.
/// Slope and intercept, if any, are not applied; they stand in the header as key/value pairs.
///
/// # Errors
/// As [`Volume::voxels`].
pub fn write_nrrd(volume: &Volume) -> Result<Vec<u8>> {
    let [nx, ny, nz] = volume.dims();
    let voxels = volume.voxels()?;
    let kind = match voxels {
        Voxels::U8(_) => "uint8",
        Voxels::I16(_) => "int16",
        Voxels::U16(_) => "uint16",
        Voxels::F32(_) => "float",
    };
    let world_from_index = volume.world_from_index();
    let vector = |v: DVec3| format!("({},{},{})", v.x, v.y, v.z);
    let axes = world_from_index.matrix3;
    let first = world_from_index.transform_point3(DVec3::splat(0.5));
    let mut header = format!(
        "NRRD0005\n# {}\ntype: {kind}\ndimension: 3\nspace dimension: 3\nsizes: {nx} {ny} {nz}\nspace directions: {} {} {}\n\
         kinds: domain domain domain\nendian: little\nencoding: raw\nspace origin: {}\n",
        volume.name().replace(['\n', '\r'], " "),
        vector(axes.x_axis),
        vector(axes.y_axis),
        vector(axes.z_axis),
        vector(first),
    );
    if volume.slope() != 1.0 || volume.inter() != 0.0 {
        header += &format!("slope:={}\nintercept:={}\n", volume.slope(), volume.inter());
    }
    let mut bytes = (header + "\n").into_bytes();
    bytes.extend_from_slice(voxels.as_bytes());
    Ok(bytes)
}
