//! The transfer function: value to colour and opacity per unit length, as control points or a preset.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result, Violation};
use crate::volume::Volume;

/// Entries of the table that the device reads. `TABLE_SIZE` in `kernels/emission_absorption.cl`.
pub const TABLE_SIZE: usize = 4096;
/// The optical depth that a preset's opacity 1 has across the volume's mean side: nearly opaque, still soft.
const PRESET_OPTICAL_DEPTH: f64 = 24.0;

/// A transfer function in a request: a preset, or control points.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransferRequest {
    /// `ramp`, `hls` (hue by value, opacity by power), `ct_bone` or `mri_head`. Default: what suits the volume.
    #[schemars(extend("enum" = ["ramp", "hls", "ct_bone", "mri_head"]))]
    pub preset: Option<String>,
    /// `hls`: turns the hue, in turns.
    #[schemars(range(min = 0, max = 1))]
    pub rotation: Option<f64>,
    /// `hls`: opacity = pow(v / vmax, exponent).
    #[schemars(range(min = 0.01, max = 20))]
    pub exponent: Option<f64>,
    /// The values that a preset spans. Default: the volume's range; for a computed field, 0 to what 99.8 % of its voxels stay below.
    pub value_range: Option<[f64; 2]>,
    /// Control points in rising order of value, linear between them, constant outside. Instead of a preset.
    #[schemars(length(min = 1, max = 256))]
    pub points: Option<Vec<ControlPoint>>,
}

/// One control point.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlPoint {
    /// The volume's value here.
    pub value: f64,
    /// Linear red, green, blue, each from 0 to 1.
    #[schemars(inner(range(min = 0, max = 1)))]
    pub color: [f64; 3],
    /// Extinction per world unit (per mm for a scan).
    #[schemars(range(min = 0, max = 1e6))]
    pub opacity_per_unit: f64,
}

/// A valid transfer function for one volume.
#[derive(Debug, Clone, PartialEq)]
pub enum TransferFunction {
    /// Linear between control points.
    Points(Vec<ControlPoint>),
    /// The lecture's (C, alpha) = HLS((v / vmax + rotation) 360, 0.5, 1), pow(v / vmax, exponent).
    Hls {
        /// Turns of hue added.
        rotation: f64,
        /// Exponent of the opacity.
        exponent: f64,
        /// The value of hue turn 1 and full opacity.
        value_max: f64,
        /// Opacity per world unit at full opacity.
        opacity_per_unit: f64,
    },
}

/// sRGB's decoding (IEC 61966-2-1), for colours that are chosen by eye.
fn linear(srgb: f64) -> f64 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

fn by_eye(value: f64, rgb: u32, opacity_per_unit: f64) -> ControlPoint {
    let channel = |shift: u32| linear(f64::from(rgb >> shift & 0xff) / 255.0);
    ControlPoint { value, color: [channel(16), channel(8), channel(0)], opacity_per_unit }
}

/// A preset's points: (place, colour, opacity from 0 to 1). Places are fractions of the value range.
type PresetPoints = &'static [(f64, u32, f64)];

const RAMP: PresetPoints = &[(0.0, 0x1a1a80, 0.0), (0.5, 0xe08040, 0.5), (1.0, 0xfff8e0, 1.0)];
/// Air, skin, muscle and fluid, grey matter, white matter and fat of a T1 head.
const MRI_HEAD: PresetPoints = &[
    (0.0, 0x000000, 0.0),
    (0.13, 0x5a2e22, 0.0),
    (0.22, 0xb0694a, 0.4),
    (0.34, 0xc98f70, 0.64),
    (0.50, 0xd8b49a, 1.6),
    (0.65, 0xf0dcc8, 4.0),
    (1.0, 0xffffff, 8.0),
];
/// Bone of a CT whose values are not Hounsfield units.
const CT_BONE: PresetPoints = &[
    (0.0, 0x000000, 0.0),
    (0.30, 0x6a2a1c, 0.0),
    (0.42, 0xa8583c, 0.06),
    (0.55, 0xd8b890, 0.9),
    (0.75, 0xf4ead2, 3.0),
    (1.0, 0xffffff, 6.0),
];
/// The same in Hounsfield units: bone starts at about 200, dense bone at 700.
const CT_BONE_HOUNSFIELD: PresetPoints = &[
    (-1000.0, 0x000000, 0.0),
    (120.0, 0x6a2a1c, 0.0),
    (220.0, 0xb07850, 0.2),
    (450.0, 0xe0c8a0, 1.5),
    (1000.0, 0xf6eedc, 4.0),
    (2000.0, 0xffffff, 6.0),
];

/// Whether a range of values looks like Hounsfield units: air far below 0 and bone far above.
fn is_hounsfield(range: [f64; 2]) -> bool {
    range[0] <= -500.0 && range[1] >= 600.0
}

/// The values that a preset spans. A field's brightest voxels stand next to its source and would leave the rest dark.
fn span(wish: Option<[f64; 2]>, volume: &Volume, at: &str) -> Result<[f64; 2]> {
    match wish {
        Some([low, high]) if high > low => Ok([low, high]),
        Some([low, _]) => {
            Err(Error::invalid(format!("{at}/value_range/1"), "the range is empty", format!("more than {low}")))
        }
        None if volume.format() == "field" => Ok([0.0, quantile(volume, 0.998)]),
        None => Ok(volume.range()),
    }
}

/// The value that the part `q` of the finite voxels stays below; at least a millionth of the largest, so that it spans something.
fn quantile(volume: &Volume, q: f64) -> f64 {
    let mut values: Vec<f32> =
        (0..volume.voxels().len()).map(|i| volume.voxels().get_f32(i)).filter(|v| v.is_finite()).collect();
    let least = (volume.range()[1] * 1e-6).max(f64::MIN_POSITIVE);
    if values.is_empty() {
        return least;
    }
    let at = ((values.len() - 1) as f64 * q) as usize;
    let (_, value, _) = values.select_nth_unstable_by(at, f32::total_cmp);
    (f64::from(*value) * volume.slope() + volume.inter()).max(least)
}

impl TransferFunction {
    /// The valid function of a request for `volume`. `at` is its JSON pointer. Also the name of what was taken.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn from_request(request: &TransferRequest, volume: &Volume, at: &str) -> Result<(Self, String)> {
        if let Some(points) = &request.points {
            if request.preset.is_some() {
                return Err(Error::invalid(format!("{at}/points"), "given beside preset", "either points or preset"));
            }
            return Self::from_points(points, at).map(|f| (f, format!("{} control points", points.len())));
        }
        let suits = match (volume.format(), is_hounsfield(volume.range())) {
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
            "ct_bone" if is_hounsfield(range) => Self::from_preset(CT_BONE_HOUNSFIELD, [0.0, 1.0], full),
            "ct_bone" => Self::from_preset(CT_BONE, range, full),
            "mri_head" => Self::from_preset(MRI_HEAD, range, full),
            _ => Self::from_preset(RAMP, range, full),
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

    fn from_preset(points: PresetPoints, [low, high]: [f64; 2], full: f64) -> Self {
        let place = |f: f64| low + (high - low) * f;
        Self::Points(points.iter().map(|&(f, rgb, opacity)| by_eye(place(f), rgb, opacity * full)).collect())
    }

    /// The values between which the function changes: what a table of it has to cover.
    pub fn domain(&self) -> [f64; 2] {
        let [low, high] = match self {
            Self::Points(points) => [points.first(), points.last()].map(|p| p.map_or(0.0, |p| p.value)),
            Self::Hls { value_max, .. } => [0.0, *value_max],
        };
        if high > low { [low, high] } else { [low, low + 1.0] }
    }

    /// Linear colour and opacity per unit at a value.
    pub fn evaluate(&self, value: f64) -> ([f64; 3], f64) {
        match self {
            Self::Points(points) => evaluate_points(points, value),
            Self::Hls { rotation, exponent, value_max, opacity_per_unit } => {
                let v = if *value_max > 0.0 { (value / value_max).clamp(0.0, 1.0) } else { 0.0 };
                (hue((v + rotation).fract()), v.powf(*exponent) * opacity_per_unit)
            }
        }
    }

    /// The intervals of values that the device's table gives any opacity, in rising order.
    pub fn opaque(&self) -> Vec<[f64; 2]> {
        let [low, high] = self.domain();
        let width = (high - low) / (TABLE_SIZE - 1) as f64;
        let mut intervals: Vec<[f64; 2]> = Vec::new();
        for i in 0..TABLE_SIZE {
            if self.evaluate(low + width * i as f64).1 <= 0.0 {
                continue;
            }
            // An entry stands for the values nearer to it than to the next, and a little more, since the device rounds; the
            // outermost for all beyond.
            let from = if i == 0 { f64::NEG_INFINITY } else { low + width * (i as f64 - 0.6) };
            let to = if i == TABLE_SIZE - 1 { f64::INFINITY } else { low + width * (i as f64 + 0.6) };
            match intervals.last_mut() {
                Some(last) if last[1] >= from => last[1] = to,
                _ => intervals.push([from, to]),
            }
        }
        intervals
    }

    /// The device's table over [`TransferFunction::domain`] for steps of `step` world units: two words an entry, as `classify` in
    /// `kernels/emission_absorption.cl` takes them apart.
    pub fn table(&self, opacity_scale: f64, step: f64) -> Vec<u32> {
        let [low, high] = self.domain();
        let entry = |i: usize| {
            let (color, sigma) = self.evaluate(low + (high - low) * i as f64 / (TABLE_SIZE - 1) as f64);
            pack(color, -(-sigma * opacity_scale * step).exp_m1())
        };
        (0..TABLE_SIZE).flat_map(entry).collect()
    }
}

/// A colour and an opacity in two words: the float of the opacity, rounded to 13 bits after the point, and in its ten lowest and
/// two highest bits the square root of blue; then red and green.
fn pack(color: [f64; 3], opacity: f64) -> [u32; 2] {
    let bits = |c: f64, most: f64| (c.clamp(0.0, 1.0) * most).round() as u32;
    let root = bits(color[2].max(0.0).sqrt(), 4095.0);
    let opacity = ((opacity.clamp(0.0, 1.0) as f32).to_bits() + 0x200) & 0x3fff_fc00;
    [opacity | root >> 2 | root << 30, bits(color[0], 65535.0) | bits(color[1], 65535.0) << 16]
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

/// HLS(turn 360, 0.5, 1) as linear RGB: lightness a half and saturation 1 are the pure hues.
fn hue(turn: f64) -> [f64; 3] {
    let channel = |shift: f64| {
        let t = (turn + shift).rem_euclid(1.0) * 6.0;
        linear(((t - 3.0).abs() - 1.0).clamp(0.0, 1.0))
    };
    [channel(0.0), channel(-1.0 / 3.0), channel(-2.0 / 3.0)]
}

#[cfg(test)]
mod tests {
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
