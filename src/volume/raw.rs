//! Bare voxels, described by query parameters: `?dims=181,217,181&type=u8&spacing=1,1,1&endian=little`.

use super::inflate::Source;
use super::limits::{VolumeLimits, checked_count};
use super::place::SPACING_RANGE;
use super::samples::{Endian, RawType, decode};
use super::{NewVolume, Volume};
use crate::error::{Error, Result, Violation};

/// The query parameters as they come; all absent means that the body describes itself.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawQuery {
    /// Voxels along x, y, z, separated by `,` or `x`.
    pub dims: Option<String>,
    /// Type of a voxel: `u8`, `i8`, `i16`, `u16`, `i32`, `u32`, `i64`, `u64`, `f32` or `f64`.
    pub r#type: Option<String>,
    /// Distance between neighbouring voxels along x, y, z in mm; 1,1,1 if absent.
    pub spacing: Option<String>,
    /// Byte order: `little` (the default) or `big`.
    pub endian: Option<String>,
}

/// What a body of bare voxels holds.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawParams {
    /// Voxels along x, y, z; x varies fastest.
    pub dims: [usize; 3],
    /// Type of a voxel in the body.
    pub voxel_type: RawType,
    /// Distance between neighbouring voxels in mm.
    pub spacing: [f64; 3],
    /// Byte order of the body.
    pub endian: Endian,
}

impl RawQuery {
    /// The parameters; `None` if none is given.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a violation for each parameter that is missing or wrong.
    pub fn parse(&self) -> Result<Option<RawParams>> {
        if *self == Self::default() {
            return Ok(None);
        }
        let dims = required(&self.dims, "query:dims").and_then(|text| parse_dims(text));
        let voxel_type = required(&self.r#type, "query:type").and_then(|text| parse_type(text));
        let spacing = self.spacing.as_deref().map_or(Ok([1.0; 3]), parse_spacing);
        let endian = self.endian.as_deref().map_or(Ok(Endian::Little), parse_endian);
        match (dims, voxel_type, spacing, endian) {
            (Ok(dims), Ok(voxel_type), Ok(spacing), Ok(endian)) => {
                Ok(Some(RawParams { dims, voxel_type, spacing, endian }))
            }
            (dims, voxel_type, spacing, endian) => {
                let violations = [dims.err(), voxel_type.err(), spacing.err(), endian.err()];
                Err(Error::Invalid(violations.into_iter().flatten().collect()))
            }
        }
    }
}

fn required<'a>(value: &'a Option<String>, pointer: &str) -> Result<&'a String, Violation> {
    let permitted = "raw voxels need both dims and type, such as dims=181,217,181&type=u8";
    value.as_ref().ok_or_else(|| Violation::new(pointer, "is missing", permitted))
}

/// Three values separated by `,` or `x`.
fn triple<T: std::str::FromStr + Copy>(text: &str) -> Option<[T; 3]> {
    let values: Vec<T> = text.split([',', 'x']).map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    values.try_into().ok()
}

fn parse_dims(text: &str) -> Result<[usize; 3], Violation> {
    let dims = triple(text).filter(|dims: &[usize; 3]| !dims.contains(&0));
    dims.ok_or_else(|| {
        Violation::new(
            "query:dims",
            format!("'{text}' is not a size"),
            "three integers of at least 1, such as 181,217,181",
        )
    })
}

fn parse_type(text: &str) -> Result<RawType, Violation> {
    let known = RawType::ALL.iter().find(|(name, _)| *name == text);
    known.map(|&(_, raw)| raw).ok_or_else(|| {
        let names: Vec<_> = RawType::ALL.iter().map(|(name, _)| *name).collect();
        Violation::new("query:type", format!("'{text}' is not a voxel type"), names.join(", "))
    })
}

fn parse_spacing(text: &str) -> Result<[f64; 3], Violation> {
    let spacing = triple(text).filter(|spacing: &[f64; 3]| spacing.iter().all(|mm| SPACING_RANGE.contains(mm)));
    spacing.ok_or_else(|| {
        Violation::new(
            "query:spacing",
            format!("'{text}' is not a spacing"),
            "three numbers from 1e-9 to 1e9, such as 1,1,2.5",
        )
    })
}

fn parse_endian(text: &str) -> Result<Endian, Violation> {
    match text {
        "little" => Ok(Endian::Little),
        "big" => Ok(Endian::Big),
        _ => Err(Violation::new("query:endian", format!("'{text}' is not a byte order"), "little, big")),
    }
}

/// Reads a body that holds exactly the voxels described.
pub(super) fn read(bytes: &[u8], name: &str, params: &RawParams, limits: &VolumeLimits) -> Result<Volume> {
    let sizes = params.dims.map(|n| n as u64);
    let (dims, count) = checked_count(sizes, params.voxel_type, limits, "query:dims")?;
    let mut source = Source::plain(bytes);
    let (voxels, note) = decode(&mut source, params.voxel_type, params.endian, count, "query:dims")?;
    Volume::new(NewVolume {
        dims,
        spacing: params.spacing,
        linear: None,
        voxels,
        slope: 1.0,
        inter: 0.0,
        name: name.to_owned(),
        format: "raw".to_owned(),
        file_affine: None,
        unit: "mm".to_owned(),
        notes: note.into_iter().collect(),
    })
}
