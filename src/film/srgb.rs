//! Linear floats to sRGB bytes (IEC 61966-2-1).

/// A premultiplied pixel over a colour.
pub(super) fn over(p: &[f32], behind: [f32; 3]) -> [f32; 3] {
    let through = 1.0 - p[3];
    [p[0] + through * behind[0], p[1] + through * behind[1], p[2] + through * behind[2]]
}

/// sRGB bytes by linear value in steps of 1/65535 from 0 to 1: a step is a twentieth of a grey level where the curve is steepest.
pub fn table() -> &'static [u8; 1 << 16] {
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
    fn srgb_is_the_standard_curve() {
        for (linear, byte) in [(0.0, 0), (0.0031308, 10), (0.2158605, 128), (0.5, 188), (1.0, 255)] {
            assert_eq!(table()[(linear * 65535.0 + 0.5) as usize], byte, "at {linear}");
        }
    }
}
