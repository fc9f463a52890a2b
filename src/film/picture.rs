//! The picture of a film: as PNG from the device's encoded bytes, or in linear floats over its background.

use std::borrow::Cow;

use super::{ErrorEstimate, Film, luminance, srgb};
use crate::error::Result;
use crate::frame;

/// The background behind the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Background {
    /// A linear colour.
    Colour([f32; 3]),
    /// No background: the picture has an alpha channel.
    Transparent,
}

impl Default for Background {
    fn default() -> Self {
        Self::Colour([0.0; 3])
    }
}

impl Background {
    /// The number of channels of a picture with this background.
    pub fn channels(self) -> usize {
        if self == Self::Transparent { 4 } else { 3 }
    }
}

impl Film {
    /// The description in the metadata of a picture of this film. It has no times, so that the same request and number of samples gives the
    /// same bytes.
    pub fn description(&self, error: &ErrorEstimate) -> String {
        let stride = self.main.stride;
        serde_json::json!({"samples": self.main.count, "error": error.total, "error_parts": error, "stride": stride,
            "lowered": self.lowered.words()})
        .to_string()
    }

    /// The picture as PNG, from the bytes that the device encoded, and the film's error.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn png(&self, picture: &[u8]) -> Result<(Vec<u8>, ErrorEstimate)> {
        let error = self.error();
        Ok((frame::png(self.size, picture, self.description(&error))?, error))
    }

    /// The film as OpenEXR bytes. A transparent film has an alpha channel and is premultiplied, as is usual there. With two samples or
    /// more, each pixel gives the standard error of its luminance, or NaN if a sample was not finite.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn exr(&self) -> Result<Vec<u8>> {
        let picture: Vec<f32> = match self.background {
            Background::Colour(behind) => self.rgba().chunks_exact(4).flat_map(|p| srgb::over(p, behind)).collect(),
            Background::Transparent => self.rgba().into_owned(),
        };
        let known = self.main.stride == 1 && self.main.count >= 2;
        let errors = known.then(|| (0..self.main.m2.len()).map(|i| self.main.squared_error(i).sqrt() as f32).collect());
        frame::exr(self.size, &picture, errors, &self.description(&self.error()))
    }

    /// The linear luminance of every pixel of the picture's full size, as it is shown.
    pub fn shown_luminance(&self) -> Vec<f64> {
        self.rgba().chunks_exact(4).map(luminance).collect()
    }

    /// All samples in linear R, G, B (premultiplied) and alpha, row by row from the top. A preview is interpolated to the full size.
    fn rgba(&self) -> Cow<'_, [f32]> {
        let [width, height] = self.size;
        if self.main.stride == 1 && self.size == [self.main.width, self.main.height] {
            return Cow::Borrowed(&self.main.mean);
        }
        let mut out = Vec::with_capacity(width * height * 4);
        let place = |full: usize, n: usize| {
            let at = (full as f32 / self.main.stride as f32).min((n - 1) as f32);
            let low = (at as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), at - low as f32)
        };
        let across: Vec<_> = (0..width).map(|x| place(x, self.main.width)).collect();
        for y in 0..height {
            let (y0, y1, fy) = place(y, self.main.height);
            for &(x0, x1, fx) in &across {
                for c in 0..4 {
                    let at = |x: usize, y: usize| self.main.mean[4 * (y * self.main.width + x) + c];
                    let (top, low) =
                        (at(x0, y0) + (at(x1, y0) - at(x0, y0)) * fx, at(x0, y1) + (at(x1, y1) - at(x0, y1)) * fx);
                    out.push(top + (low - top) * fy);
                }
            }
        }
        Cow::Owned(out)
    }
}
