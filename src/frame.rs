//! The encoding of a picture with its description as PNG or OpenEXR bytes.

mod grey;
mod stripes;

use std::borrow::Cow;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder, WritableImage,
};

use crate::error::{Error, Result};
pub use grey::grey_png;
use stripes::Deflated;

/// Encodes 8-bit sRGB, three or four bytes a pixel, as PNG, by a fast encoder, since a frame is looked at once. `description` goes into its
/// text chunk, under the keyword `Cloudchamber`.
///
/// # Errors
/// [`Error::Internal`] when the encoder fails.
pub fn png(size: [usize; 2], picture: &[u8], description: String) -> Result<Vec<u8>> {
    let channels = if picture.len() == 4 * size[0] * size[1] { 4 } else { 3 };
    Deflated::new(size, channels, picture)?.png(description)
}

/// Encodes linear RGB, or RGB and alpha, in 32-bit floats as OpenEXR, with a channel `standard_error` of the luminance if it is given.
/// `description` goes into its comments.
///
/// # Errors
/// [`Error::Internal`] when the encoder fails.
pub fn exr(
    [width, height]: [usize; 2],
    picture: &[f32],
    errors: Option<Vec<f32>>,
    description: &str,
) -> Result<Vec<u8>> {
    let count = picture.len() / (width * height).max(1);
    let channel = |name: &str, c: usize| {
        AnyChannel::new(name, FlatSamples::F32(picture.iter().skip(c).step_by(count).copied().collect()))
    };
    let colours = ["R", "G", "B", "A"].iter().take(count).enumerate().map(|(c, name)| channel(name, c));
    let errors = errors.map(|e| AnyChannel::new("standard_error", FlatSamples::F32(e)));
    let channels = AnyChannels::sort(colours.chain(errors).collect());
    let mut attributes = LayerAttributes::named("cloudchamber");
    attributes.comments = exr::prelude::Text::new_or_none(description);
    // Blocks are compressed side by side. They are written in a fixed order, so that the same film gives the same bytes.
    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS };
    let layer = Layer::new((width, height), attributes, encoding, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).map_err(Error::internal)?;
    Ok(bytes.into_inner())
}

/// The strong entity tag of a frame's bytes.
pub fn etag(bytes: &[u8]) -> String {
    format!("\"{}\"", &blake3::hash(bytes).to_hex()[..32])
}

/// The text chunk of one of our PNGs, for the command line and tests.
///
/// # Errors
/// [`Error::Malformed`] if the bytes are not one of our PNGs.
pub fn read_description(png_bytes: &[u8]) -> Result<Cow<'static, str>> {
    let decoder = png::Decoder::new(std::io::Cursor::new(png_bytes));
    let reader = decoder.read_info().map_err(|e| Error::Malformed(e.to_string()))?;
    let chunk = reader.info().uncompressed_latin1_text.iter().find(|c| c.keyword == "Cloudchamber");
    chunk.map(|c| Cow::Owned(c.text.clone())).ok_or_else(|| Error::Malformed("no Cloudchamber text chunk".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_film_is_the_same_exr_bytes() -> Result<()> {
        let picture: Vec<f32> = (0..3 * 500 * 400u64).map(|i| (i * 7919 % 1009) as f32).collect();
        let first = exr([500, 400], &picture, None, "")?;
        for _ in 0..20 {
            assert!(exr([500, 400], &picture, None, "")? == first, "other bytes");
        }
        Ok(())
    }
}
