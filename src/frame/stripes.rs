//! PNG in stripes of rows, deflated side by side and joined into one zlib stream (RFC 1950, 1951).
//!
//! `fdeflate` writes a stream of one block with a fixed code. A stripe's block loses its mark of the last one, and an empty stored block
//! behind it brings the next to a byte's boundary. A stripe's first row is filtered without the row above, so that stripes are independent
//! of each other.

use rayon::prelude::*;

use crate::error::{Error, Result};

/// The least number of pixels of a stripe. The code's description takes 71 bytes of each stripe.
const LEAST_PIXELS: usize = 1 << 13;
/// The most stripes of a picture: enough for the cores of one host.
const MOST_STRIPES: usize = 128;
/// The filter types of the PNG specification, section 9.
const SUB: u8 = 1;
const PAETH: u8 = 4;
/// The length in bytes of the header at the start of a zlib stream, and of the Adler-32 at its end.
const ZLIB_HEADER: usize = 2;
const CHECKSUM: usize = 4;

/// The number of rows of a stripe. It depends on the picture's size alone.
fn rows([width, height]: [usize; 2]) -> usize {
    let pixels = (width * height).div_ceil(MOST_STRIPES).max(LEAST_PIXELS);
    pixels.div_ceil(width.max(1))
}

/// A deflated picture of 8-bit sRGB.
pub struct Deflated {
    size: [usize; 2],
    channels: usize,
    stripes: Vec<Stripe>,
}

/// A stripe as a part of a zlib stream.
struct Stripe {
    bytes: Vec<u8>,
    /// The Adler-32 of the filtered rows.
    adler: u32,
    /// The number of bytes of the filtered rows.
    length: usize,
}

impl Deflated {
    /// Deflates a picture of three or four `channels`, row by row. The bytes do not depend on the number of threads.
    ///
    /// # Errors
    /// [`Error::Internal`] when the encoder fails.
    pub fn new(size: [usize; 2], channels: usize, picture: &[u8]) -> Result<Self> {
        let row = size[0] * channels;
        let stripe = rows(size) * row;
        let count = picture.len().div_ceil(stripe.max(1));
        let of =
            |(i, pixels): (usize, &[u8])| deflate(pixels, row, channels, Place { first: i == 0, last: i + 1 == count });
        let stripes = picture.par_chunks(stripe.max(1)).enumerate().map(of).collect::<Result<_>>()?;
        Ok(Self { size, channels, stripes })
    }

    /// The PNG, with `description` in a text chunk under the keyword `Cloudchamber`.
    ///
    /// # Errors
    /// [`Error::Internal`] when the encoder fails.
    pub fn png(self, description: String) -> Result<Vec<u8>> {
        let length: usize = self.stripes.iter().map(|s| s.bytes.len() + 12).sum();
        let mut bytes = Vec::with_capacity(length + description.len() + 256);
        let mut encoder = png::Encoder::new(&mut bytes, self.size[0] as u32, self.size[1] as u32);
        encoder.set_color(if self.channels == 4 { png::ColorType::Rgba } else { png::ColorType::Rgb });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.add_text_chunk("Cloudchamber".into(), description).map_err(Error::internal)?;
        let mut writer = encoder.write_header().map_err(Error::internal)?;
        let mut adler = 1;
        for stripe in &self.stripes {
            adler = joined_adler(adler, stripe.adler, stripe.length);
            writer.write_chunk(png::chunk::IDAT, &stripe.bytes).map_err(Error::internal)?;
        }
        writer.write_chunk(png::chunk::IDAT, &adler.to_be_bytes()).map_err(Error::internal)?;
        writer.finish().map_err(Error::internal)?;
        Ok(bytes)
    }
}

/// The place of a stripe in the stream.
#[derive(Clone, Copy)]
struct Place {
    first: bool,
    last: bool,
}

fn deflate(pixels: &[u8], row: usize, channels: usize, place: Place) -> Result<Stripe> {
    let mut compressor = fdeflate::Compressor::new(Vec::with_capacity(pixels.len() / 4)).map_err(Error::internal)?;
    let mut filtered = vec![0; row + 1];
    let mut above = None;
    for line in pixels.chunks_exact(row) {
        filter(line, above.replace(line), channels, &mut filtered);
        compressor.write_data(&filtered).map_err(Error::internal)?;
    }
    let stream = compressor.finish().map_err(Error::internal)?;
    join(stream, place, pixels.len() + pixels.len() / row).ok_or_else(|| Error::internal("fdeflate wrote no stream"))
}

/// Makes a stream of one block of `fdeflate` a part of a longer stream.
fn join(mut bytes: Vec<u8>, place: Place, length: usize) -> Option<Stripe> {
    let adler = u32::from_be_bytes(*bytes.last_chunk::<CHECKSUM>()?);
    bytes.truncate(bytes.len() - CHECKSUM);
    if !place.last {
        *bytes.get_mut(ZLIB_HEADER)? &= !1;
        // `fdeflate` codes the end of a block as 1111 1111 0001, and zeros fill the byte from above. A stored block starts with three bits
        // of 0 and goes on at the next byte with its length, 0, and the complement of that.
        let padding = bytes.last().map(|byte| byte.leading_zeros()).filter(|zeros| *zeros < u8::BITS)?;
        bytes.extend_from_slice(if padding < 3 { &[0, 0, 0, 255, 255] } else { &[0, 0, 255, 255] });
    }
    if !place.first {
        bytes.drain(..ZLIB_HEADER);
    }
    Some(Stripe { bytes, adler, length })
}

/// Writes the filter's type and the filtered row.
fn filter(row: &[u8], above: Option<&[u8]>, channels: usize, out: &mut [u8]) {
    let Some((kind, out)) = out.split_first_mut() else { return };
    let (start, rest) = out.split_at_mut(channels);
    let here = row[channels..].iter().zip(row);
    let Some(above) = above else {
        *kind = SUB;
        start.copy_from_slice(&row[..channels]);
        rest.iter_mut().zip(here).for_each(|(out, (x, left))| *out = x.wrapping_sub(*left));
        return;
    };
    *kind = PAETH;
    start.iter_mut().zip(row).zip(above).for_each(|((out, x), up)| *out = x.wrapping_sub(*up));
    let there = above[channels..].iter().zip(above);
    for ((out, (x, left)), (up, corner)) in rest.iter_mut().zip(here).zip(there) {
        *out = x.wrapping_sub(paeth(*left, *up, *corner));
    }
}

/// The neighbour nearest to left + up − corner. It is computed in bytes alone, so that sixteen are computed side by side. If left and up
/// are on the same side of the corner, the sum is further from it than from either.
#[inline(always)]
fn paeth(left: u8, up: u8, corner: u8) -> u8 {
    let (to_left, to_up) = (up.abs_diff(corner), left.abs_diff(corner));
    let same_side = (left >= corner) == (up >= corner);
    let to_corner = if same_side { u8::MAX } else { to_left.abs_diff(to_up) };
    let other = if to_up <= to_corner { up } else { corner };
    if (to_left <= to_up) & (to_left <= to_corner) { left } else { other }
}

/// The Adler-32 of two runs of bytes from the Adler-32 of each; the second run has `length` bytes (zlib's `adler32_combine`).
fn joined_adler(first: u32, second: u32, length: usize) -> u32 {
    const BASE: u64 = 65521;
    let halves = |sum: u32| (u64::from(sum & 0xffff), u64::from(sum >> 16));
    let ((a, a_sum), (b, b_sum)) = (halves(first), halves(second));
    let before = a + BASE - 1;
    let sum = (length as u64 % BASE * (before % BASE) + a_sum + b_sum) % BASE;
    (sum << 16 | ((before + b) % BASE)) as u32
}

#[cfg(test)]
mod tests;
