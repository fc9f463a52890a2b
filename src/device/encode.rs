//! Films are encoded on the device: as the picture in sRGB bytes, and as the sums for its error. The film itself, with 20 bytes per pixel, stays
//! there until somebody asks for it.

mod sums;

use std::rc::Rc;

use super::enums::DeviceEnum;
use super::program::{Source, Variant};
use super::structs::DeviceStruct;
use super::{Buffer, Device};
use crate::device_struct;
use crate::error::Result;
use crate::film::picture::Background;
use crate::film::{Samples, Sums, srgb};
use sums::{FilmSum, SUMS, sums_of_block};

/// Bytes that lanes may read behind a film's last pixel.
pub const PADDING: usize = 256;
/// Bytes that lanes may read behind a table.
const TABLE_PADDING: usize = 8;

device_struct! {
    /// Parameters of the kernel.
    pub struct Encode {
        /// Size of the film in its own pixels.
        pub width: i32,
        /// Its rows.
        pub height: i32,
        /// The film's pixels are every `stride`-th pixel of the picture.
        pub stride: i32,
        /// Size of the picture.
        pub picture_width: i32,
        /// Its rows.
        pub picture_height: i32,
        /// 1 if the picture has an alpha channel in place of a background.
        pub transparent: i32,
        /// The background, linear.
        pub behind: [f32; 3],
        /// The transmittance at which rays end.
        pub ended: f32,
        /// Samples of a pixel.
        pub count: i32,
        /// Pixels along the side of a tile with its own number of samples; 0 if all pixels have as many.
        pub tile: i32,
        /// Tiles across.
        pub tiles_wide: i32,
        /// 1 if squared deviations are summed.
        pub deviations: i32,
    }
}

/// A set of samples on the device.
#[derive(Clone, Copy)]
pub struct Set<'a> {
    /// Means, then squared deviations (`kernels/shared/film.h`), and [`PADDING`].
    pub buffer: &'a Buffer,
    /// Their size and count, without their values.
    pub samples: &'a Samples,
}

/// The way a film is encoded.
#[derive(Debug, Clone, Copy)]
pub struct EncodeSettings {
    /// Size of the picture.
    pub size: [usize; 2],
    /// The background.
    pub background: Background,
    /// Opacity at which rays end.
    pub opacity_threshold: f64,
    /// True if squared deviations are summed. A single sample that is finite everywhere has none.
    pub deviations: bool,
}

fn variant(whole: bool) -> Variant {
    Variant::new("encode", None, if whole { &[("WHOLE", 1)] } else { &[("WHOLE", 0)] })
}

/// The kernel.
pub fn source() -> Source {
    Source {
        kernel: "encode",
        words: FilmSum::opencl_text,
        structs: || vec![Encode::LAYOUT],
        variants: || [true, false].map(variant).to_vec(),
        common: 2,
    }
}

/// Pixels of a row that a work-item takes: `ACROSS` of the kernel.
fn across(lanes: usize) -> usize {
    if lanes == 1 { 32 } else { 8 * lanes }
}

/// The curve of sRGB on the device, for all encoders.
///
/// # Errors
/// [`crate::error::Error::Internal`] if the device has no room.
pub fn curve(device: &Device) -> Result<Rc<Buffer>> {
    device.upload(srgb::table(), TABLE_PADDING).map(Rc::new)
}

/// The memory for encoding the films of one picture, and the curve of sRGB.
pub struct Encoder {
    settings: Buffer,
    curve: Rc<Buffer>,
    picture: Buffer,
    sums: Buffer,
    channels: usize,
    size: [usize; 2],
}

impl Encoder {
    /// Allocates memory for a picture, or takes over the memory of the encoder `before` if that is as large; `curve` is the result of [`curve`].
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room.
    pub fn new(
        device: &mut Device,
        curve: &Rc<Buffer>,
        size: [usize; 2],
        background: Background,
        before: Option<Self>,
    ) -> Result<Self> {
        for whole in [true, false] {
            device.build(&source(), &variant(whole))?;
        }
        let channels = background.channels();
        let (picture, sums) = before.map(|b| (b.picture, b.sums)).unzip();
        Ok(Self {
            settings: device.allocate(size_of::<Encode>())?,
            curve: curve.clone(),
            picture: device.allocate_in(picture, channels * size[0] * size[1])?,
            sums: sums.map_or_else(|| device.allocate(1), Ok)?,
            channels,
            size,
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> usize {
        self.picture.len() + self.sums.len()
    }

    /// Encodes `main` and returns the sums for its error. Then the picture can be read.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device has no room or the kernel fails.
    pub fn encode(&mut self, device: &Device, main: Set<'_>, look: &EncodeSettings) -> Result<Sums> {
        let (width, height) = (main.samples.width, main.samples.height);
        let whole = main.samples.stride == 1 && [width, height] == self.size;
        let blocks = width.div_ceil(across(device.info().lanes as usize)) * height.div_ceil(2);
        let items = blocks + if whole { 0 } else { self.size[1] };
        if self.sums.len() < 4 * SUMS * items {
            self.sums = device.allocate(4 * SUMS * items)?;
        }
        device.write(&mut self.settings, 0, bytemuck::bytes_of(&settings(main, look)))?;
        let counts =
            main.samples.tiles.as_ref().map(|t| device.upload(bytemuck::cast_slice(&t.counts), 0)).transpose()?;
        let arguments = [
            ("settings", &self.settings),
            ("film", main.buffer),
            ("counts", counts.as_ref().unwrap_or(&self.sums)),
            ("curve", &*self.curve),
            ("picture", &self.picture),
            ("sums", &self.sums),
        ];
        device.run(&variant(whole), &arguments, items)?;
        let mut numbers = vec![[0.0f32; SUMS]; items];
        device.read(&self.sums, 0, &mut numbers)?;
        let (of_film, of_picture) = numbers.split_at(blocks);
        let mut sums: Sums = of_film.iter().map(sums_of_block).sum();
        sums.block_count = (width / 2) * (height / 2);
        sums.clipped += of_picture.iter().map(|n| n[0] as u64).sum::<u64>();
        Ok(sums)
    }

    /// The picture last encoded: three bytes of sRGB a pixel, or four with an alpha that is not multiplied into them.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if OpenCL fails.
    pub fn picture(&self, device: &Device) -> Result<Vec<u8>> {
        let mut picture = vec![0; self.channels * self.size[0] * self.size[1]];
        device.read(&self.picture, 0, &mut picture)?;
        Ok(picture)
    }
}

fn settings(main: Set<'_>, look: &EncodeSettings) -> Encode {
    let behind = match look.background {
        Background::Colour(behind) => behind,
        Background::Transparent => [0.0; 3],
    };
    let int = |n: usize| n as i32;
    let main = main.samples;
    let tiles = main.tiles.as_ref().map_or([0; 2], |t| [int(t.side), int(t.wide)]);
    Encode {
        width: int(main.width),
        height: int(main.height),
        stride: int(main.stride),
        picture_width: int(look.size[0]),
        picture_height: int(look.size[1]),
        transparent: (look.background == Background::Transparent).into(),
        behind,
        ended: (1.0 - look.opacity_threshold) as f32,
        count: main.count as i32,
        tile: tiles[0],
        tiles_wide: tiles[1],
        deviations: look.deviations.into(),
    }
}
