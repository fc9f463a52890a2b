//! Grey pictures as PNG.

use crate::error::{Error, Result};

/// A PNG of grey bytes, rows from the top.
///
/// # Errors
/// [`Error::Internal`] if there are not as many bytes as pixels.
pub fn grey_png(size: [usize; 2], grey: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0] as u32, size[1] as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(Error::internal)?;
    writer.write_image_data(grey).map_err(Error::internal)?;
    writer.finish().map_err(Error::internal)?;
    Ok(bytes)
}
