//! The kernels of the first picture, built before the service is ready.

use super::compile::Compiler;
use super::sources;
use super::warm::{is_cached, warm};
use crate::device::Device;
use crate::device::program::Variant;
use crate::error::{Error, Result};

/// Builds the kernels of the first picture. If there is a compiler, two of its processes compile them first, since a kernel that LLVM cannot
/// compile then ends only that process.
///
/// # Errors
/// [`Error::Internal`] with the compiler's words.
pub(super) fn first_kernels(device: &mut Device, compiler: Option<&Compiler>) -> Result<()> {
    let first = sources::first();
    if let Some(compiler) = compiler.filter(|_| device.info().is_pocl()) {
        let missing: Vec<Variant> = first.iter().filter(|v| !is_cached(device, v)).copied().collect();
        let compile = |part: &[Variant]| {
            let mut process = None;
            part.iter().try_for_each(|variant| {
                let compiled = compiler.compile(&mut process, variant);
                compiled.map_err(|words| Error::internal(format!("{}: {words}", variant.label())))
            })
        };
        let (one, other) = missing.split_at(missing.len() / 2);
        let (one, other) = rayon::join(|| compile(one), || compile(other));
        one.and(other)?;
    }
    first.iter().try_for_each(|variant| warm(device, variant))
}
