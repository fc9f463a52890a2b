//! Numbers that host and kernels share. They are declared once, in Rust, and stand in a program before its first file.

/// Voxels along an edge of a macro-cell: `CELL` of all kernels.
pub const CELL: usize = 4;

/// The `#define` of a number for the kernels.
pub fn define(name: &str, value: impl std::fmt::Display) -> String {
    format!("#define {name} {value}\n")
}
