//! The visible difference of two pictures: FLIP (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", HPG 2020), by its authors' own code.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};

use crate::error::{Error, Result};

/// sRGB bytes of linear values in grey, clipped at 1.
fn grey(values: &[f64]) -> Vec<u8> {
    let encode = |v: f64| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    values.iter().flat_map(|v| [(255.0 * encode(v.clamp(0.0, 1.0))).round() as u8; 3]).collect()
}

/// The mean of FLIP over two pictures of linear luminance, 0 (the same) to 1, at the distance that its authors assume.
///
/// # Errors
/// [`Error::Internal`] if a picture is not of the size, or has no pixels.
pub fn mean_flip(reference: &[f64], test: &[f64], [width, height]: [usize; 2]) -> Result<f64> {
    if width * height == 0 {
        return Err(Error::internal("a picture without pixels"));
    }
    for (name, picture) in [("reference", reference), ("test", test)] {
        if picture.len() != width * height {
            let found = picture.len();
            return Err(Error::internal(format!("the {name} picture has {found} pixels, not {width} x {height}")));
        }
    }
    let image = |values: &[f64]| FlipImageRgb8::with_data(width as u32, height as u32, &grey(values));
    let map = flip(image(reference), image(test), DEFAULT_PIXELS_PER_DEGREE);
    Ok(f64::from(FlipPool::from_image(&map).mean()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_is_0_and_black_against_white_is_near_1() {
        let ramp: Vec<f64> = (0..256).map(|i| f64::from(i) / 255.0).collect();
        assert!(mean_flip(&ramp, &ramp, [16, 16]).expect("pictures") < 1e-6);
        let contrary = mean_flip(&[0.0; 256], &[1.0; 256], [16, 16]).expect("pictures");
        assert!(contrary > 0.9, "{contrary}");
        let a_little: Vec<f64> = ramp.iter().map(|v| v * 0.97).collect();
        let small = mean_flip(&ramp, &a_little, [16, 16]).expect("pictures");
        assert!(small > 0.0 && small < 0.1, "{small}");
    }

    #[test]
    fn a_wrong_size_or_a_missing_reference_fails() {
        assert!(mean_flip(&[0.5; 16], &[0.5; 16], [4, 5]).is_err(), "both of another size");
        assert!(mean_flip(&[0.5; 20], &[0.5; 16], [4, 5]).is_err(), "the test of another size");
        assert!(mean_flip(&[], &[0.5; 20], [4, 5]).is_err(), "no reference");
        assert!(mean_flip(&[], &[], [0, 0]).is_err(), "nothing");
    }
}
