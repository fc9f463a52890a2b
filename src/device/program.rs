//! The kernels' text, and the variants that may be built. All variants are listed; none is composed at run time.

use std::path::Path;

use super::enums::DeviceEnum;
use super::include::{assemble, read};
use super::numbers::{CELL, define};
use super::structs::Layout;
use crate::error::{Error, Result};
use crate::volume::VoxelType;

impl DeviceEnum for VoxelType {
    const PREFIX: &'static str = "VOXEL";
    const ALL: &'static [Self] = &VoxelType::ALL;
    fn number(self) -> i32 {
        self as i32
    }
}

/// The `-D NAME=VALUE` options of a variant.
pub type Features = &'static [(&'static str, i32)];

fn words(features: &[(&str, i32)]) -> String {
    features.iter().map(|(name, value)| format!(" {name}={value}")).collect()
}

/// Every listed combination of features for every type of voxels, the first combination first.
pub fn each_voxel_type<F: AsRef<[(&'static str, i32)]>>(kernel: &'static str, list: &'static [F]) -> Vec<Variant> {
    let of = |features: &'static F| VoxelType::ALL.map(|voxel| Variant::new(kernel, Some(voxel), features.as_ref()));
    list.iter().flat_map(of).collect()
}

/// The features of `list` that are `wanted`, for a variant of `kernel`.
///
/// # Errors
/// [`Error::Internal`] naming the features if they are not listed: no kernel was tested with them.
pub fn listed<F>(kernel: &str, list: &'static [F], wanted: F) -> Result<&'static F>
where
    F: AsRef<[(&'static str, i32)]> + PartialEq,
{
    let missing = || Error::internal(format!("{kernel}{} is no listed variant", words(wanted.as_ref())));
    list.iter().find(|features| **features == wanted).ok_or_else(missing)
}

/// One permitted build of one kernel function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// The name of the kernel's file, `kernels/<name>.cl`: that of its [`Source`].
    pub kernel: &'static str,
    /// The kernel function in it.
    pub function: &'static str,
    /// The volume's voxel type, if the kernel reads a volume.
    pub voxel: Option<VoxelType>,
    /// The compiled-in features, `-D NAME=VALUE`.
    pub features: Features,
}

/// The source of a program: its file, and the text that the host adds.
#[derive(Debug, Clone)]
pub struct Source {
    /// The kernel file's name, without `.cl`.
    pub kernel: &'static str,
    /// OpenCL C text before everything else: enums, numbers, extensions.
    pub words: fn() -> String,
    /// The structs that it shares with the host.
    pub structs: fn() -> Vec<Layout>,
    /// Every variant that may be built.
    pub variants: fn() -> Vec<Variant>,
    /// The number of variants, from the first on, that are built before the service is ready; the others are built when first asked for.
    pub common: usize,
}

impl Source {
    /// The whole text in one string: the structs, then the kernel file with all its includes.
    ///
    /// # Errors
    /// [`Error::Internal`] if a file is missing, or files include each other in a circle.
    pub fn text(&self, overrides: Option<&Path>) -> Result<String> {
        let kernel = assemble(&format!("{}.cl", self.kernel), &|name| read(overrides, name))?;
        let structs: String = (self.structs)().iter().map(|layout| (layout.opencl_text)()).collect();
        let all = VoxelType::opencl_text() + &define("CELL", CELL);
        Ok(format!("#line 1 \"structs\"\n{all}{}{structs}{kernel}", (self.words)()))
    }
}

impl Variant {
    /// A variant of the kernel function that has its file's name.
    pub const fn new(kernel: &'static str, voxel: Option<VoxelType>, features: Features) -> Self {
        Self { kernel, function: kernel, voxel, features }
    }

    /// The variant of another kernel function in the same file.
    pub const fn of_function(self, function: &'static str) -> Self {
        Self { function, ..self }
    }

    /// The build options; `strict` makes warnings errors, as tests do. They exclude `-cl-fast-relaxed-math`, which would let the compiler assume that
    /// no NaN occurs.
    pub fn options(&self, lanes: u32, images: bool, strict: bool) -> String {
        let mut options = format!("-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -DLANES={lanes}");
        if strict {
            options += " -Werror";
        }
        if images {
            options += " -DVOLUMES_ARE_IMAGES=1";
        }
        if let Some(voxel) = self.voxel {
            options += &format!(" -DVOXEL={}", voxel.number());
        }
        for (name, value) in self.features {
            options += &format!(" -D{name}={value}");
        }
        options
    }

    /// A name for logs, such as `emission_absorption u8 SHADED=1`. If the function's name differs from the file's, it follows the file's name and a
    /// dot.
    pub fn label(&self) -> String {
        let voxel = self.voxel.map(|v| format!(" {v:?}").to_lowercase()).unwrap_or_default();
        let function = if self.function == self.kernel { String::new() } else { format!(".{}", self.function) };
        format!("{}{function}{voxel}{}", self.kernel, words(self.features))
    }
}
