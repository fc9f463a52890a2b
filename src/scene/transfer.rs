//! The transfer function: value to colour and opacity per unit length, as control points or a preset.

use super::labels::Labels;
use super::presets;
pub use super::transfer_request::{ControlPoint, TransferRequest};
use crate::error::{Error, Result, Violation};
use crate::volume::{Contents, DataKind, Volume, is_hounsfield};

/// The number of entries of the table that the device reads: `TABLE_SIZE` of the kernel.
pub const TABLE_SIZE: usize = 4096;
/// The part of the data's width above them at which what stands for no data begins.
const BEYOND: f64 = 0.1;
/// The optical depth of a preset's opacity 1 across the volume's mean side: nearly opaque, still soft.
const PRESET_OPTICAL_DEPTH: f64 = 24.0;

/// A valid transfer function for one volume.
#[derive(Debug, Clone, PartialEq)]
pub enum TransferFunction {
    /// Linear between control points; two at one value are a step, and the value itself has what is after it.
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
    /// Looks of whole numbers.
    Labels(Labels),
}

/// The range of a preset's values.
fn span(given: Option<[f64; 2]>, contents: &Contents, at: &str) -> Result<[f64; 2]> {
    match given {
        Some([low, high]) if high > low => Ok([low, high]),
        Some([low, _]) => {
            Err(Error::invalid(format!("{at}/value_range/1"), "the range is empty", format!("more than {low}")))
        }
        None => Ok(contents.window),
    }
}

/// The preset that suits a kind of values.
fn suitable(kind: DataKind) -> &'static str {
    match kind {
        DataKind::Density => "ramp",
        DataKind::Hounsfield => "ct_bone",
        DataKind::Labels => "labels",
        DataKind::SignedMap => "signed",
        DataKind::Intensity => "mri_head",
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
            let found = Labels::from_request(labels, &format!("{at}/labels"))?;
            return Ok((Self::Labels(found), format!("{} labels", labels.len())));
        }
        let contents = volume.contents()?;
        let preset = request.preset.as_deref().unwrap_or(suitable(contents.kind));
        let full = PRESET_OPTICAL_DEPTH / super::mean_side(volume);
        let range = span(request.value_range, contents, at)?;
        let function = match preset {
            "hls" => Self::Hls {
                rotation: request.rotation.unwrap_or(0.0),
                exponent: request.exponent.unwrap_or(2.0),
                value_max: range[1],
                opacity_per_unit: full,
            },
            "labels" => Self::Labels(Labels::Each(full)),
            name => {
                let given_hounsfield = request.value_range.is_some_and(is_hounsfield);
                let hounsfield =
                    contents.kind == DataKind::Hounsfield && request.value_range.is_none() || given_hounsfield;
                // Both signs are seen alike.
                let most = range[0].abs().max(range[1].abs());
                let range = if name == "signed" && request.value_range.is_none() { [-most, most] } else { range };
                let points = presets::points(name, range, hounsfield, full);
                Self::Points(without_padding(points, contents))
            }
        };
        let taken_for = match request.preset {
            Some(_) => String::new(),
            None => format!(", as {}", contents.words()),
        };
        Ok((function, format!("the preset {preset}{taken_for}")))
    }

    fn from_points(points: &[ControlPoint], at: &str) -> Result<Self> {
        let mut wrong = Vec::new();
        for (i, pair) in points.windows(2).enumerate() {
            let falls = pair[1].value < pair[0].value;
            let third = i > 0 && pair[1].value == points[i - 1].value;
            if falls || third {
                let least = if third { "more than" } else { "at least" };
                let permitted = format!("{least} {}; two points at one value are a step", pair[0].value);
                wrong.push(Violation::new(format!("{at}/points/{}/value", i + 1), "values must not fall", permitted));
            }
        }
        if wrong.is_empty() { Ok(Self::Points(points.to_vec())) } else { Err(Error::Invalid(wrong)) }
    }

    /// The interval of values in which the function changes; a point if it has one value.
    pub fn domain(&self) -> [f64; 2] {
        match self {
            Self::Points(points) => [points.first(), points.last()].map(|p| p.map_or(0.0, |p| p.value)),
            Self::Hls { value_max, .. } => [0.0, *value_max],
            Self::Labels(_) => [0.0, (TABLE_SIZE - 1) as f64],
        }
    }

    /// Linear colour and opacity per unit at a value.
    pub fn evaluate(&self, value: f64) -> ([f64; 3], f64) {
        match self {
            Self::Points(points) => evaluate_points(points, value),
            Self::Labels(labels) => labels.look(value),
            Self::Hls { rotation, exponent, value_max, opacity_per_unit } => {
                let v = if *value_max > 0.0 { (value / value_max).clamp(0.0, 1.0) } else { 0.0 };
                (presets::hue((v + rotation).fract()), v.powf(*exponent) * opacity_per_unit)
            }
        }
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

/// A preset's points that leave out what stands for no data above all values.
fn without_padding(mut points: Vec<ControlPoint>, contents: &Contents) -> Vec<ControlPoint> {
    let [low, high] = contents.data;
    let last =
        points.last().copied().filter(|last| contents.padding.is_some_and(|padding| padding > last.value.max(high)));
    if let (Some(last), Some(padding)) = (last, contents.padding) {
        // Between a voxel with data and one without lie all values; only the first of them are seen.
        let value = last.value.max(high + BEYOND * (high - low)).min(padding);
        points.push(ControlPoint { value, ..last });
        points.push(ControlPoint { value, opacity_per_unit: 0.0, ..last });
    }
    points
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
        for (values, at) in [(&[1.0, 0.5][..], 1), (&[1.0, 1.0, 1.0], 2)] {
            let points: Vec<_> = values.iter().map(|value| point(*value, 0.0, 0.0)).collect();
            let wrong = TransferFunction::from_points(&points, "/t");
            let pointer = format!("/t/points/{at}/value");
            assert!(matches!(wrong, Err(Error::Invalid(v)) if v[0].pointer == pointer));
        }
    }

    #[test]
    fn two_points_at_one_value_are_a_step() {
        let points = [point(1.0, 0.0, 0.0), point(2.0, 0.0, 0.0), point(2.0, 1.0, 6.0), point(3.0, 1.0, 6.0)];
        assert!(TransferFunction::from_points(&points, "/t").is_ok());
        for (value, grey, sigma) in [(1.999, 0.0, 0.0), (2.0, 1.0, 6.0), (2.5, 1.0, 6.0)] {
            assert_eq!(evaluate_points(&points, value), ([grey; 3], sigma), "at {value}");
        }
    }
}
