//! The checks of a new volume's axes and scaling.

use glam::{DAffine3, DMat3, DVec3};

use super::NewVolume;
use crate::error::{Error, Result};

/// Voxel spacings outside of this range are taken for damage; in mm these are a picometre and a thousand kilometres.
pub(super) const SPACING_RANGE: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

impl NewVolume {
    /// The parts with checked spacing and scaling, and the world from index.
    pub(super) fn placed(mut self) -> Result<(Self, DAffine3)> {
        if !(self.slope.is_finite() && self.slope != 0.0 && self.inter.is_finite()) {
            return Err(Error::invalid(
                "header:scl_slope",
                "the scaling is not finite, or zero",
                "finite, slope not 0",
            ));
        }
        let linear = match self.linear {
            Some(linear) => linear,
            None => DMat3::from_diagonal(DVec3::from_array(self.spacing)),
        };
        self.spacing = checked_axes(linear, "header:spacing")?;
        let half = DVec3::from_array(self.dims.map(|n| n as f64 / 2.0));
        Ok((self, DAffine3::from_mat3_translation(linear, -(linear * half))))
    }
}

/// The lengths of the columns, if they are usable as axes of a grid: finite, of sane length, and linearly independent.
pub(super) fn checked_axes(linear: DMat3, pointer: &str) -> Result<[f64; 3]> {
    let lengths = [linear.x_axis.length(), linear.y_axis.length(), linear.z_axis.length()];
    if !lengths.iter().all(|length| SPACING_RANGE.contains(length)) {
        let detail = format!("the steps from voxel to voxel have the lengths {lengths:?}");
        return Err(Error::invalid(pointer, detail, "finite, 1e-9 to 1e9"));
    }
    // The volume spanned by the unit axes: 1 for a right-angled grid, 0 if the axes lie in a plane.
    let independence = linear.determinant().abs() / (lengths[0] * lengths[1] * lengths[2]);
    if independence.is_nan() || independence < 1e-6 {
        return Err(Error::invalid(pointer, "the axes of the grid lie in one plane", "three independent axes"));
    }
    Ok(lengths)
}

/// The scaled range. It is refused if a value would leave the range of 32-bit floats on the device.
pub(super) fn physical_range(raw: [f64; 2], slope: f64, inter: f64) -> Result<[f64; 2]> {
    let ends = raw.map(|value| value * slope + inter);
    if ends.iter().any(|end| !(*end as f32).is_finite()) {
        let detail = format!("the scaled values reach {:e} and {:e}", ends[0], ends[1]);
        return Err(Error::invalid("header:scl_slope", detail, "within ±3.4e38"));
    }
    Ok([ends[0].min(ends[1]), ends[0].max(ends[1])])
}
