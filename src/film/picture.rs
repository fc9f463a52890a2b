//! The picture of a film: over its background, in linear floats or sRGB bytes.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;

use super::sums::Sums;
use super::{ErrorEstimate, Film, srgb};
use crate::error::Result;
use crate::frame::{self, Deflated};

/// What is behind the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Background {
    /// A linear colour.
    Colour([f32; 3]),
    /// Nothing: the picture has an alpha channel.
    Transparent,
}

impl Default for Background {
    fn default() -> Self {
        Self::Colour([0.0; 3])
    }
}

impl Film {
    /// What a picture of this film says of itself. No times: the same request and number of samples gives the same bytes.
    pub fn description(&self, error: &ErrorEstimate) -> String {
        let stride = self.main.stride;
        serde_json::json!({"samples": self.main.count, "error": error.total, "error_parts": error, "stride": stride,
            "lowered": self.lowered.words()})
        .to_string()
    }

    /// The film as PNG bytes, its error, and how many values were clipped at white. A stripe's pixels are added up, coloured and deflated
    /// while they are in a core's cache.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn png(&self) -> Result<(Vec<u8>, ErrorEstimate, u64)> {
        let whole = self.is_whole();
        let stripe = |rows: Range<usize>, out: &mut [u8]| {
            let sums = whole.then(|| self.sums_of(rows.clone()));
            (sums.unwrap_or_default(), self.colour(rows, out))
        };
        let (deflated, parts) = Deflated::new(self.size, self.channels(), stripe)?;
        let (sums, clipped): (Vec<Sums>, Vec<u64>) = parts.into_iter().unzip();
        // A preview has other rows than its picture.
        let error = if whole { self.error_of(&sums.into_iter().sum()) } else { self.error() };
        Ok((deflated.png(self.description(&error))?, error, clipped.iter().sum()))
    }

    /// The film as OpenEXR bytes; a transparent one has an alpha channel and is premultiplied, as is usual there. Of two samples or more
    /// each pixel says the standard error of its luminance, or that it is no number where a sample was not finite.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn exr(&self, error: &ErrorEstimate) -> Result<Vec<u8>> {
        let picture: Vec<f32> = match self.background {
            Background::Colour(behind) => self.rgba().chunks_exact(4).flat_map(|p| srgb::over(p, behind)).collect(),
            Background::Transparent => self.rgba().into_owned(),
        };
        let known = self.main.stride == 1 && self.main.count >= 2;
        let errors = known.then(|| (0..self.main.m2.len()).map(|i| self.main.squared_error(i).sqrt() as f32).collect());
        frame::exr(self.size, &picture, errors, &self.description(error))
    }

    /// Whether the picture has the samples' own pixels.
    fn is_whole(&self) -> bool {
        self.main.stride == 1 && self.size == [self.main.width, self.main.height]
    }

    fn channels(&self) -> usize {
        if self.background == Background::Transparent { 4 } else { 3 }
    }

    /// All samples in linear R, G, B (premultiplied) and alpha, row by row from the top.
    fn rgba(&self) -> Cow<'_, [f32]> {
        self.rgba_of(0..self.size[1])
    }

    /// The same of some rows; a preview is interpolated to the full size.
    fn rgba_of(&self, rows: Range<usize>) -> Cow<'_, [f32]> {
        let width = self.size[0];
        if self.is_whole() {
            return Cow::Borrowed(&self.main.mean[4 * width * rows.start..4 * width * rows.end]);
        }
        let mut out = Vec::with_capacity(width * rows.len() * 4);
        let place = |full: usize, n: usize| {
            let at = (full as f32 / self.main.stride as f32).min((n - 1) as f32);
            let low = (at as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), at - low as f32)
        };
        let across: Vec<_> = (0..width).map(|x| place(x, self.main.width)).collect();
        for y in rows {
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

    /// Writes the sRGB bytes of some rows; how many values were clipped.
    fn colour(&self, rows: Range<usize>, out: &mut [u8]) -> u64 {
        srgb::encode(&self.rgba_of(rows), self.background, out)
    }

    /// The picture in sRGB bytes (IEC 61966-2-1), clipped at 1, and how many values were clipped: three a pixel, or four with
    /// an alpha that is not multiplied into them.
    pub fn srgb8(&self) -> (Vec<u8>, u64) {
        let row = self.size[0] * self.channels();
        let mut out = vec![0u8; self.size[1] * row];
        let rows = frame::rows(self.size);
        let parts = frame::stripes(self.size).zip(out.par_chunks_mut((rows * row).max(1)));
        let clipped = parts.map(|(rows, out)| self.colour(rows, out)).sum();
        (out, clipped)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Samples;
    use super::*;

    #[test]
    fn srgb_is_the_standard_curve() {
        for (linear, byte) in [(0.0, 0), (0.0031308, 10), (0.2158605, 128), (0.5, 188), (1.0, 255), (7.0, 255)] {
            let mean = [linear, linear, linear, 0.5].repeat(2);
            let main = Samples { width: 2, height: 1, stride: 1, count: 1, mean, m2: vec![0.0; 2], tiles: None };
            let film = Film { size: [2, 1], main, ..Film::default() };
            assert_eq!(film.srgb8().0[0], byte, "at {linear}");
        }
    }
}
