//! A picture with its metadata as PNG or OpenEXR bytes.

use std::borrow::Cow;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use serde_json::json;

use crate::error::{Error, Result};
use crate::film::{ErrorEstimate, Film};

/// One encoded frame and what it says of itself.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Counts the render's frames from 1; also the id of its event.
    pub sequence: u64,
    /// PNG bytes.
    pub png: bytes::Bytes,
    /// Samples per pixel.
    pub samples: u32,
    /// The error and its parts.
    pub error: ErrorEstimate,
    /// Milliseconds since the render (or its newest camera) was asked for.
    pub elapsed_ms: f64,
    /// Milliseconds of device time so far.
    pub device_ms: f64,
    /// Whether no better frame will follow.
    pub is_final: bool,
    /// Strong entity tag: the hash of the bytes, which hold nothing that depends on load or time.
    pub etag: String,
}

/// What a PNG says of itself in its text chunk, under the keyword `Cloudchamber`. No times: the same request and sample
/// count gives the same bytes.
fn description(film: &Film, error: &ErrorEstimate) -> String {
    json!({"samples": film.main.count, "error": error.total, "error_parts": error, "stride": film.main.stride})
        .to_string()
}

/// The picture as PNG, by the encoder's fast path: a frame is looked at once. Also how many values were clipped at white.
///
/// # Errors
/// [`Error::Internal`] when the encoder fails.
pub fn png(film: &Film, error: &ErrorEstimate) -> Result<(Vec<u8>, u64)> {
    let [width, height] = film.size;
    let (rgb, clipped) = film.srgb8();
    let mut bytes = Vec::with_capacity(rgb.len() / 2);
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fastest);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Cloudchamber".into(), description(film, error)).map_err(Error::internal)?;
    let mut writer = encoder.write_header().map_err(Error::internal)?;
    writer.write_image_data(&rgb).map_err(Error::internal)?;
    writer.finish().map_err(Error::internal)?;
    Ok((bytes, clipped))
}

/// The picture in linear 32-bit floats as OpenEXR.
///
/// # Errors
/// [`Error::Internal`] when the encoder fails.
pub fn exr(film: &Film, error: &ErrorEstimate) -> Result<Vec<u8>> {
    let [width, height] = film.size;
    let rgb = film.linear_rgb();
    let channel = |name: &str, c: usize| {
        AnyChannel::new(name, FlatSamples::F32(rgb.iter().skip(c).step_by(3).copied().collect()))
    };
    let channels = AnyChannels::sort([channel("R", 0), channel("G", 1), channel("B", 2)].into_iter().collect());
    let mut attributes = LayerAttributes::named("cloudchamber");
    attributes.comments = exr::prelude::Text::new_or_none(description(film, error));
    let layer = Layer::new((width, height), attributes, Encoding::FAST_LOSSLESS, channels);
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
/// [`Error::Malformed`] when it is not one.
pub fn read_description(png_bytes: &[u8]) -> Result<Cow<'static, str>> {
    let decoder = png::Decoder::new(std::io::Cursor::new(png_bytes));
    let reader = decoder.read_info().map_err(|e| Error::Malformed(e.to_string()))?;
    let chunk = reader.info().uncompressed_latin1_text.iter().find(|c| c.keyword == "Cloudchamber");
    chunk.map(|c| Cow::Owned(c.text.clone())).ok_or_else(|| Error::Malformed("no Cloudchamber text chunk".into()))
}
