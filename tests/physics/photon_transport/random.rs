//! The random numbers: they are Philox's, neighbours are independent, and the lecture's generator has known faults.

use serde_json::json;

use super::run::{simulate, with};

/// Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC'11), written anew.
fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let (a, b) = (u64::from(counter[0]) * 0xD251_1F53, u64::from(counter[2]) * 0xCD9E_8D57);
        counter = [(b >> 32) as u32 ^ counter[1] ^ key[0], b as u32, (a >> 32) as u32 ^ counter[3] ^ key[1], a as u32];
        key = [key[0].wrapping_add(0x9E37_79B9), key[1].wrapping_add(0xBB67_AE85)];
    }
    counter
}

fn unit(bits: u32) -> f64 {
    (f64::from(bits >> 9) + 0.5) / f64::from(1 << 23)
}

/// The kernel's random numbers for a photon's event.
fn draw(seed: u64, photon: u64, event: u32) -> [f64; 4] {
    philox([photon as u32, (photon >> 32) as u32, event, 0x7068_6f74], [seed as u32, (seed >> 32) as u32]).map(unit)
}

#[test]
fn the_generator_has_the_published_answers() {
    // Random123's known answers for philox4x32-10.
    assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
    assert_eq!(philox([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
    let pi = [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344];
    assert_eq!(philox(pi, [0xa409_3822, 0x299f_31d0]), [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]);
}

#[test]
fn the_kernel_draws_these_numbers() {
    // One photon in a medium that only absorbs has the path -ln u of the third number of its first event.
    let layers = json!([{"thickness_mm": 100, "mu_a_per_mm": 1, "mu_s_per_mm": 0, "index": 1}]);
    let scene = json!({"photons": 1, "grid": [1, 1, 1], "layers": layers});
    for seed in [0, 1, 2, 12345, 1 << 40, (1 << 53) - 1] {
        let path = simulate(&with(&scene, &json!({"seed": seed})))["mean_path_mm"].as_f64().unwrap();
        let truth = -draw(seed, 0, 0)[2].ln();
        assert!((path - truth).abs() < 1e-3, "seed {seed}: {path} for {truth}");
    }
    // For several photons, the path is the mean of theirs.
    let path = simulate(&with(&scene, &json!({"photons": 1000, "seed": 9})))["mean_path_mm"].as_f64().unwrap();
    let truth = (0..1000).map(|photon| -draw(9, photon, 0)[2].ln()).sum::<f64>() / 1000.0;
    assert!((path - truth).abs() < 1e-3, "{path} for {truth}");
}

/// The correlation of two streams of `n` numbers, in standard deviations of uncorrelated ones.
fn correlation(n: usize, a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64) -> f64 {
    12.0 * (0..n).map(|i| (a(i) - 0.5) * (b(i) - 0.5)).sum::<f64>() / (n as f64).sqrt()
}

/// The chi squared of pairs on a grid of 32 by 32, in standard deviations above its mean.
fn pairs(n: usize, a: impl Fn(usize) -> f64, b: impl Fn(usize) -> f64) -> f64 {
    let mut counts = vec![0f64; 1024];
    (0..n).for_each(|i| counts[(a(i) * 32.0) as usize * 32 + (b(i) * 32.0) as usize] += 1.0);
    let expected = n as f64 / 1024.0;
    let chi: f64 = counts.iter().map(|c| (c - expected).powi(2) / expected).sum();
    (chi - 1023.0) / (2.0f64 * 1023.0).sqrt()
}

#[test]
fn adjacent_seeds_photons_events_and_dimensions_are_independent() {
    let n = 200_000;
    let at = |i: usize| i as u64;
    for d in 0..4 {
        for (name, r, p) in [
            (
                "seeds",
                correlation(n, |i| draw(7, at(i), 3)[d], |i| draw(8, at(i), 3)[d]),
                pairs(n, |i| draw(7, at(i), 3)[d], |i| draw(8, at(i), 3)[d]),
            ),
            (
                "photons",
                correlation(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i) + 1, 3)[d]),
                pairs(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i) + 1, 3)[d]),
            ),
            (
                "events",
                correlation(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i), 4)[d]),
                pairs(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i), 4)[d]),
            ),
            (
                "dimensions",
                correlation(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i), 3)[(d + 1) % 4]),
                pairs(n, |i| draw(7, at(i), 3)[d], |i| draw(7, at(i), 3)[(d + 1) % 4]),
            ),
        ] {
            assert!(
                r.abs() < 4.5 && p.abs() < 4.5,
                "adjacent {name}, dimension {d}: correlation {r:.1}, pairs {p:.1} deviations"
            );
        }
    }
    // Consecutive seeds for one photon: the first numbers of a study's repeats.
    let r = correlation(n, |i| draw(at(i), 0, 0)[2], |i| draw(at(i) + 1, 0, 0)[2]);
    assert!(r.abs() < 4.5, "seeds in a row: {r:.1} deviations");
}

#[test]
fn no_number_is_0_or_1() {
    assert!(unit(0) > 0.0 && unit(u32::MAX) < 1.0);
    assert!((-(unit(0) as f32).ln()).is_finite() && (-(1.0 - unit(u32::MAX) as f32).ln()).is_finite());
}

/// The lecture's hybrid generator: three Tausworthe steps and a linear congruential one, combined (GPU Gems 3, chapter 37).
struct Tausworthe([u32; 4]);

impl Tausworthe {
    /// The generator with the lecture's seed: all components have the same small number.
    fn new(seed: u32) -> Self {
        Self([seed; 4])
    }

    fn component(z: u32, s: [u32; 3], mask: u32) -> u32 {
        ((z & mask) << s[2]) ^ (((z << s[0]) ^ z) >> s[1])
    }

    fn next(&mut self) -> u32 {
        let [a, b, c, d] = &mut self.0;
        *a = Self::component(*a, [13, 19, 12], 4_294_967_294);
        *b = Self::component(*b, [2, 25, 4], 4_294_967_288);
        *c = Self::component(*c, [3, 11, 17], 4_294_967_280);
        *d = d.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *a ^ *b ^ *c ^ *d
    }
}

#[test]
fn the_lectures_generator_shows_its_faults() {
    // Seeds below the masks' lowest bits lose components for ever. The linear congruential one alone is left, whose lowest bit alternates.
    for seed in [1, 7] {
        let mut generator = Tausworthe::new(seed);
        let zero = (0..100).fold([true; 3], |zero, _| {
            generator.next();
            std::array::from_fn(|i| zero[i] && (generator.0[i] == 0))
        });
        assert!(zero.contains(&true), "seed {seed}: {:x?}", generator.0);
    }
    let mut generator = Tausworthe::new(1);
    let low: Vec<u32> = (0..64).map(|_| generator.next() & 1).collect();
    assert!(low.windows(2).all(|w| w[0] != w[1]), "with seed 1 the lowest bit alternates: {low:?}");
    // Times 2^-32 in single precision, the last 128 numbers are exactly 1, and log(1 - u) is infinite.
    let scaled = |bits: u32| bits as f32 * 2.328_306_4e-10f32;
    let ones = (u32::MAX - 1023..=u32::MAX).filter(|b| scaled(*b) == 1.0).count();
    assert_eq!(ones, 128);
    assert!((1.0 - scaled(u32::MAX)).ln().is_infinite());
}
