//! The amount of a density along straight lines through a volume. It decides the model that a scene needs.

use crate::error::Result;
use crate::volume::Volume;

/// The most lines along a side of a face.
const LINES: usize = 32;

/// The greatest integral of `density` (of a value) along lines parallel to each of the volume's own axes, in world units. Each axis has up
/// to `LINES`² lines, spread evenly over the face. Values that are not finite count as empty.
///
/// # Errors
/// As [`Volume::voxels`].
pub fn greatest_along_axes(volume: &Volume, density: impl Fn(f64) -> f64) -> Result<[f64; 3]> {
    let (dims, spacing, values) = (volume.dims(), volume.spacing(), volume.values()?);
    Ok(std::array::from_fn(|axis| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let places = |a: usize| {
            let lines = dims[a].min(LINES);
            (0..lines).map(move |i| (2 * i + 1) * dims[a] / (2 * lines))
        };
        let along = |at_u: usize, at_v: usize| {
            let value = |i: usize| {
                let mut at = [0; 3];
                (at[axis], at[u], at[v]) = (i, at_u, at_v);
                Some(values.at(at[0], at[1], at[2])).filter(|v| v.is_finite()).map_or(0.0, &density)
            };
            (0..dims[axis]).map(value).sum::<f64>() * spacing[axis]
        };
        places(u).flat_map(|at_u| places(v).map(move |at_v| (at_u, at_v))).map(|(a, b)| along(a, b)).fold(0.0, f64::max)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_is_as_deep_as_it_is_wide() {
        let volume = crate::volume::builtin::build("constant", 40, 0).expect("a volume");
        for depth in greatest_along_axes(&volume, |v| 3.0 * v).expect("voxels on the host") {
            assert!((depth - 6.0).abs() < 1e-9, "{depth}: the box is 2 wide");
        }
    }
}
