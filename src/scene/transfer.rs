//! The transfer function: value to colour and opacity per unit length, as control points or a preset.

use super::presets;
pub use super::transfer_request::{ControlPoint, Label, TransferRequest};
use crate::error::{Error, Result, Violation};
use crate::volume::Volume;

/// The number of entries of the table that the device reads: `TABLE_SIZE` of the kernel.
pub const TABLE_SIZE: usize = 4096;
/// The optical depth of a preset's opacity 1 across the volume's mean side: nearly opaque, still soft.
const PRESET_OPTICAL_DEPTH: f64 = 24.0;

/// A valid transfer function for one volume.
#[derive(Debug, Clone, PartialEq)]
pub enum TransferFunction {
    /// Linear between control points.
    Points(Vec<ControlPoint>),
    /// The lecture's (C, alpha) = HLS((v / vmax + rotation) 360, 0.5, 1), pow(v / vmax, exponent).
    Hls {
        /// The rotation of the hue, in turns.
        rotation: f64,
        /// Exponent of the opacity.
        exponent: f64,
        /// The value with a hue of one full turn and full opacity.
        value_max: f64,
        /// Opacity per world unit at full opacity.
        opacity_per_unit: f64,
    },
    /// A colour and an opacity per world unit for each whole number from 0; other values are empty.
    Labels(Vec<([f64; 3], f64)>),
}

/// The range of a preset's values. A field's brightest voxels are next to its source and would leave the rest dark, so its default range
/// excludes them.
fn span(given: Option<[f64; 2]>, volume: &Volume, at: &str) -> Result<[f64; 2]> {
    match given {
        Some([low, high]) if high > low => Ok([low, high]),
        Some([low, _]) => {
            Err(Error::invalid(format!("{at}/value_range/1"), "the range is empty", format!("more than {low}")))
        }
        // At least a millionth of the largest value, so that the range is not empty.
        None => Ok(volume.upper().map_or(volume.range(), |upper| {
            let least = (volume.range()[1] * 1e-6).max(f64::MIN_POSITIVE);
            [0.0, upper.max(least)]
        })),
    }
}

impl TransferFunction {
    /// The valid function of a request for `volume`, and a description of its source. `at` is its JSON pointer.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn from_request(request: &TransferRequest, volume: &Volume, at: &str) -> Result<(Self, String)> {
        if let Some(points) = &request.points {
            if request.preset.is_some() || request.labels.is_some() {
                let given = "given beside preset or labels";
                return Err(Error::invalid(format!("{at}/points"), given, "one of points, labels and preset"));
            }
            return Self::from_points(points, at).map(|f| (f, format!("{} control points", points.len())));
        }
        if let Some(labels) = &request.labels {
            if request.preset.is_some() {
                let given = "given beside preset";
                return Err(Error::invalid(format!("{at}/labels"), given, "one of points, labels and preset"));
            }
            return Self::from_labels(labels, at).map(|f| (f, format!("{} labels", labels.len())));
        }
        let suits = match (volume.format(), presets::is_hounsfield(volume.range())) {
            ("builtin" | "field", _) => "ramp",
            (_, true) => "ct_bone",
            (_, false) => "mri_head",
        };
        let preset = request.preset.as_deref().unwrap_or(suits);
        let full = PRESET_OPTICAL_DEPTH / super::mean_side(volume);
        let range = span(request.value_range, volume, at)?;
        let function = match preset {
            "hls" => Self::Hls {
                rotation: request.rotation.unwrap_or(0.0),
                exponent: request.exponent.unwrap_or(2.0),
                value_max: range[1],
                opacity_per_unit: full,
            },
            "labels" => Self::Labels(presets::labels(volume.range()[1], full)),
            name => Self::Points(presets::points(name, range, full)),
        };
        Ok((function, format!("the preset {preset}")))
    }

    fn from_points(points: &[ControlPoint], at: &str) -> Result<Self> {
        let mut wrong = Vec::new();
        for (i, pair) in points.windows(2).enumerate() {
            if pair[1].value <= pair[0].value {
                let permitted = format!("more than {}", pair[0].value);
                wrong.push(Violation::new(format!("{at}/points/{}/value", i + 1), "values must rise", permitted));
            }
        }
        if wrong.is_empty() { Ok(Self::Points(points.to_vec())) } else { Err(Error::Invalid(wrong)) }
    }

    fn from_labels(labels: &[Label], at: &str) -> Result<Self> {
        let most = labels.iter().map(|l| l.label).max().unwrap_or(0) as usize;
        let mut table = vec![([0.0; 3], 0.0); most + 1];
        for (i, label) in labels.iter().enumerate() {
            if labels[..i].iter().any(|other| other.label == label.label) {
                return Err(Error::invalid(format!("{at}/labels/{i}/label"), "given twice", "each label once"));
            }
            let color = label.color.unwrap_or_else(|| presets::label_color(label.label));
            table[label.label as usize] = (color, label.opacity_per_unit);
        }
        Ok(Self::Labels(table))
    }

    /// The interval of values in which the function changes. A table of the function has to cover it.
    pub fn domain(&self) -> [f64; 2] {
        let [low, high] = match self {
            Self::Points(points) => [points.first(), points.last()].map(|p| p.map_or(0.0, |p| p.value)),
            Self::Hls { value_max, .. } => [0.0, *value_max],
            Self::Labels(_) => [0.0, (TABLE_SIZE - 1) as f64],
        };
        if high > low { [low, high] } else { [low, low + 1.0] }
    }

    /// Linear colour and opacity per unit at a value.
    pub fn evaluate(&self, value: f64) -> ([f64; 3], f64) {
        match self {
            Self::Points(points) => evaluate_points(points, value),
            Self::Labels(table) => table.get(value.round().max(0.0) as usize).copied().unwrap_or_default(),
            Self::Hls { rotation, exponent, value_max, opacity_per_unit } => {
                let v = if *value_max > 0.0 { (value / value_max).clamp(0.0, 1.0) } else { 0.0 };
                (presets::hue((v + rotation).fract()), v.powf(*exponent) * opacity_per_unit)
            }
        }
    }

    /// The greatest derivative of the opacity per unit of length by the value, from the device's table.
    pub fn steepest_slope(&self) -> f64 {
        let [low, high] = self.domain();
        let width = (high - low) / (TABLE_SIZE - 1) as f64;
        let sigma = |i: usize| self.evaluate(low + width * i as f64).1;
        (1..TABLE_SIZE).map(|i| (sigma(i) - sigma(i - 1)).abs() / width).fold(0.0, f64::max)
    }

    /// The device's table for pre-integrated steps, all as floats. Each entry has the integrals from the first entry of extinction and of
    /// extinction times red, green and blue over the entries, then the integrands.
    pub fn integrals(&self, opacity_scale: f64) -> Vec<u32> {
        let [low, high] = self.domain();
        let integrand = |i: usize| {
            let (c, sigma) = self.evaluate(low + (high - low) * i as f64 / (TABLE_SIZE - 1) as f64);
            [1.0, c[0], c[1], c[2]].map(|part| part * sigma * opacity_scale)
        };
        let (mut sum, mut before) = ([0.0; 4], integrand(0));
        let mut table = Vec::with_capacity(8 * TABLE_SIZE);
        for i in 0..TABLE_SIZE {
            let here = integrand(i);
            for part in 0..4 {
                sum[part] += if i == 0 { 0.0 } else { 0.5 * (before[part] + here[part]) };
            }
            before = here;
            table.extend(sum.iter().chain(&here).map(|v| (*v as f32).to_bits()));
        }
        table
    }

    /// The intervals of values that have an opacity in the device's table, in rising order.
    pub fn opaque(&self) -> Vec<[f64; 2]> {
        let [low, high] = self.domain();
        let width = (high - low) / (TABLE_SIZE - 1) as f64;
        let mut intervals: Vec<[f64; 2]> = Vec::new();
        for i in 0..TABLE_SIZE {
            if self.evaluate(low + width * i as f64).1 <= 0.0 {
                continue;
            }
            // Opacity begins at the entry before and ends at the entry after, less a small margin. The first and the last entry stand for
            // all values beyond them.
            let from = if i == 0 { f64::NEG_INFINITY } else { low + width * (i as f64 - 0.999) };
            let to = if i == TABLE_SIZE - 1 { f64::INFINITY } else { low + width * (i as f64 + 0.999) };
            match intervals.last_mut() {
                Some(last) if last[1] >= from => last[1] = to,
                _ => intervals.push([from, to]),
            }
        }
        intervals
    }

    /// The entries of the device's table over [`TransferFunction::domain`]: linear colour and the opacity of `step` world units.
    pub fn entries(&self, opacity_scale: f64, step: f64) -> Vec<([f64; 3], f64)> {
        let [low, high] = self.domain();
        let entry = |i: usize| {
            let (color, sigma) = self.evaluate(low + (high - low) * i as f64 / (TABLE_SIZE - 1) as f64);
            (color, -(-sigma * opacity_scale * step).exp_m1())
        };
        (0..TABLE_SIZE).map(entry).collect()
    }
}

/// A colour and an opacity in two words; `optical` in `kernels/shared/optical.h` unpacks them. The first word is the float of the opacity,
/// rounded to 13 bits after the point, with blue in its ten lowest and two highest bits. The second word is red and green, rotated to the
/// place of a float's fraction.
pub(crate) fn pack(color: [f64; 3], opacity: f64) -> [u32; 2] {
    let bits = |c: f64, most: f64| (c.clamp(0.0, 1.0) * most).round() as u32;
    let [red, green, blue] = [bits(color[0], 65535.0), bits(color[1], 65535.0), bits(color[2], 4095.0)];
    let opacity = ((opacity.clamp(0.0, 1.0) as f32).to_bits() + 0x200) & 0x3fff_fc00;
    [opacity | blue >> 2 | blue << 30, red << 7 | green >> 9 | green << 23]
}

fn evaluate_points(points: &[ControlPoint], value: f64) -> ([f64; 3], f64) {
    let after = points.partition_point(|p| p.value <= value);
    let (Some(a), Some(b)) = (after.checked_sub(1).map(|i| points[i]).or(points.first().copied()), points.get(after))
    else {
        return points.last().map_or(([0.0; 3], 0.0), |p| (p.color, p.opacity_per_unit));
    };
    let f = if b.value > a.value { (value - a.value) / (b.value - a.value) } else { 0.0 };
    let mix = |x: f64, y: f64| x + (y - x) * f.clamp(0.0, 1.0);
    (std::array::from_fn(|c| mix(a.color[c], b.color[c])), mix(a.opacity_per_unit, b.opacity_per_unit))
}

#[cfg(test)]
mod tests {
    use super::presets::hue;
    use super::*;

    fn point(value: f64, grey: f64, opacity_per_unit: f64) -> ControlPoint {
        ControlPoint { value, color: [grey; 3], opacity_per_unit }
    }

    #[test]
    fn points_are_linear_between_and_constant_outside() {
        let points = [point(1.0, 0.0, 2.0), point(3.0, 1.0, 6.0)];
        for (value, grey, sigma) in
            [(0.0, 0.0, 2.0), (1.0, 0.0, 2.0), (1.5, 0.25, 3.0), (3.0, 1.0, 6.0), (9.0, 1.0, 6.0)]
        {
            assert_eq!(evaluate_points(&points, value), ([grey; 3], sigma), "at {value}");
        }
    }

    #[test]
    fn hue_is_the_colour_wheel() {
        assert_eq!(hue(0.0), [1.0, 0.0, 0.0]);
        assert_eq!(hue(1.0 / 3.0).map(|c| (c * 1e9).round() / 1e9), [0.0, 1.0, 0.0]);
        assert_eq!(hue(2.0 / 3.0).map(|c| (c * 1e9).round() / 1e9), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn unsorted_points_are_named() {
        let wrong = TransferFunction::from_points(&[point(1.0, 0.0, 0.0), point(1.0, 0.0, 0.0)], "/t");
        assert!(matches!(wrong, Err(Error::Invalid(v)) if v[0].pointer == "/t/points/1/value"));
    }
}
