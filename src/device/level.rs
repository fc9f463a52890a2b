//! For which instruction set the device's compiler makes code: what its own macros say of it.

use super::Device;
use super::program::{Source, Variant};
use crate::error::{Error, Result};

/// By the number that `kernels/level.cl` writes.
const LEVELS: [&str; 7] = ["generic", "NEON", "SSE4.1", "SSE4.2", "AVX", "AVX2", "AVX-512"];

/// The level's name; `generic` where it is none of those that kernels have forms for, as on a GPU.
///
/// # Errors
/// [`Error::Internal`] when the smallest of kernels does not build or run: then none does.
pub(super) fn of(device: &mut Device) -> Result<&'static str> {
    let variant = Variant::new("level", None, &[]);
    let source = Source { kernel: "level", structs: String::new, variants: Vec::new, common: 0 };
    device.build(&source, &variant)?;
    let mut number = [0i32];
    let out = device.upload(bytemuck::cast_slice(&number), 0)?;
    device.run(&variant, &[("out", &out)], 1)?;
    device.read(&out, 0, &mut number)?;
    LEVELS.get(number[0] as usize).copied().ok_or_else(|| Error::internal("an unknown level"))
}
