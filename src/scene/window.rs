//! Window and level with a colour map: the range of values that is shown, and its colours. The device gets a table of linear colours.

use schemars::JsonSchema;
use serde::Deserialize;

use super::presets::linear;
use crate::error::{Error, Result};
use crate::volume::Volume;

/// The number of entries of the device's table: `WINDOW_SIZE` of the kernels. The device interpolates linearly between
/// entries.
pub const WINDOW_SIZE: usize = 1024;

/// The values from the first to the last colour: level and width, as radiologists give them, or the two ends.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowRequest {
    /// The value of the middle colour; with `width`.
    level: Option<f64>,
    /// How many values apart the first and the last colour are; more than 0.
    width: Option<f64>,
    /// The value of the first colour and all below; with `high`.
    low: Option<f64>,
    /// The value of the last colour and all above; more than `low`.
    high: Option<f64>,
}

/// Valid ends of a window: `low` is below `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    low: f64,
    high: f64,
}

impl WindowRequest {
    /// The ends that the request asks for. `at` is its JSON pointer.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field.
    pub fn check(&self, at: &str) -> Result<Window> {
        let (low, high, last) = match (self.level, self.width, self.low, self.high) {
            (Some(level), Some(width), None, None) => (level - 0.5 * width, level + 0.5 * width, "width"),
            (None, None, Some(low), Some(high)) => (low, high, "high"),
            _ => return Err(Error::invalid(at, "not a window", "level and width, or low and high")),
        };
        let permitted = if last == "width" { "more than 0".into() } else { format!("more than {low}") };
        if high > low && (high as f32) > (low as f32) && (high - low).is_finite() {
            Ok(Window { low, high })
        } else {
            Err(Error::invalid(
                format!("{at}/{last}"),
                "the window is empty, or too narrow for 32-bit floats",
                permitted,
            ))
        }
    }
}

impl Window {
    /// A window from `low` to `high`. If `high` is not above `low`, the window ends a little above `low`.
    pub fn of(low: f64, high: f64) -> Self {
        // All values are the same then.
        let least = if low == 0.0 { 1.0 } else { low.abs() * 1e-3 };
        Self { low, high: if high > low { high } else { low + least } }
    }

    /// The default window of a volume: most of its values.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn suitable(volume: &Volume) -> Result<Self> {
        let [low, high] = volume.contents()?.window;
        Ok(Self::of(low, high))
    }

    /// The scale and the offset of table entry = value × scale + offset.
    pub fn scale_and_offset(&self) -> [f32; 2] {
        let scale = (WINDOW_SIZE - 1) as f64 / (self.high - self.low);
        [scale as f32, (-self.low * scale) as f32]
    }
}

impl std::fmt::Display for Window {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} to {:?}", self.low as f32, self.high as f32)
    }
}

/// Colours from the low to the high end. Those of perceptual maps are those of d3-scale-chromatic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColorMap {
    /// Black to white; the middle of the window is the middle grey of the screen, as on a radiologist's.
    #[default]
    Grey,
    /// Dark blue over green to yellow.
    Viridis,
    /// Black over purple to pale yellow.
    Magma,
    /// Black over red to pale yellow.
    Inferno,
    /// Blue over magenta to yellow.
    Plasma,
    /// Blue to yellow; the same to most who see few colours.
    Cividis,
    /// A rainbow with even steps.
    Turbo,
    /// Black over red and yellow to white.
    Hot,
    /// Grey with a touch of blue, as an X-ray film on a light box.
    Bone,
    /// Blue over white to red.
    Coolwarm,
}

impl ColorMap {
    /// Linear red, green, blue at `f` from 0 to 1.
    pub fn evaluate(self, f: f64) -> [f64; 3] {
        let table = |g: colorous::Gradient, f: f64| {
            let c = g.eval_continuous(f);
            [c.r, c.g, c.b].map(|v| f64::from(v) / 255.0)
        };
        let ramp = |from: f64, to: f64| ((f - from) / (to - from)).clamp(0.0, 1.0);
        let srgb = match self {
            Self::Grey => [f; 3],
            Self::Viridis => table(colorous::VIRIDIS, f),
            Self::Magma => table(colorous::MAGMA, f),
            Self::Inferno => table(colorous::INFERNO, f),
            Self::Plasma => table(colorous::PLASMA, f),
            Self::Cividis => table(colorous::CIVIDIS, f),
            Self::Turbo => table(colorous::TURBO, f),
            Self::Hot => [ramp(0.0, 0.375), ramp(0.375, 0.75), ramp(0.75, 1.0)],
            // Matlab's `bone`: seven eighths grey and an eighth of `hot` with its channels in reverse order.
            Self::Bone => {
                let hot = [ramp(0.75, 1.0), ramp(0.375, 0.75), ramp(0.0, 0.375)];
                hot.map(|h| (7.0 * f + h) / 8.0)
            }
            Self::Coolwarm => table(colorous::RED_BLUE, 1.0 - f),
        };
        srgb.map(linear)
    }

    /// The device's table. An entry has red, green, blue and a 0, as the bits of floats. `invert` reverses the map.
    pub fn table(self, invert: bool) -> Vec<u32> {
        let entry = |i: usize| {
            let f = i as f64 / (WINDOW_SIZE - 1) as f64;
            let [r, g, b] = self.evaluate(if invert { 1.0 - f } else { f });
            [r, g, b, 0.0].map(|c| (c as f32).to_bits())
        };
        (0..WINDOW_SIZE).flat_map(entry).collect()
    }
}

/// What a view's own number becomes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// A colour by window and colour map.
    #[default]
    Color,
    /// Itself, as red, green and blue: ask for EXR and read numbers.
    Value,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_level_and_width_or_its_ends() {
        let window = |level, width, low, high| WindowRequest { level, width, low, high }.check("/w");
        assert_eq!(window(Some(40.0), Some(400.0), None, None).ok(), Some(Window { low: -160.0, high: 240.0 }));
        assert_eq!(window(None, None, Some(1.0), Some(2.0)).ok(), Some(Window { low: 1.0, high: 2.0 }));
        for (wrong, pointer) in [
            (window(Some(0.0), Some(0.0), None, None), "/w/width"),
            (window(Some(0.0), Some(-3.0), None, None), "/w/width"),
            (window(None, None, Some(2.0), Some(2.0)), "/w/high"),
            (window(Some(1.0), None, Some(2.0), None), "/w"),
        ] {
            assert!(matches!(wrong, Err(Error::Invalid(v)) if v[0].pointer == pointer), "{pointer}");
        }
    }

    #[test]
    fn maps_start_and_end_as_they_are_known_to() {
        let byte = |map: ColorMap, f: f64| {
            map.evaluate(f).map(|l| {
                let s = if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
                (s * 255.0).round() as u8
            })
        };
        assert_eq!([byte(ColorMap::Grey, 0.0), byte(ColorMap::Grey, 1.0)], [[0; 3], [255; 3]]);
        assert_eq!([byte(ColorMap::Viridis, 0.0), byte(ColorMap::Viridis, 1.0)], [[68, 1, 84], [253, 231, 37]]);
        assert_eq!([byte(ColorMap::Inferno, 0.0), byte(ColorMap::Inferno, 1.0)], [[0, 0, 4], [252, 255, 164]]);
        assert_eq!([byte(ColorMap::Hot, 0.0), byte(ColorMap::Hot, 1.0)], [[0; 3], [255; 3]]);
        assert_eq!(byte(ColorMap::Grey, 0.5), [128; 3]);
        assert_eq!(byte(ColorMap::Bone, 1.0), [255; 3]);
    }
}
