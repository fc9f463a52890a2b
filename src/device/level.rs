//! The instruction set for which the device's compiler makes code, by the compiler's own macros.

use super::Device;
use super::enums::DeviceEnum;
use super::program::{Source, Variant};
use crate::device_enum;
use crate::error::{Error, Result};

device_enum! {
    /// Instruction sets that kernels have forms for.
    pub enum Level: "LEVEL" {
        /// None of the others, as on a GPU.
        Generic,
        /// ARM's 128-bit vectors.
        Neon,
        /// SSE 4.1.
        Sse41,
        /// SSE 4.2.
        Sse42,
        /// 256-bit floats.
        Avx,
        /// 256-bit integers too.
        Avx2,
        /// 512 bits, with the F, BW, DQ and VL parts.
        Avx512,
    }
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Generic => "generic",
            Self::Neon => "NEON",
            Self::Sse41 => "SSE4.1",
            Self::Sse42 => "SSE4.2",
            Self::Avx => "AVX",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// The level's name; `generic` if kernels have no form for it, as on a GPU.
///
/// # Errors
/// [`Error::Internal`] if the smallest of kernels does not build or run: then none does.
pub(super) fn of(device: &mut Device) -> Result<&'static str> {
    let variant = Variant::new("level", None, &[]);
    let source =
        Source { kernel: "level", words: Level::opencl_text, structs: Vec::new, variants: Vec::new, common: 0 };
    device.build(&source, &variant)?;
    let mut number = [0i32];
    let out = device.upload(bytemuck::cast_slice(&number), 0)?;
    device.run(&variant, &[("out", &out)], 1)?;
    device.read(&out, 0, &mut number)?;
    let level = Level::ALL.iter().find(|level| level.code() == number[0]);
    level.map(|level| level.name()).ok_or_else(|| Error::internal("an unknown level"))
}
