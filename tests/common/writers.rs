//! Files as other programs write them, byte by byte, so that the readers are not tested against themselves.

use cloudchamber::error::{Error, Result};
use cloudchamber::split_mix::mix;
use cloudchamber::volume::{RawType, Volume, VolumeLimits, read};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;

pub const LIMITS: VolumeLimits = VolumeLimits { max_volume_bytes: 64 << 20, max_side: 4096 };

pub fn read_file(bytes: &[u8]) -> Result<Volume> {
    read(bytes, "test", None, &LIMITS)
}

/// The pointer of the only violation; anything else fails the test.
pub fn pointer(result: Result<Volume>) -> String {
    match result {
        Err(Error::Invalid(violations)) if violations.len() == 1 => violations[0].pointer.clone(),
        Err(other) => panic!("expected one violation, got {other:?}"),
        Ok(volume) => panic!("expected a violation, got a volume of {:?}", volume.dims()),
    }
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A value in the bytes of a type, saturated to it as `as` does.
pub fn encode(raw: RawType, big: bool, value: f64) -> Vec<u8> {
    macro_rules! bytes {
        ($type:ty) => {
            if big { (value as $type).to_be_bytes().to_vec() } else { (value as $type).to_le_bytes().to_vec() }
        };
    }
    match raw {
        RawType::U8 => bytes!(u8),
        RawType::I8 => bytes!(i8),
        RawType::I16 => bytes!(i16),
        RawType::U16 => bytes!(u16),
        RawType::I32 => bytes!(i32),
        RawType::U32 => bytes!(u32),
        RawType::I64 => bytes!(i64),
        RawType::U64 => bytes!(u64),
        RawType::F32 => bytes!(f32),
        RawType::F64 => bytes!(f64),
    }
}

/// The value after a conversion to the type and back.
pub fn through(raw: RawType, value: f64) -> f32 {
    match raw {
        RawType::U8 => f32::from(value as u8),
        RawType::I8 => f32::from(value as i8),
        RawType::I16 => f32::from(value as i16),
        RawType::U16 => f32::from(value as u16),
        RawType::I32 => value as i32 as f32,
        RawType::U32 => value as u32 as f32,
        RawType::I64 => value as i64 as f32,
        RawType::U64 => value as u64 as f32,
        RawType::F32 | RawType::F64 => value as f32,
    }
}

/// A NIfTI-1 file under construction; offsets are those of `nifti1.h`.
pub struct Nifti {
    pub bytes: Vec<u8>,
    big: bool,
}

impl Nifti {
    /// A header of 352 bytes without orientation, with spacing 1.
    pub fn new(big: bool, dims: [u16; 3], raw: RawType) -> Self {
        let code = match raw {
            RawType::U8 => 2,
            RawType::I8 => 256,
            RawType::I16 => 4,
            RawType::U16 => 512,
            RawType::I32 => 8,
            RawType::U32 => 768,
            RawType::I64 => 1024,
            RawType::U64 => 1280,
            RawType::F32 => 16,
            RawType::F64 => 64,
        };
        let mut file = Self { bytes: vec![0; 352], big };
        file.put_i32(0, 348);
        file.put_i16(40, 3);
        for (axis, n) in dims.into_iter().enumerate() {
            file.put_i16(42 + 2 * axis, n as i16);
        }
        file.put_i16(70, code);
        file.put_i16(72, raw.bytes() as i16 * 8);
        (0..4).for_each(|axis| file.put_f32(76 + 4 * axis, 1.0));
        file.put_f32(108, 352.0);
        file.bytes[123] = 2;
        file.bytes[344..348].copy_from_slice(b"n+1\0");
        file
    }

    pub fn put_i16(&mut self, at: usize, value: i16) {
        let bytes = if self.big { value.to_be_bytes() } else { value.to_le_bytes() };
        self.bytes[at..at + 2].copy_from_slice(&bytes);
    }

    pub fn put_i32(&mut self, at: usize, value: i32) {
        let bytes = if self.big { value.to_be_bytes() } else { value.to_le_bytes() };
        self.bytes[at..at + 4].copy_from_slice(&bytes);
    }

    pub fn put_f32(&mut self, at: usize, value: f32) {
        let bytes = if self.big { value.to_be_bytes() } else { value.to_le_bytes() };
        self.bytes[at..at + 4].copy_from_slice(&bytes);
    }

    pub fn put_sform(&mut self, rows: [[f32; 4]; 3]) {
        self.put_i16(254, 1);
        rows.iter().flatten().enumerate().for_each(|(i, &value)| self.put_f32(280 + 4 * i, value));
    }

    /// Sets the quaternion b, c, d and the offset x, y, z.
    pub fn put_qform(&mut self, values: [f32; 6], qfac: f32) {
        self.put_i16(252, 1);
        self.put_f32(76, qfac);
        values.iter().enumerate().for_each(|(i, &value)| self.put_f32(256 + 4 * i, value));
    }

    pub fn with(mut self, data: &[u8]) -> Vec<u8> {
        self.bytes.extend_from_slice(data);
        self.bytes
    }
}

/// A small valid file: 4 x 3 x 2 bytes counting up.
pub fn small_nifti() -> (Nifti, Vec<u8>) {
    (Nifti::new(false, [4, 3, 2], RawType::U8), (0..24).collect())
}

/// A NRRD file of 4 x 3 x 2 bytes with more fields.
pub fn small_nrrd(fields: &str) -> Vec<u8> {
    let data: Vec<u8> = (0..24).collect();
    nrrd(&format!("type: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n{fields}"), &data)
}

pub fn nrrd(fields: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = format!("NRRD0004\n# a comment\n{}\n\n", fields.trim_end()).into_bytes();
    bytes.extend_from_slice(data);
    bytes
}

/// Numbers that are the same in each run (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}
