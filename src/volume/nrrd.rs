//! NRRD with its data attached, raw or gzip: <https://teem.sourceforge.net/nrrd/format.html>.

use super::inflate::Source;
use super::limits::{VolumeLimits, checked_count};
use super::nrrd_header::{Header, vector};
use super::place::{SPACING_RANGE, checked_axes};
use super::samples::{Endian, RawType, decode};
use super::{NewVolume, Volume};
use crate::error::{Error, Result};
use glam::{DMat3, DVec3};

/// The most decompressed bytes that are skipped.
const MAX_SKIP: u64 = 64 << 20;

/// Reads the volume from the file's first byte on.
pub(super) fn read(bytes: &[u8], name: &str, limits: &VolumeLimits) -> Result<Volume> {
    let header = Header::parse(bytes)?;
    let raw = header.raw_type()?;
    let axes = Axes::new(&header)?;
    let (dims, count) = checked_count(axes.pick(&axes.sizes), raw, limits, "header:sizes")?;
    let (mm_per_unit, unit_note) = length_unit(&header, &axes);
    let orientation = orientation(&header, &axes)?;
    let spacing = spacing(&header, &axes)?.map(|length| length * mm_per_unit);
    let endian = endian(&header, raw)?;
    let mut source = data(&header, bytes, (count as u64).saturating_mul(raw.bytes() as u64))?;
    let (voxels, rounding_note) = decode(&mut source, raw, endian, count, "header:sizes")?;
    Volume::new(NewVolume {
        dims,
        spacing,
        linear: orientation.map(|(linear, _)| linear * mm_per_unit),
        voxels,
        slope: 1.0,
        inter: 0.0,
        name: name.to_owned(),
        format: "nrrd".to_owned(),
        file_affine: orientation.map(|(linear, origin)| rows(linear, origin)),
        unit: "mm".to_owned(),
        notes: unit_note.into_iter().chain(rounding_note).collect(),
    })
}

/// The axes of the file: three, or four if the first or the last has size 1 and is left out.
struct Axes {
    sizes: Vec<u64>,
    left_out: Option<usize>,
    directions: Option<Vec<Option<[f64; 3]>>>,
}

impl Axes {
    fn new(header: &Header) -> Result<Self> {
        let dimension = header.required("dimension")?;
        let axes = match dimension {
            "3" => 3,
            "4" => 4,
            _ => {
                let shown: String = dimension.chars().take(20).collect();
                return Err(Error::invalid(
                    "header:dimension",
                    format!("is {shown}"),
                    "3, or 4 with an axis of size 1",
                ));
            }
        };
        header.required("sizes")?;
        let sizes = header.per_axis("sizes", axes)?.unwrap_or_default();
        let parse = |text: &str| text.parse::<u64>().ok().filter(|&size| size > 0);
        let Some(sizes) = sizes.into_iter().map(parse).collect::<Option<Vec<_>>>() else {
            return Err(Error::invalid("header:sizes", "are not all sizes", "integers of at least 1"));
        };
        let directions = header.vectors("space directions", axes)?;
        if axes == 3 {
            return Ok(Self { sizes, left_out: None, directions });
        }
        // If both outer axes have size 1, the one without a direction in space is not spatial.
        let spatial = |axis: usize| directions.as_ref().is_none_or(|directions| directions[axis].is_some());
        let single = [3, 0].into_iter().filter(|&axis| sizes[axis] == 1);
        let Some(left_out) = single.min_by_key(|&axis| spatial(axis)) else {
            let detail = format!("four axes of sizes {sizes:?}; one value a voxel is read");
            return Err(Error::invalid("header:sizes", detail, "first or last of four sizes 1"));
        };
        Ok(Self { sizes, left_out: Some(left_out), directions })
    }

    /// The values of the three spatial axes, from one value per axis.
    fn pick<T: Copy>(&self, values: &[T]) -> [T; 3] {
        let first = if self.left_out == Some(0) { 1 } else { 0 };
        [values[first], values[first + 1], values[first + 2]]
    }
}

/// Voxel distances from `spacings`, or 1 without them.
fn spacing(header: &Header, axes: &Axes) -> Result<[f64; 3]> {
    let Some(spacings) = header.per_axis("spacings", axes.sizes.len())? else { return Ok([1.0; 3]) };
    let mut spacing = [1.0; 3];
    for (length, text) in spacing.iter_mut().zip(axes.pick(&spacings)) {
        *length = text.parse().ok().filter(|length: &f64| SPACING_RANGE.contains(length)).ok_or_else(|| {
            let shown: String = text.chars().take(20).collect();
            Error::invalid("header:spacings", format!("'{shown}' is not a spacing"), "1e-9 to 1e9")
        })?;
    }
    Ok(spacing)
}

/// Steps from voxel to voxel and the first voxel's centre, in RAS axes and the file's unit.
fn orientation(header: &Header, axes: &Axes) -> Result<Option<(DMat3, DVec3)>> {
    let Some(directions) = &axes.directions else { return Ok(None) };
    let [Some(x), Some(y), Some(z)] = axes.pick(directions) else {
        return Err(Error::invalid("header:space directions", "a spatial axis has none", "three vectors"));
    };
    let ras = DMat3::from_diagonal(ras_from_space(header)?);
    let linear = ras * DMat3::from_cols(x.into(), y.into(), z.into());
    checked_axes(linear, "header:space directions")?;
    let origin = header.get("space origin").map_or(Ok([0.0; 3]), |text| vector("space origin", text))?;
    Ok(Some((linear, ras * DVec3::from_array(origin))))
}

/// The signs that take the file's space to right, anterior, superior.
fn ras_from_space(header: &Header) -> Result<DVec3> {
    let Some(space) = header.get("space") else { return Ok(DVec3::ONE) };
    match space.to_ascii_lowercase().as_str() {
        "right-anterior-superior" | "ras" | "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => Ok(DVec3::ONE),
        "left-anterior-superior" | "las" => Ok(DVec3::new(-1.0, 1.0, 1.0)),
        "left-posterior-superior" | "lps" => Ok(DVec3::new(-1.0, -1.0, 1.0)),
        other => {
            let shown: String = other.chars().take(40).collect();
            let permitted = "right-anterior-superior, left-anterior-superior, left-posterior-superior, scanner-xyz, \
                3D-right-handed, 3D-left-handed";
            Err(Error::invalid("header:space", format!("'{shown}' is not a space of three axes"), permitted))
        }
    }
}

fn rows(linear: DMat3, origin: DVec3) -> [[f64; 4]; 4] {
    let row = |i: usize| [linear.x_axis[i], linear.y_axis[i], linear.z_axis[i], origin[i]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// The millimetres per unit of the file, and a note if that had to be assumed.
fn length_unit(header: &Header, axes: &Axes) -> (f64, Option<String>) {
    // `space units` has one entry a dimension of space, `units` one an axis.
    let (text, per_axis) = match (header.get("space units"), header.get("units")) {
        (Some(text), _) => (text, false),
        (None, Some(text)) => (text, true),
        (None, None) => return (1.0, None),
    };
    let quoted: Vec<&str> = text.split('"').skip(1).step_by(2).collect();
    let units = if per_axis && quoted.len() == axes.sizes.len() { axes.pick(&quoted).to_vec() } else { quoted };
    let known = match units.first().map(|unit| unit.trim().to_ascii_lowercase()).as_deref() {
        _ if units.iter().any(|unit| units.first() != Some(unit)) => None,
        Some("mm" | "millimeter" | "millimeters" | "millimetre") => Some(1.0),
        Some("cm") => Some(10.0),
        Some("m" | "meter" | "meters" | "metre") => Some(1000.0),
        Some("um" | "µm" | "μm" | "micron" | "microns" | "micrometer") => Some(1e-3),
        Some("nm") => Some(1e-6),
        _ => None,
    };
    let note = || "the length unit is unknown, or differs between the axes; taken for mm".to_owned();
    (known.unwrap_or(1.0), known.is_none().then(note))
}

/// The byte order, which one-byte values need not have.
pub(super) fn endian(header: &Header, raw: RawType) -> Result<Endian> {
    match header.get("endian").map(str::to_ascii_lowercase).as_deref() {
        Some("little") => Ok(Endian::Little),
        Some("big") => Ok(Endian::Big),
        None if raw.bytes() == 1 => Ok(Endian::Little),
        _ => Err(Error::invalid("header:endian", "is missing or unknown", "little, big")),
    }
}

/// The data, after the lines and bytes to be skipped. In gzip data, lines are skipped before inflating and bytes after.
pub(super) fn data<'a>(header: &Header, bytes: &'a [u8], announced: u64) -> Result<Source<'a>> {
    let mut rest = bytes.get(header.data_at..).unwrap_or_default();
    for _ in 0..header.integer("line skip", 0)?.max(0) {
        let end = rest.iter().position(|&byte| byte == b'\n');
        let end =
            end.ok_or_else(|| Error::invalid("header:line skip", "there are fewer lines", "lines of the file"))?;
        rest = &rest[end + 1..];
    }
    let skip = header.integer("byte skip", 0)?;
    let compressed = match header.required("encoding")?.to_ascii_lowercase().as_str() {
        "raw" => false,
        "gzip" | "gz" => true,
        other => {
            let shown: String = other.chars().take(20).collect();
            return Err(Error::invalid("header:encoding", format!("'{shown}' is not read"), "raw, gzip"));
        }
    };
    if skip == -1 && !compressed {
        // The data are the last bytes of the file.
        let start = usize::try_from(announced).ok().and_then(|announced| rest.len().checked_sub(announced));
        return Ok(Source::plain(start.and_then(|start| rest.get(start..)).unwrap_or(rest)));
    }
    let mut source = if compressed { Source::gzip(rest) } else { Source::plain(rest) };
    let bytes_to_skip = u64::try_from(skip).ok().filter(|&skip| skip <= MAX_SKIP);
    match bytes_to_skip.map(|count| source.skip(count)).transpose()? {
        Some(true) => Ok(source),
        _ => Err(Error::invalid("header:byte skip", format!("is {skip}"), "bytes of the data; -1 for raw only")),
    }
}
