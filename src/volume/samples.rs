//! The conversion of a file's bytes to voxels, from every scalar type in both byte orders.

use super::inflate::Source;
use super::voxels::{VoxelType, Voxels};
use crate::error::{Error, Result};
use std::cell::Cell;

/// Byte order of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Endian {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

/// The type of a voxel in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RawType {
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 8 bits; kept in 16.
    I8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 32 bits; kept as `f32`, which rounds beyond ±2²⁴.
    I32,
    /// Unsigned, 32 bits; kept as `f32`, which rounds beyond 2²⁴.
    U32,
    /// Signed, 64 bits; kept as `f32`, which rounds beyond ±2²⁴.
    I64,
    /// Unsigned, 64 bits; kept as `f32`, which rounds beyond 2²⁴.
    U64,
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 double precision; kept as `f32`, which rounds to 24 bits.
    F64,
}

impl RawType {
    /// All types with their names.
    pub const ALL: [(&'static str, Self); 10] = [
        ("u8", Self::U8),
        ("i8", Self::I8),
        ("i16", Self::I16),
        ("u16", Self::U16),
        ("i32", Self::I32),
        ("u32", Self::U32),
        ("i64", Self::I64),
        ("u64", Self::U64),
        ("f32", Self::F32),
        ("f64", Self::F64),
    ];

    /// The bytes of one voxel in the file.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The type in which such voxels are kept.
    pub fn kept_as(self) -> VoxelType {
        match self {
            Self::U8 => VoxelType::U8,
            Self::I8 | Self::I16 => VoxelType::I16,
            Self::U16 => VoxelType::U16,
            _ => VoxelType::F32,
        }
    }
}

/// Reads exactly `count` voxels, which must be all that is left, and returns notes if 32-bit floats cannot hold some of their values: if they were
/// rounded, are too large and became NaN, or are so small that they became 0.
///
/// Memory grows with the data that arrive, not with the number in the header. `pointer` names the header's field that announced `count`.
pub(super) fn decode(
    source: &mut Source<'_>,
    raw: RawType,
    endian: Endian,
    count: usize,
    pointer: &str,
) -> Result<(Voxels, Vec<String>)> {
    check_length(source, raw, count, pointer)?;
    let little = endian == Endian::Little;
    let [rounded, too_large, too_small] = [(); 3].map(|()| Cell::new(0u64));
    let count_one = |cell: &Cell<u64>| cell.set(cell.get() + 1);
    let mut reader = Reader { source, count, pointer };
    macro_rules! read {
        ($type:ty, $convert:expr) => {{
            let convert = $convert;
            if little {
                reader.collect(|bytes| convert(<$type>::from_le_bytes(bytes)))?
            } else {
                reader.collect(|bytes| convert(<$type>::from_be_bytes(bytes)))?
            }
        }};
    }
    macro_rules! read_integer_as_f32 {
        ($type:ty) => {
            read!($type, |value: $type| {
                let kept = value as f32;
                rounded.set(rounded.get() + u64::from(kept as i128 != i128::from(value)));
                kept
            })
        };
    }
    let voxels = match raw {
        RawType::U8 => Voxels::U8(read!(u8, |value: u8| value)),
        RawType::I8 => Voxels::I16(read!(i8, i16::from)),
        RawType::I16 => Voxels::I16(read!(i16, |value: i16| value)),
        RawType::U16 => Voxels::U16(read!(u16, |value: u16| value)),
        RawType::F32 => Voxels::F32(read!(f32, |value: f32| value)),
        RawType::I32 => Voxels::F32(read_integer_as_f32!(i32)),
        RawType::U32 => Voxels::F32(read_integer_as_f32!(u32)),
        RawType::I64 => Voxels::F32(read_integer_as_f32!(i64)),
        RawType::U64 => Voxels::F32(read_integer_as_f32!(u64)),
        RawType::F64 => Voxels::F32(read!(f64, |value: f64| {
            let kept = value as f32;
            match kept {
                _ if !value.is_finite() || f64::from(kept) == value => {}
                _ if kept.is_infinite() => count_one(&too_large),
                _ if kept == 0.0 => count_one(&too_small),
                _ => count_one(&rounded),
            }
            kept
        })),
    };
    let told = [
        (rounded, "were rounded to 32-bit floats"),
        (too_large, "are beyond the range of 32-bit floats (±3.4e38) and were lost: nothing is there"),
        (too_small, "are below the range of 32-bit floats (1.4e-45) and became 0"),
    ];
    let notes =
        told.iter().filter(|(n, _)| n.get() > 0).map(|(n, what)| format!("{} of {count} values {what}", n.get()));
    Ok((voxels, notes.collect()))
}

/// Refuses an impossible number of voxels before any memory is taken. The body's length bounds the number.
fn check_length(source: &Source<'_>, raw: RawType, count: usize, pointer: &str) -> Result<()> {
    let announced = (count as u64).saturating_mul(raw.bytes() as u64);
    let held = source.at_most();
    if source.compressed() && announced > held {
        let detail = format!("announces {announced} bytes of voxels; so few gzip data cannot hold more than {held}");
        return Err(Error::invalid(pointer, detail, "what the data hold"));
    }
    if !source.compressed() && announced != held {
        return Err(mismatch(pointer, announced, &held.to_string()));
    }
    Ok(())
}

fn mismatch(pointer: &str, announced: u64, held: &str) -> Error {
    let detail = format!("announces {announced} bytes of voxels, and {held} follow");
    Error::invalid(pointer, detail, "what the data hold")
}

struct Reader<'a, 'b> {
    source: &'a mut Source<'b>,
    count: usize,
    pointer: &'a str,
}

impl Reader<'_, '_> {
    fn collect<const N: usize, T>(&mut self, mut convert: impl FnMut([u8; N]) -> T) -> Result<Vec<T>> {
        let announced = (self.count as u64).saturating_mul(N as u64);
        let mut values = Vec::with_capacity(self.count.min(self.source.about() / N));
        // The size is a multiple of every type's size, and small enough to stay in the cache between inflating and converting.
        let mut buffer = vec![0u8; 1 << 16];
        while values.len() < self.count {
            let want = (self.count - values.len()).saturating_mul(N).min(buffer.len());
            let got = self.source.fill(&mut buffer[..want])?;
            if got < want {
                let held = values.len() * N + got;
                return Err(mismatch(self.pointer, announced, &format!("only {held}")));
            }
            let (chunks, _) = buffer[..got].as_chunks::<N>();
            values.extend(chunks.iter().map(|&bytes| convert(bytes)));
        }
        if !self.source.at_end()? {
            return Err(mismatch(self.pointer, announced, "more"));
        }
        Ok(values)
    }
}
