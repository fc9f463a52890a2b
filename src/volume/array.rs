//! Arrays of numbers of any number of axes, as uploads bring them: NRRD with its data attached, NumPy's `.npy`, or bare numbers.

use std::collections::HashMap;

use super::inflate::Source;
use super::nrrd;
use super::nrrd_header::Header;
use super::samples::{Endian, RawType, decode};
use super::voxels::Voxels;
use crate::error::{Error, Result};

/// The formats read, in words for the sender of another one.
const FORMATS: &str = "NRRD with its data attached, NumPy's .npy, or bare numbers whose type is told";
/// NumPy's magic: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
const NPY: &[u8] = b"\x93NUMPY";
/// The most bytes of its header, as NumPy's own.
const MOST_HEADER: usize = 10_000;

/// An array.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Values along each axis, the slowest first. Bare numbers have one axis.
    pub shape: Vec<usize>,
    /// The values, the last axis fastest.
    pub values: Vec<f32>,
    /// What single precision has lost, in words.
    pub notes: Vec<String>,
    /// The key/value pairs (`key:=value`) of a NRRD's header.
    pub keys: HashMap<String, String>,
    /// `nrrd`, `npy` or `raw`.
    pub format: &'static str,
}

impl Array {
    /// Reads an array of at most `most` values. Its content tells its format, unless `raw` tells the type of bare numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer that begins with `at`, for bytes that contradict themselves; [`Error::UnsupportedMediaType`] for an
    /// unknown format; [`Error::TooLarge`].
    pub fn read(bytes: &[u8], raw: Option<(RawType, Endian)>, most: usize, at: &str) -> Result<Self> {
        let under = |e: Error| e.with_pointers(|pointer| Some(format!("{at}/{pointer}")));
        if let Some((kind, endian)) = raw {
            let count = bytes.len() / kind.bytes();
            return Self::of(Source::plain(bytes), kind, endian, vec![count], most, "raw").map_err(under);
        }
        if bytes.starts_with(b"NRRD") {
            return Self::of_nrrd(bytes, most).map_err(under);
        }
        if bytes.starts_with(NPY) {
            return Self::of_npy(bytes, most).map_err(under);
        }
        Err(Error::UnsupportedMediaType(format!("{at} is in no known format; this service reads {FORMATS}")))
    }

    fn of_nrrd(bytes: &[u8], most: usize) -> Result<Self> {
        let header = Header::parse(bytes)?;
        let kind = header.raw_type()?;
        let axes = header.integer("dimension", 0)?.clamp(0, 16) as usize;
        let sizes = header.per_axis("sizes", axes)?.unwrap_or_default();
        let mut shape =
            sizes.into_iter().map(|text| text.parse().ok().filter(|n: &usize| *n > 0)).collect::<Option<Vec<_>>>();
        if let Some(shape) = &mut shape {
            shape.reverse();
        }
        let shape = shape.filter(|shape| !shape.is_empty());
        let shape =
            shape.ok_or_else(|| Error::invalid("header:sizes", "are not all sizes", "integers of at least 1"))?;
        let endian = nrrd::endian(&header, kind)?;
        let announced = product(&shape).saturating_mul(kind.bytes()) as u64;
        let source = nrrd::data(&header, bytes, announced)?;
        let array = Self::of(source, kind, endian, shape, most, "nrrd")?;
        Ok(Self { keys: header.into_keys(), ..array })
    }

    fn of_npy(bytes: &[u8], most: usize) -> Result<Self> {
        let (header, rest) = npy_header(bytes)?;
        let descr = after_key(header, "descr")?;
        let (kind, endian) =
            npy_type(descr.trim_start_matches(['\'', '"']).split(['\'', '"']).next().unwrap_or_default())?;
        let in_columns = after_key(header, "fortran_order")?.starts_with("True");
        let shape = after_key(header, "shape")?.strip_prefix('(').and_then(|text| text.split_once(')'));
        let sizes = shape.map(|(text, _)| text.split(',').map(str::trim).filter(|size| !size.is_empty()));
        let sizes = sizes.and_then(|sizes| sizes.map(|size| size.parse().ok()).collect::<Option<Vec<usize>>>());
        let shape = sizes.ok_or_else(|| Error::invalid("header:shape", "is no shape", "a tuple of sizes"))?;
        let as_stored = if in_columns { shape.iter().rev().copied().collect() } else { shape.clone() };
        let mut array = Self::of(Source::plain(rest), kind, endian, as_stored, most, "npy")?;
        if in_columns && shape.len() > 1 {
            array.values = in_rows(&array.values, &shape);
        }
        array.shape = shape;
        Ok(array)
    }

    fn of(
        mut source: Source<'_>,
        kind: RawType,
        endian: Endian,
        shape: Vec<usize>,
        most: usize,
        format: &'static str,
    ) -> Result<Self> {
        let count = product(&shape);
        if count > most {
            return Err(Error::TooLarge {
                what: format!("an array of {shape:?} values"),
                limit: format!("{most} values"),
            });
        }
        let (voxels, notes) = decode(&mut source, kind, endian, count, "header:sizes")?;
        let values = match voxels {
            Voxels::U8(v) => v.into_iter().map(f32::from).collect(),
            Voxels::I16(v) => v.into_iter().map(f32::from).collect(),
            Voxels::U16(v) => v.into_iter().map(f32::from).collect(),
            Voxels::F32(v) => v,
        };
        Ok(Self { shape, values, notes, keys: HashMap::new(), format })
    }
}

/// The header of NumPy's format, and what is behind it. It is read by hand: it is one dictionary of three keys, and a parser of all of Python's literals
/// takes exponential time for brackets in brackets.
fn npy_header(bytes: &[u8]) -> Result<(&str, &[u8])> {
    let at = NPY.len();
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0usize, |n, byte| n << 8 | usize::from(*byte));
    // The length has two bytes in version 1 and four later.
    let begin = if bytes.get(at) == Some(&1) { at + 4 } else { at + 6 };
    let length = bytes.get(at + 2..begin).map(number).filter(|length| *length <= MOST_HEADER);
    let parts = length.and_then(|length| bytes.get(begin..)?.split_at_checked(length));
    let text = parts.and_then(|(header, rest)| Some((std::str::from_utf8(header).ok()?, rest)));
    text.ok_or_else(|| {
        Error::invalid("header:", "is not whole", format!("a NumPy header of at most {MOST_HEADER} bytes"))
    })
}

/// What stands behind a key of the header's dictionary.
fn after_key<'a>(header: &'a str, key: &str) -> Result<&'a str> {
    let found = ['\'', '"'].into_iter().find_map(|quote| header.split_once(&format!("{quote}{key}{quote}")));
    let value = found.and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    value.map(str::trim_start).ok_or_else(|| Error::invalid(format!("header:{key}"), "is missing", "required"))
}

fn product(shape: &[usize]) -> usize {
    shape.iter().fold(1usize, |all, n| all.saturating_mul(*n))
}

/// The values of an array whose first axis is the fastest, with the last one fastest.
fn in_rows(values: &[f32], shape: &[usize]) -> Vec<f32> {
    let mut strides = vec![1; shape.len()];
    for axis in 1..shape.len() {
        strides[axis] = strides[axis - 1] * shape[axis - 1];
    }
    let (mut index, mut at) = (vec![0; shape.len()], 0);
    let mut next = |_| {
        let value = values[at];
        for axis in (0..shape.len()).rev() {
            (index[axis], at) = (index[axis] + 1, at + strides[axis]);
            if index[axis] < shape[axis] {
                break;
            }
            at -= strides[axis] * shape[axis];
            index[axis] = 0;
        }
        value
    };
    (0..values.len()).map(&mut next).collect()
}

/// The type of NumPy's descriptor, such as `<f4`.
fn npy_type(text: &str) -> Result<(RawType, Endian)> {
    let (order, name) = text.split_at(1.min(text.len()));
    let kind = match name {
        "u1" | "b1" => RawType::U8,
        "i1" => RawType::I8,
        "u2" => RawType::U16,
        "i2" => RawType::I16,
        "u4" => RawType::U32,
        "i4" => RawType::I32,
        "u8" => RawType::U64,
        "i8" => RawType::I64,
        "f4" => RawType::F32,
        "f8" => RawType::F64,
        _ => {
            let shown: String = text.chars().take(20).collect();
            let permitted = "integers of 8 to 64 bits, float32, float64";
            return Err(Error::invalid("header:descr", format!("'{shown}' is not read"), permitted));
        }
    };
    Ok((kind, if order == ">" { Endian::Big } else { Endian::Little }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A `.npy` of version 1.0.
    fn npy(descr: &str, in_columns: bool, shape: &str, data: &[u8]) -> Vec<u8> {
        let order = if in_columns { "True" } else { "False" };
        let mut header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
        while !(NPY.len() + 4 + header.len() + 1).is_multiple_of(64) {
            header.push(' ');
        }
        header.push('\n');
        [NPY, &[1, 0], &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
    }

    #[test]
    fn numpys_arrays_are_read_in_any_order_and_type() {
        let floats: Vec<u8> = [1.0f64, 2.0, 3.0, 4.0, 5.0, 6.0].iter().flat_map(|v| v.to_be_bytes()).collect();
        let read = |bytes: &[u8]| Array::read(bytes, None, 6, "data");
        let array = read(&npy(">f8", false, "(2, 3)", &floats)).expect("an array");
        assert_eq!((array.shape, array.values), (vec![2, 3], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let array = read(&npy(">f8", true, "(2, 3)", &floats)).expect("an array");
        assert_eq!((array.shape, array.values), (vec![2, 3], vec![1.0, 3.0, 5.0, 2.0, 4.0, 6.0]));
        let array = read(&npy("<u2", true, "(1, 2, 3)", &[1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 0, 1])).expect("an array");
        assert_eq!(array.values, [1.0, 3.0, 5.0, 2.0, 4.0, 256.0]);
        for wrong in [
            npy("<f8", false, "(2, 4)", &floats),
            npy("<c8", false, "(6,)", &floats),
            npy("<f8", false, "(7,)", &floats),
            NPY.to_vec(),
            b"PK".to_vec(),
            // A parser of nested literals would take years for some of these.
            npy("<f8", false, "[2, 3]", &floats),
            npy("<f8", false, "(2, -3)", &floats),
            [NPY, &[1, 0, 40, 0], &[b'['; 40]].concat(),
            [NPY, &[2, 0, 255, 255, 255, 255], &[b'{'; 25]].concat(),
            [NPY, &[1, 0, 60, 0], &[b'('; 60]].concat(),
        ] {
            assert!(read(&wrong).is_err());
        }
    }

    #[test]
    fn a_nrrd_has_any_number_of_axes_and_keys() {
        let header = "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 3 2\nencoding: raw\ngeometry:={\"a\": 1}\n\n";
        let bytes = [header.as_bytes(), &[1, 2, 3, 4, 5, 6]].concat();
        let array = Array::read(&bytes, None, 6, "data").expect("an array");
        assert_eq!((array.shape, array.values.len(), array.keys["geometry"].as_str()), (vec![2, 3], 6, "{\"a\": 1}"));
        let refused = Array::read(&bytes[..bytes.len() - 1], None, 6, "data");
        assert!(format!("{refused:?}").contains("data/header:sizes"), "{refused:?}");
    }
}
