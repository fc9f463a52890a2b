//! Tests of stripes with a decoder that is not ours.

use super::*;
use crate::frame::{png, read_description};

/// A byte of a picture, by its place in a row and its row.
type Pixel = fn(usize, usize) -> u8;

const FLAT: Pixel = |_, _| 0;
const SMOOTH: Pixel = |i, row| ((i / 7 + 3 * row) / 5) as u8;
const NOISY: Pixel = |i, row| ((i + 7919 * row).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 51) as u8;
/// A mostly empty picture with few values: its streams have all lengths modulo a byte.
const SPARSE: Pixel = |i, row| if NOISY(i, row) < 16 { NOISY(row, i) % 5 } else { 0 };

fn picture([width, height]: [usize; 2], channels: usize, pixel: Pixel) -> Vec<u8> {
    let row = width * channels;
    (0..row * height).map(|i| pixel(i % row, i / row)).collect()
}

/// The pixels of a PNG. The checksums of its chunks and of its stream are compared.
fn decode(bytes: &[u8]) -> Result<Vec<u8>> {
    let malformed = |e: png::DecodingError| Error::Malformed(e.to_string());
    let mut options = png::DecodeOptions::default();
    options.set_ignore_adler32(false);
    let mut reader =
        png::Decoder::new_with_options(std::io::Cursor::new(bytes), options).read_info().map_err(malformed)?;
    let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
    reader.next_frame(&mut pixels).map_err(malformed)?;
    reader.finish().map_err(malformed)?;
    Ok(pixels)
}

const SIZES: [[usize; 2]; 12] = [
    [1, 1],
    [1, 20_001],
    [20_001, 1],
    [2, 3],
    [3, 5000],
    [8191, 3],
    [8193, 5],
    [127, 131],
    [256, 256],
    [333, 1000],
    [640, 481],
    [1023, 1025],
];

#[test]
fn every_size_comes_back_as_it_was() -> Result<()> {
    for size in SIZES {
        for (channels, pixel) in [(3, FLAT), (3, SMOOTH), (3, NOISY), (3, SPARSE), (4, SMOOTH), (4, NOISY)] {
            let before = picture(size, channels, pixel);
            let bytes = png(size, &before, "what it is".into())?;
            assert!(decode(&bytes)? == before, "{size:?}, {channels} channels");
            assert_eq!(read_description(&bytes)?, "what it is");
        }
    }
    Ok(())
}

#[test]
fn streams_of_every_length_are_joined() -> Result<()> {
    // There are two stripes, the first with another number of bits each time.
    for marks in 0..64 {
        let mut before = vec![0; 3 * 4096 * 4];
        before.iter_mut().step_by(11).take(marks).enumerate().for_each(|(i, byte)| *byte = 1 + (i % 3) as u8);
        assert!(decode(&png([4096, 4], &before, String::new())?)? == before, "{marks} marks");
    }
    Ok(())
}

#[test]
fn a_wrong_checksum_is_noticed() -> Result<()> {
    let size = [256, 256];
    let pixels = picture(size, 3, SMOOTH);
    let mut deflated = Deflated::new(size, 3, &pixels)?;
    assert!(deflated.stripes.len() > 4);
    deflated.stripes[2].adler ^= 1;
    assert!(decode(&deflated.png(String::new())?).is_err());
    Ok(())
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() -> Result<()> {
    let pixels = picture([640, 481], 3, SPARSE);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(Error::internal)?;
        pool.install(|| png([640, 481], &pixels, String::new()))
    };
    assert!(with(1)? == with(4)?);
    Ok(())
}

#[test]
fn a_noisy_picture_is_hardly_longer_than_its_pixels() -> Result<()> {
    let pixels = picture([512, 512], 3, NOISY);
    let bytes = png([512, 512], &pixels, String::new())?;
    assert!(bytes.len() * 2 < 3 * pixels.len(), "{} of {}", bytes.len(), pixels.len());
    Ok(())
}

#[test]
fn paeth_is_the_specifications() {
    let specified = |left: u8, up: u8, corner: u8| {
        let distance = |v: u8| (i32::from(left) + i32::from(up) - i32::from(corner) - i32::from(v)).abs();
        let [to_left, to_up, to_corner] = [left, up, corner].map(distance);
        match (to_left <= to_up && to_left <= to_corner, to_up <= to_corner) {
            (true, _) => left,
            (_, true) => up,
            _ => corner,
        }
    };
    for left in 0..=255 {
        for up in 0..=255 {
            for corner in (0..=255).step_by(3) {
                assert_eq!(paeth(left, up, corner), specified(left, up, corner), "{left} {up} {corner}");
            }
        }
    }
}
