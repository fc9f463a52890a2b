//! Linear floats to sRGB bytes (IEC 61966-2-1).

use super::picture::Background;

/// Pixels whose places in the table are worked out side by side.
const SIDE_BY_SIDE: usize = 16;
/// Adding it to a number below leaves the nearest integer in the low bits of the sum.
const TO_INTEGER: f32 = (1 << 23) as f32;

/// Writes the sRGB bytes of linear, premultiplied R, G, B and alpha: three a pixel over a colour, or four with an alpha that is not
/// multiplied into them. Returns how many values were clipped at 1.
pub(super) fn encode(pixels: &[f32], background: Background, out: &mut [u8]) -> u64 {
    match background {
        Background::Colour(behind) => encode_over(pixels, behind, out),
        Background::Transparent => {
            let encode = |(p, out): (&[f32], &mut [u8])| {
                let scale = if p[3] > 0.0 { 1.0 / p[3] } else { 0.0 };
                out[3] = (p[3].clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                encode_colour([p[0] * scale, p[1] * scale, p[2] * scale], &mut out[..3])
            };
            pixels.chunks_exact(4).zip(out.chunks_exact_mut(4)).map(encode).sum()
        }
    }
}

/// Three bytes a pixel over a colour.
fn encode_over(pixels: &[f32], behind: [f32; 3], out: &mut [u8]) -> u64 {
    let mut empty = [0; 3 * SIDE_BY_SIDE];
    let clipped_empty: u64 = empty.chunks_exact_mut(3).map(|out| encode_colour(behind, out)).sum();
    let (blocks, rest) = pixels.as_chunks::<{ 4 * SIDE_BY_SIDE }>();
    let (out_blocks, out_rest) = out.as_chunks_mut::<{ 3 * SIDE_BY_SIDE }>();
    let encode = |(block, out): (&[f32; 4 * SIDE_BY_SIDE], &mut [u8; 3 * SIDE_BY_SIDE])| {
        // Beside the volume.
        if block.iter().fold(0, |bits, v| bits | v.to_bits()) == 0 {
            *out = empty;
            return clipped_empty;
        }
        encode_block(block, behind, out)
    };
    let clipped: u64 = blocks.iter().zip(out_blocks).map(encode).sum();
    let rest = rest.chunks_exact(4).zip(out_rest.chunks_exact_mut(3));
    clipped + rest.map(|(p, out)| encode_colour(over(p, behind), out)).sum::<u64>()
}

/// As [`encode_colour`] of each pixel, to the bit. The loops are such that the compiler makes vector instructions of them.
fn encode_block(block: &[f32; 4 * SIDE_BY_SIDE], behind: [f32; 3], out: &mut [u8; 3 * SIDE_BY_SIDE]) -> u64 {
    let mut values = [0.0f32; 4 * SIDE_BY_SIDE];
    for (value, p) in values.chunks_exact_mut(4).zip(block.chunks_exact(4)) {
        let [r, g, b] = over(p, behind);
        value.copy_from_slice(&[r, g, b, 0.0]);
    }
    let clipped: u32 = values.iter().map(|v| u32::from(*v > 1.0)).sum();
    let place = |v: f32| {
        // Comparisons that leave 0 of what is no number, as a conversion does.
        let v = if v > 0.0 { v } else { 0.0 };
        let v = if v < 1.0 { v } else { 1.0 };
        let scaled = v * 65535.0 + 0.5;
        let nearest = scaled + TO_INTEGER;
        (nearest.to_bits() - u32::from(nearest - TO_INTEGER > scaled)) as u16
    };
    let places = values.map(place);
    let table = srgb_table();
    for (out, [r, g, b, _]) in out.as_chunks_mut::<3>().0.iter_mut().zip(places.as_chunks::<4>().0) {
        *out = [r, g, b].map(|place| table[usize::from(*place)]);
    }
    u64::from(clipped)
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
#[inline(always)]
pub(super) fn over(p: &[f32], behind: [f32; 3]) -> [f32; 3] {
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
    use super::*;

    #[test]
    fn blocks_are_what_each_pixel_is() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 1.0, 1.000_000_1, 7.0, 1e-30, f32::MAX];
        // Around every step of the table, halves of steps among them.
        let steps = (0..=2 * 65536u32).flat_map(|i| {
            let v = i as f32 / (2.0 * 65535.0);
            [v.next_down(), v, v.next_up()]
        });
        let values: Vec<f32> = odd.into_iter().chain(steps).collect();
        for behind in [[0.0; 3], [0.3, 1.5, 0.01]] {
            let pixel = |i: usize| [values[i], values[i * 7 % values.len()], values[i / 2], [0.0, 0.25, 1.0][i % 3]];
            let pixels: Vec<f32> = (0..values.len()).flat_map(pixel).chain([0.0; 400]).collect();
            let count = pixels.len() / 4;
            let (mut ours, mut plain) = (vec![0; 3 * count], vec![0; 3 * count]);
            let clipped = encode(&pixels, Background::Colour(behind), &mut ours);
            let each = pixels.chunks_exact(4).zip(plain.chunks_exact_mut(3));
            let clipped_plain: u64 = each.map(|(p, out)| encode_colour(over(p, behind), out)).sum();
            assert_eq!(clipped, clipped_plain);
            assert!(ours == plain);
        }
    }
}
