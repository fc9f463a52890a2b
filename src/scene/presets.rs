//! Transfer functions by name.

use super::transfer_request::ControlPoint;

/// The decoding of sRGB (IEC 61966-2-1), for colours that are chosen by eye.
pub fn linear(srgb: f64) -> f64 {
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
/// Bone of a CT in Hounsfield units: bone starts at about 200, dense bone at 700.
const CT_BONE_HOUNSFIELD: PresetPoints = &[
    (-1000.0, 0x000000, 0.0),
    (120.0, 0x6a2a1c, 0.0),
    (220.0, 0xb07850, 0.2),
    (450.0, 0xe0c8a0, 1.5),
    (1000.0, 0xf6eedc, 4.0),
    (2000.0, 0xffffff, 6.0),
];
/// Bone in flesh by two classes: flesh is nearly transparent, bone nearly opaque.
const BONE_FLESH: PresetPoints = &[
    (0.0, 0x000000, 0.0),
    (0.18, 0xc07860, 0.0),
    (0.22, 0xd08870, 0.12),
    (0.40, 0xd08870, 0.12),
    (0.46, 0xf6eedc, 5.0),
    (1.0, 0xffffff, 8.0),
];
/// Bone in flesh, in Hounsfield units.
const BONE_FLESH_HOUNSFIELD: PresetPoints = &[
    (-1000.0, 0x000000, 0.0),
    (-200.0, 0xc07860, 0.0),
    (-50.0, 0xd08870, 0.12),
    (150.0, 0xd08870, 0.12),
    (250.0, 0xf6eedc, 5.0),
    (2000.0, 0xffffff, 8.0),
];
/// Two classes by colour: the lower is blue and transparent, the upper yellow and opaque.
const BLUE_YELLOW: PresetPoints = &[
    (0.0, 0x2040ff, 0.0),
    (0.12, 0x2040ff, 0.0),
    (0.16, 0x2040ff, 0.2),
    (0.44, 0x2040ff, 0.2),
    (0.50, 0xffe020, 8.0),
    (1.0, 0xffe020, 8.0),
];

/// Amounts below 0 are blue and those above red, the more opaque the further from 0. The colours are ColorBrewer's RdBu.
const SIGNED: PresetPoints = &[
    (0.0, 0x2166ac, 1.0),
    (0.25, 0x67a9cf, 0.4),
    (0.45, 0xd1e5f0, 0.0),
    (0.55, 0xfddbc7, 0.0),
    (0.75, 0xef8a62, 0.4),
    (1.0, 0xb2182b, 1.0),
];

/// The points of a preset over a range of values, of Hounsfield units or others; `full` is the extinction per world unit of opacity 1.
pub fn points(name: &str, range: [f64; 2], hounsfield: bool, full: f64) -> Vec<ControlPoint> {
    let (table, absolute) = match name {
        "ct_bone" if hounsfield => (CT_BONE_HOUNSFIELD, true),
        "ct_bone" => (CT_BONE, false),
        "bone_flesh" if hounsfield => (BONE_FLESH_HOUNSFIELD, true),
        "bone_flesh" => (BONE_FLESH, false),
        "blue_yellow" => (BLUE_YELLOW, false),
        "mri_head" => (MRI_HEAD, false),
        "signed" => (SIGNED, false),
        _ => (RAMP, false),
    };
    let [low, high] = if absolute { [0.0, 1.0] } else { range };
    table.iter().map(|&(f, rgb, opacity)| by_eye(low + (high - low) * f, rgb, opacity * full)).collect()
}

/// The nine colours of NVIDIA's CUDA sample `volumeRender`: display red, green, blue, and alpha.
const CUDA_SAMPLE: [[f64; 4]; 9] = [
    [0.0, 0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 1.0],
    [1.0, 0.5, 0.0, 1.0],
    [1.0, 1.0, 0.0, 1.0],
    [0.0, 1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0, 1.0],
    [0.0, 0.0, 1.0, 1.0],
    [1.0, 0.0, 1.0, 1.0],
    [0.0, 0.0, 0.0, 0.0],
];

/// The transfer function of CUDA's sample over values of `range` as 0 to 1. Its table is looked up at (v − offset) · scale with a linear
/// filter between texel centres. Its alpha is multiplied by `density` and stands for a step of 0.01 in a box from −1 to 1; `unit` is half a side
/// of that box in world units.
pub fn cuda_sample(density: f64, [offset, scale]: [f64; 2], range: [f64; 2], unit: f64) -> Vec<ControlPoint> {
    const PARTS: usize = 8;
    let look = |place: f64| {
        let at = (place * 9.0 - 0.5).clamp(0.0, 8.0);
        let low = (at as usize).min(7);
        let (a, b, f) = (CUDA_SAMPLE[low], CUDA_SAMPLE[low + 1], at - low as f64);
        std::array::from_fn::<f64, 4, _>(|c| a[c] + (b[c] - a[c]) * f)
    };
    let point = |i: usize| {
        let place = (0.5 + i as f64 / PARTS as f64) / 9.0;
        let [r, g, b, alpha] = look(place);
        let opacity = (density * alpha).min(0.9999);
        let value = range[0] + (range[1] - range[0]) * (place / scale + offset);
        ControlPoint { value, color: [r, g, b].map(linear), opacity_per_unit: -(-opacity).ln_1p() / (0.01 * unit) }
    };
    (0..=8 * PARTS).map(point).collect()
}

/// HLS(turn 360, 0.5, 1) as linear RGB. A lightness of a half and a saturation of 1 give the pure hues.
pub fn hue(turn: f64) -> [f64; 3] {
    let channel = |shift: f64| {
        let t = (turn + shift).rem_euclid(1.0) * 6.0;
        linear(((t - 3.0).abs() - 1.0).clamp(0.0, 1.0))
    };
    [channel(0.0), channel(-1.0 / 3.0), channel(-2.0 / 3.0)]
}
