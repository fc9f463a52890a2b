//! The interpolation of values between voxels.

use schemars::JsonSchema;
use serde::Deserialize;

/// How values lie between voxels; the numbers are those of `kernels/shared/volume.h`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// The voxel that a place is in.
    Nearest,
    /// Linear along each axis between voxel centres.
    Trilinear,
    /// Cubic B-spline along each axis: smooth to its second derivative, and blurs.
    BSpline,
    /// Catmull-Rom spline along each axis: goes through the voxels, and may overshoot between them.
    CatmullRom,
}

impl Interpolation {
    /// The value of the kernels' `INTERPOLATION`.
    pub const fn code(self) -> i32 {
        match self {
            Self::Nearest => 0,
            Self::Trilinear => 1,
            Self::BSpline => 2,
            Self::CatmullRom => 3,
        }
    }
}
