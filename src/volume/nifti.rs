//! NIfTI-1 in one file (`.nii`, `.nii.gz`): <https://nifti.nimh.nih.gov/nifti-1>.
//!
//! The header is parsed by the `nifti` crate; the voxels are not, since that crate trusts the header's sizes.

use super::inflate::Source;
use super::limits::{VolumeLimits, checked_count};
use super::place::{SPACING_RANGE, checked_axes};
use super::samples::{Endian, RawType, decode};
use super::{NewVolume, Volume};
use crate::error::{Error, Result};
use ::nifti::{Endianness, NiftiHeader};
use glam::{DMat3, DVec3};

/// The number of bytes of the header.
pub(super) const HEADER_BYTES: usize = 348;

/// The offset of the magic in the header.
const MAGIC_AT: usize = 344;

/// The largest offset of the voxels. Larger header extensions (text, mostly) are not waited for.
const MAX_OFFSET: f32 = (64 << 20) as f32;

/// The rows of a map from voxel indices to patient space, and the header's field that gives them.
type Affine = ([[f64; 4]; 4], &'static str);

/// True if the bytes begin with a NIfTI-1 header.
pub(super) fn is_nifti(bytes: &[u8]) -> bool {
    matches!(bytes.get(MAGIC_AT..HEADER_BYTES), Some(b"n+1\0" | b"ni1\0"))
}

/// True if the bytes begin with a NIfTI-2 header. It is recognised to be refused by name.
pub(super) fn is_nifti_2(bytes: &[u8]) -> bool {
    matches!(bytes.get(4..8), Some(b"n+2\0" | b"ni2\0"))
}

/// Reads the volume from its first byte on.
pub(super) fn read(mut source: Source<'_>, name: &str, limits: &VolumeLimits) -> Result<Volume> {
    let mut bytes = [0; HEADER_BYTES];
    let got = source.fill(&mut bytes)?;
    let header = NiftiHeader::from_reader(&bytes[..got])
        .map_err(|cause| Error::Malformed(format!("the NIfTI header cannot be read: {cause}")))?;
    check_kind(&header)?;
    let raw = raw_type(header.datatype)?;
    let (dims, count) = checked_count(sizes(&header)?, raw, limits, "header:dim")?;
    let spacing = spacing(&header, dims)?;
    let (mm_per_unit, unit_note) = length_unit(header.xyzt_units);
    let affine = affine(&header, spacing)?;
    let linear = affine.map(|(rows, pointer)| (linear_part(rows) * mm_per_unit, pointer));
    if let Some((linear, pointer)) = linear {
        checked_axes(linear, pointer)?;
    }
    let offset = data_offset(header.vox_offset)?;
    if !source.skip(offset - HEADER_BYTES as u64)? {
        return Err(Error::invalid("header:vox_offset", "the file ends before its voxels begin", "within the file"));
    }
    let endian = if header.endianness == Endianness::Little { Endian::Little } else { Endian::Big };
    let (voxels, rounding_note) = decode(&mut source, raw, endian, count, "header:dim")?;
    let (slope, inter) = scaling(header.scl_slope, header.scl_inter);
    Volume::new(NewVolume {
        dims,
        spacing: spacing.map(|length| length * mm_per_unit),
        linear: linear.map(|(linear, _)| linear),
        voxels,
        slope,
        inter,
        name: name.to_owned(),
        format: "nifti".to_owned(),
        file_affine: affine.map(|(rows, _)| rows),
        unit: "mm".to_owned(),
        notes: unit_note.into_iter().chain(rounding_note).collect(),
    })
}

fn check_kind(header: &NiftiHeader) -> Result<()> {
    if header.sizeof_hdr != HEADER_BYTES as i32 {
        let detail = format!("is {}", header.sizeof_hdr);
        return Err(Error::invalid("header:sizeof_hdr", detail, "348"));
    }
    if &header.magic != b"n+1\0" {
        let detail = "this is the header of a .hdr/.img pair, whose voxels are in another file";
        return Err(Error::invalid("header:magic", detail, "n+1: header and voxels in one file"));
    }
    Ok(())
}

fn raw_type(datatype: i16) -> Result<RawType> {
    Ok(match datatype {
        2 => RawType::U8,
        4 => RawType::I16,
        8 => RawType::I32,
        16 => RawType::F32,
        64 => RawType::F64,
        256 => RawType::I8,
        512 => RawType::U16,
        768 => RawType::U32,
        1024 => RawType::I64,
        1280 => RawType::U64,
        code => {
            let permitted =
                "2 (u8), 256 (i8), 4 (i16), 512 (u16), 8 (i32), 768 (u32), 1024 (i64), 1280 (u64), 16 (f32), 64 (f64)";
            return Err(Error::invalid("header:datatype", format!("code {code} is not a scalar type"), permitted));
        }
    })
}

/// The three spatial sizes. Axes that the header does not count have size 1.
fn sizes(header: &NiftiHeader) -> Result<[u64; 3]> {
    let axes = usize::from(header.dim[0]);
    if !(1..=7).contains(&axes) {
        return Err(Error::invalid("header:dim", format!("dim[0] announces {axes} axes"), "1 to 7"));
    }
    let size = |axis: usize| if axis <= axes { u64::from(header.dim[axis]) } else { 1 };
    if size(4) > 1 {
        let detail = format!("holds {} time points; only a single one is read, so send one of them", size(4));
        return Err(Error::invalid("header:dim", detail, "dim[4] of 1"));
    }
    if (5..=7).any(|axis| size(axis) > 1) {
        return Err(Error::invalid("header:dim", "holds several values per voxel", "dim[5] to dim[7] of 1"));
    }
    Ok([size(1), size(2), size(3)])
}

/// Voxel distances in the file's unit. An axis of one voxel may leave its own at 0, as writers of slices do.
fn spacing(header: &NiftiHeader, dims: [usize; 3]) -> Result<[f64; 3]> {
    let mut spacing = [1.0; 3];
    for axis in 0..3 {
        let length = f64::from(header.pixdim[axis + 1]);
        if SPACING_RANGE.contains(&length) {
            spacing[axis] = length;
        } else if length != 0.0 || dims[axis] > 1 {
            let detail = format!("pixdim[{}] is {length}", axis + 1);
            return Err(Error::invalid("header:pixdim", detail, "1e-9 to 1e9"));
        }
    }
    Ok(spacing)
}

/// The millimetres per unit of the file, and a note if that had to be assumed.
fn length_unit(xyzt_units: u8) -> (f64, Option<String>) {
    match xyzt_units & 7 {
        0 | 2 => (1.0, None),
        1 => (1000.0, None),
        3 => (0.001, None),
        code => (1.0, Some(format!("xyzt_units has the unknown length unit {code}; taken for mm"))),
    }
}

/// The map of the sform, or else of the qform; `None` without both.
fn affine(header: &NiftiHeader, spacing: [f64; 3]) -> Result<Option<Affine>> {
    const LAST: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    let (rows, pointer) = if header.sform_code > 0 {
        let [x, y, z] = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from));
        ([x, y, z, LAST], "header:srow")
    } else if header.qform_code > 0 {
        (qform(header, spacing), "header:quatern")
    } else {
        return Ok(None);
    };
    if !rows.iter().flatten().all(|value| value.is_finite()) {
        return Err(Error::invalid(pointer, "is not finite", "finite numbers"));
    }
    Ok(Some((rows, pointer)))
}

/// The map from a unit quaternion (its real part left out), an offset and the voxel distances, with `qfac` = ±1 in
/// `pixdim[0]` mirroring the third axis (`nifti_quatern_to_mat44` of the reference library).
fn qform(header: &NiftiHeader, spacing: [f64; 3]) -> [[f64; 4]; 4] {
    let imaginary = DVec3::new(header.quatern_b.into(), header.quatern_c.into(), header.quatern_d.into());
    let rest = 1.0 - imaginary.length_squared();
    // As in the reference, this is a half turn whose real part rounding has made slightly negative.
    let half_turn = rest < 1e-7;
    let a = if half_turn { 0.0 } else { rest.sqrt() };
    let DVec3 { x: b, y: c, z: d } = if half_turn { imaginary.normalize() } else { imaginary };
    let [sx, sy, mut sz] = spacing;
    if header.pixdim[0] < 0.0 {
        sz = -sz;
    }
    let [x, y, z] = [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from);
    [
        [(a * a + b * b - c * c - d * d) * sx, (b * c - a * d) * 2.0 * sy, (b * d + a * c) * 2.0 * sz, x],
        [(b * c + a * d) * 2.0 * sx, (a * a + c * c - b * b - d * d) * sy, (c * d - a * b) * 2.0 * sz, y],
        [(b * d - a * c) * 2.0 * sx, (c * d + a * b) * 2.0 * sy, (a * a + d * d - b * b - c * c) * sz, z],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

/// The upper left 3×3 of the rows.
pub(super) fn linear_part(rows: [[f64; 4]; 4]) -> DMat3 {
    let column = |axis: usize| DVec3::new(rows[0][axis], rows[1][axis], rows[2][axis]);
    DMat3::from_cols(column(0), column(1), column(2))
}

/// The offset of the voxels. 0 stands for "behind the header", as some writers mean it.
fn data_offset(vox_offset: f32) -> Result<u64> {
    match vox_offset {
        0.0 => Ok(352),
        offset if (352.0..=MAX_OFFSET).contains(&offset) && offset.fract() == 0.0 => Ok(offset as u64),
        offset => Err(Error::invalid("header:vox_offset", format!("is {offset}"), "0, or 352 to 67108864")),
    }
}

/// The slope and the intercept. A slope of 0 means "not scaled", and so does one that is not finite.
fn scaling(slope: f32, inter: f32) -> (f64, f64) {
    if slope == 0.0 || !slope.is_finite() {
        return (1.0, 0.0);
    }
    (slope.into(), if inter.is_finite() { inter.into() } else { 0.0 })
}
