//! The picture of a film: over its background, in linear floats or sRGB bytes.

use std::borrow::Cow;

use rayon::prelude::*;

use super::{ErrorEstimate, Film, PART};
use crate::error::Result;
use crate::frame;

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

    /// The film as PNG bytes, its error, and how many values were clipped at white. Error and colours are worked out side by side:
    /// a client that turns the camera waits for both.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn png(&self) -> Result<(Vec<u8>, ErrorEstimate, u64)> {
        let (error, (bytes, clipped)) = rayon::join(|| self.error(), || self.srgb8());
        Ok((frame::png(self.size, &bytes, self.description(&error))?, error, clipped))
    }

    /// The film as OpenEXR bytes; a transparent one has an alpha channel and is premultiplied, as is usual there. Of two samples or more
    /// each pixel says the standard error of its luminance, or that it is no number where a sample was not finite.
    ///
    /// # Errors
    /// `Error::Internal` when the encoder fails.
    pub fn exr(&self, error: &ErrorEstimate) -> Result<Vec<u8>> {
        let picture: Vec<f32> = match self.background {
            Background::Colour(behind) => self.rgba().chunks_exact(4).flat_map(|p| over(p, behind)).collect(),
            Background::Transparent => self.rgba().into_owned(),
        };
        let known = self.main.stride == 1 && self.main.count >= 2;
        let errors = known.then(|| (0..self.main.m2.len()).map(|i| self.main.squared_error(i).sqrt() as f32).collect());
        frame::exr(self.size, &picture, errors, &self.description(error))
    }

    /// The samples in linear R, G, B (premultiplied) and alpha, row by row from the top; a preview is interpolated to the full
    /// size.
    fn rgba(&self) -> Cow<'_, [f32]> {
        let [width, height] = self.size;
        if self.main.stride == 1 {
            return Cow::Borrowed(&self.main.mean);
        }
        let mut out = Vec::with_capacity(width * height * 4);
        let place = |full: usize, n: usize| {
            let at = (full as f32 / self.main.stride as f32).min((n - 1) as f32);
            let low = (at as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), at - low as f32)
        };
        for y in 0..height {
            let (y0, y1, fy) = place(y, self.main.height);
            for x in 0..width {
                let (x0, x1, fx) = place(x, self.main.width);
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

    /// The picture in sRGB bytes (IEC 61966-2-1), clipped at 1, and how many values were clipped: three a pixel, or four with
    /// an alpha that is not multiplied into them.
    pub fn srgb8(&self) -> (Vec<u8>, u64) {
        let pixels = self.rgba();
        let channels = if self.background == Background::Transparent { 4 } else { 3 };
        let mut out = vec![0u8; pixels.len() / 4 * channels];
        let parts = pixels.par_chunks(4 * PART).zip(out.par_chunks_mut(channels * PART));
        let clipped = parts.map(|(pixels, out)| encode(pixels, self.background, out)).sum();
        (out, clipped)
    }
}

/// Writes the pixels' sRGB bytes; how many values were clipped.
fn encode(pixels: &[f32], background: Background, out: &mut [u8]) -> u64 {
    let pixels = pixels.chunks_exact(4);
    match background {
        Background::Colour(behind) => {
            pixels.zip(out.chunks_exact_mut(3)).map(|(p, out)| encode_colour(over(p, behind), out)).sum()
        }
        Background::Transparent => {
            let encode = |(p, out): (&[f32], &mut [u8])| {
                let scale = if p[3] > 0.0 { 1.0 / p[3] } else { 0.0 };
                out[3] = (p[3].clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                encode_colour([p[0] * scale, p[1] * scale, p[2] * scale], &mut out[..3])
            };
            pixels.zip(out.chunks_exact_mut(4)).map(encode).sum()
        }
    }
}

/// Writes three sRGB bytes; how many values were clipped.
#[inline(always)]
fn encode_colour(colour: [f32; 3], out: &mut [u8]) -> u64 {
    let (table, mut clipped) = (srgb_table(), 0);
    for (v, byte) in colour.into_iter().zip(out) {
        clipped += u64::from(v > 1.0);
        *byte = table[usize::from((v.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16)];
    }
    clipped
}

/// A premultiplied pixel over a colour.
fn over(p: &[f32], behind: [f32; 3]) -> [f32; 3] {
    let through = 1.0 - p[3];
    [p[0] + through * behind[0], p[1] + through * behind[1], p[2] + through * behind[2]]
}

/// sRGB bytes by linear value in steps of 2^-16: a step is a twentieth of a grey level where the curve is steepest.
fn srgb_table() -> &'static [u8; 1 << 16] {
    static TABLE: std::sync::LazyLock<Box<[u8; 1 << 16]>> = std::sync::LazyLock::new(|| {
        let encode = |v: f64| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        Box::new(std::array::from_fn(|i| (encode(i as f64 / 65535.0) * 255.0).round() as u8))
    });
    &TABLE
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
