//! The pixels of its picture that a film has.

/// A part of a picture, of which every `stride`-th pixel is taken, across and down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Region {
    /// Its corner, pixels of the picture.
    pub left_top: [u32; 2],
    /// Its sides, pixels of the picture.
    pub size: [u32; 2],
    /// The distance of its pixels, across and down, pixels of the picture.
    pub stride: u32,
}

impl Region {
    /// Every `stride`-th pixel of a picture.
    pub fn every(stride: u32, image: [u32; 2]) -> Self {
        Self { left_top: [0, 0], size: image, stride: stride.max(1) }
    }

    /// About `pixels` pixels, evenly spread over a part of a picture, or all pixels of a small one.
    pub fn some(pixels: f64, left_top: [u32; 2], size: [u32; 2]) -> Self {
        let stride = (f64::from(size[0]) * f64::from(size[1]) / pixels).sqrt().round().max(1.0) as u32;
        Self { left_top, size, stride }
    }
}
