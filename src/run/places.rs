//! The place in its pixel that each sample's ray goes through.

use std::f64::consts::{PI, SQRT_2, TAU};

use glam::Vec2;

use crate::device::structs::View as DeviceView;
use crate::split_mix::SplitMix64;

/// The places in a pixel that the rays of samples go through, the same in all pixels: `sample_offset` of `kernels/shared/places.h`.
///
/// They are points of Sobol's (0, 2)-sequence: each power of two of them has one point in every box of that part of the pixel. The seed gives it a
/// nested uniform scramble (Owen, "Randomly Permuted (t,m,s)-Nets and (t,s)-Sequences", 1995).
///
/// On a smooth slope, the mean of few samples has the error of the mean of their places. So the first sample is the centre, and three around it, at
/// 120° from each other and at a distance of √2/3, give the four together the moments of the whole pixel: they integrate every quadratic. If one of
/// them lies on a diagonal, or nearly, these four are in the boxes of four points of the sequence, and a scramble of what is in their quarters moves
/// those there. Such a sequence is as good as any other, and its scramble as random but for these points. From there on the samples of each octave, 4
/// to 7, 8 to 15, …, are bent by u + c u (1 − u), so that the mean after each power of two is the centre, too.
///
/// After 16 and 64 samples they are better than turned and mirrored points of the R2 sequence (Roberts, 2018) by 1.1 and 1.2 times at edges, and by
/// 1.2 and 1.7 times at narrow ridges; in slopes all of these are balanced.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    keys: [u32; 2],
    /// By side, and by quarter of it.
    moves: [[u32; 4]; 2],
    /// By octave, and by side.
    bends: [[f32; 2]; OCTAVES],
}

/// The octaves of samples that are bent, and the first of these samples. Beyond them it would not be seen.
const OCTAVES: usize = 8;
const BENT_FROM: u32 = 4;

/// The distance of the three from the centre, and the angle that one of them may have to a diagonal, so that all stay in their boxes.
const RADIUS: f64 = SQRT_2 / 3.0;
const ASKEW: f64 = 12.0 * PI / 180.0;

impl Places {
    /// The places of a seed. One of 16 scrambles has its first four points in the boxes of the centre and of three around it.
    pub fn of_seed(seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        loop {
            if let Some(places) = Self::some(&mut random) {
                return places;
            }
        }
    }

    /// The places with random keys, unless their first four points are in other boxes.
    fn some(random: &mut SplitMix64) -> Option<Self> {
        let word = random.bits();
        let keys = [word as u32, (word >> 32) as u32];
        let points = [0, 1, 2, 3].map(|number| sobol(number, keys));
        let [near, ..] = points.map(quarters);
        // The centre is in each of the boxes that meet there; one of the three is opposite.
        let centre = near.map(|quarter| [None, Some(0x7fff_ffffu32), Some(0x8000_0000), None][quarter]);
        let [Some(x), Some(y)] = centre else { return None };
        let away = near.map(|quarter| 1.5 - quarter as f64);
        let turn = away[1].atan2(away[0]) + ASKEW * (2.0 * random.unit() - 1.0);
        let around = [0.0, 1.0, 2.0].map(|n| {
            let (sin, cos) = (turn + n / 3.0 * TAU).sin_cos();
            [cos, sin].map(|side| ((0.5 + RADIUS * side) * 2.0f64.powi(32)) as u32)
        });
        let mut moves = [[0; 4]; 2];
        for point in points {
            let there = [[x, y]].into_iter().chain(around).find(|place| quarters(*place) == quarters(point))?;
            for side in 0..2 {
                moves[side][quarters(point)[side]] = point[side] ^ there[side];
            }
        }
        let mut places = Self { keys, moves, bends: [[0.0; 2]; OCTAVES] };
        places.balance();
        Some(places)
    }

    /// Bends each octave.
    fn balance(&mut self) {
        for octave in 0..OCTAVES {
            let numbers = BENT_FROM << octave..BENT_FROM << (octave + 1);
            let sums = numbers
                .map(|n| self.sequence(n))
                .fold([Vec2::ZERO; 2], |[off, bent], place| [off + 0.5 - place, bent + place * (1.0 - place)]);
            self.bends[octave] = (sums[0] / sums[1]).to_array();
        }
    }

    /// The place of sample `n` before it is bent.
    fn sequence(&self, n: u32) -> Vec2 {
        let point = sobol(n, self.keys);
        let moved = |side: usize| point[side] ^ self.moves[side][quarters(point)[side]];
        Vec2::new(unit(moved(0)), unit(moved(1)))
    }

    /// The place of sample `n`, in pixels from the pixel's corner.
    pub fn at(&self, n: u32) -> Vec2 {
        let place = self.sequence(n);
        let octave = (n / BENT_FROM).checked_ilog2().and_then(|octave| self.bends.get(octave as usize));
        octave.map_or(place, |bend| place + Vec2::from_array(*bend) * place * (1.0 - place))
    }

    /// Tells the kernels.
    pub fn apply(&self, view: &mut DeviceView) {
        view.place_keys = self.keys;
        view.place_moves = std::array::from_fn(|i| self.moves[i / 4][i % 4]);
        view.place_bends = std::array::from_fn(|i| self.bends[i / 2][i % 2]);
    }
}

/// The point of Sobol's (0, 2)-sequence with this number, scrambled with these keys, in units of 2⁻³²: `shared_point` of the kernels.
fn sobol(number: u32, keys: [u32; 2]) -> [u32; 2] {
    let halves = [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0x0000_ffff)];
    let second = halves.into_iter().fold(number, |v, (by, kept)| v ^ ((v >> by) & kept));
    [scrambled(number, keys[0]), scrambled(second, keys[1])]
}

/// The quarter of each side that a point is in.
fn quarters(point: [u32; 2]) -> [usize; 2] {
    point.map(|side| (side >> 30) as usize)
}

/// A part of a side, strictly inside (0, 1).
fn unit(side: u32) -> f32 {
    ((side >> 9) as f32 + 0.5) * 2.0f32.powi(-23)
}

/// A nested uniform scramble of a number whose bits are given in reverse.
fn scrambled(reversed: u32, key: u32) -> u32 {
    let product = |v: u32, by: u32| v ^ v.wrapping_mul(by);
    let keyed = product(reversed, 0x3d20_adea).wrapping_add(key).wrapping_mul((key >> 16) | 1);
    product(product(keyed, 0x0552_6c56), 0x53a2_2864).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::program::{Source, Variant};
    use crate::device::structs::DeviceStruct;
    use crate::device::{Device, DeviceConfig};

    const SEEDS: [u64; 3] = [0, 1, u64::MAX];

    fn mean(seed: u64, samples: u32, of: impl Fn(f64, f64) -> f64) -> f64 {
        let places = Places::of_seed(seed);
        let place = |n| places.at(n).as_dvec2() - 0.5;
        (0..samples).map(place).map(|p| of(p.x, p.y)).sum::<f64>() / f64::from(samples)
    }

    #[test]
    fn places_are_balanced_about_the_centre_whatever_the_seed() {
        for seed in SEEDS {
            let powers = (2..11).map(|power| (1 << power, 1e-6));
            for (samples, within) in powers.chain([(1, 1e-6), (12, 0.02), (24, 0.012), (4096, 1e-4)]) {
                let [x, y] = [mean(seed, samples, |x, _| x), mean(seed, samples, |_, y| y)];
                assert!(x.abs() < within && y.abs() < within, "{samples}: {x}, {y}");
            }
            let places = Places::of_seed(seed);
            assert!(places.at(0).distance(Vec2::splat(0.5)) < 1e-6);
            assert!((0..5000).map(|n| places.at(n)).all(|p| p.min_element() >= 0.0 && p.max_element() <= 1.0));
        }
        for n in 1..40 {
            let [a, b] = [0, 1].map(|seed| Places::of_seed(seed).at(n));
            assert!(a.distance(b) > 1e-3, "sample {n} of two seeds has one place");
        }
    }

    #[test]
    fn each_power_of_two_has_one_place_in_every_box_of_that_part() {
        let mut random = SplitMix64::new(11);
        for power in 1..9u32 {
            let first = (random.bits() as u32 % 64) << power;
            let places = Places::of_seed(random.bits());
            let points: Vec<Vec2> = (first..first + (1 << power)).map(|n| places.sequence(n)).collect();
            for across in 0..=power {
                let cell = |p: &Vec2| {
                    let of = |x: f32, power: u32| (x * (1u32 << power) as f32) as u32;
                    of(p.x, across) << (power - across) | of(p.y, power - across)
                };
                let cells: std::collections::HashSet<u32> = points.iter().map(cell).collect();
                assert_eq!(cells.len(), points.len(), "2^{across} by 2^{}", power - across);
            }
        }
    }

    #[test]
    fn a_scrambled_place_is_anywhere_in_the_pixel() {
        let mut random = SplitMix64::new(12);
        for number in [0, 1, 5, 100] {
            let mut cells = [0.0f64; 256];
            for _ in 0..25_600 {
                let word = random.bits();
                let [u, v] = sobol(number, [word as u32, (word >> 32) as u32]);
                cells[(u >> 28 << 4 | v >> 28) as usize] += 1.0;
            }
            let chi_squared: f64 = cells.iter().map(|n| (n - 100.0).powi(2) / 100.0).sum();
            // 255 degrees of freedom have a deviation of 22.6.
            assert!((chi_squared - 255.0).abs() < 100.0, "{number}: {chi_squared}");
        }
    }

    /// A kernel that writes the places that kernels see.
    const PLACES: &str = "#include \"shared/places.h\"
kernel void places(constant View *view, global float *shared_places, global UInt *own) {
    uint n = get_global_id(0);
    float2 place = sample_offset(view, n);
    shared_places[2 * n] = place.x, shared_places[2 * n + 1] = place.y;
    UInt u, v;
    own_point(as_UInt(LANE_IDS) + (UInt)(n * LANES), (UInt)(view->place_keys[0]), (UInt)(view->place_keys[1]), &u, &v);
    own[2 * n] = u, own[2 * n + 1] = v;
}
";

    #[test]
    fn kernels_have_the_same_places() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("places.cl"), PLACES).expect("a kernel");
        let shared = concat!(env!("CARGO_MANIFEST_DIR"), "/kernels/shared");
        std::os::unix::fs::symlink(shared, folder.path().join("shared")).expect("a link");
        let (words, structs) = (String::new as fn() -> String, || vec![DeviceView::LAYOUT]);
        let source = Source { kernel: "places", words, structs, variants: Vec::new, common: 0 };
        let kernels = Some(folder.path().to_owned());
        let mut device = Device::open(&DeviceConfig { kernels, strict: true, ..DeviceConfig::pocl() }).expect("PoCL");
        let variant = Variant::new("places", None, &[]);
        device.build(&source, &variant).expect("a kernel");
        let (count, lanes) = (2048, device.info().lanes as usize);
        let places = Places::of_seed(5);
        let mut view = DeviceView::default();
        places.apply(&mut view);
        let view = device.upload(bytemuck::bytes_of(&view), 0).expect("memory");
        let buffer = |values: usize| device.allocate(4 * values).expect("memory");
        // Whole work-groups write past their count.
        let (of_all, own) = (buffer(2 * (count + 64)), buffer(2 * lanes * (count + 64)));
        device.run(&variant, &[("view", &view), ("shared_places", &of_all), ("own", &own)], count).expect("a launch");
        let (mut found, mut points) = (vec![[0.0f32; 2]; count], vec![0u32; 2 * lanes * count]);
        device.read(&of_all, 0, &mut found).expect("places");
        device.read(&own, 0, &mut points).expect("points");
        for (n, place) in (0..).zip(found) {
            assert!(places.at(n).distance(place.into()) < 1e-6, "{n}: {place:?}, {}", places.at(n));
        }
        for n in 0..count * lanes {
            let point = [0, 1].map(|side| points[(n / lanes * 2 + side) * lanes + n % lanes]);
            assert_eq!(point, sobol(n as u32, places.keys), "{n}");
        }
    }

    #[test]
    fn four_places_and_many_have_the_moments_of_a_pixel() {
        for (seed, (samples, within)) in
            SEEDS.into_iter().flat_map(|seed| [(4, 1e-6), (64, 0.004), (256, 0.001)].map(|test| (seed, test)))
        {
            let moments = [
                mean(seed, samples, |x, _| x * x) - 1.0 / 12.0,
                mean(seed, samples, |_, y| y * y) - 1.0 / 12.0,
                mean(seed, samples, |x, y| x * y),
            ];
            assert!(moments.iter().all(|m| m.abs() < within), "{samples}: {moments:?}");
        }
    }

    #[test]
    fn they_see_where_an_edge_is() {
        // The coverage by a straight edge at 360 angles and 41 distances. With n random places, it has a deviation of up to ½/√n.
        let inside = |[s, c, d]: [f64; 3], x: f64, y: f64| f64::from(u8::from(c * x + s * y < d));
        let fine = |i: i32| (f64::from(i) + 0.5) / 50.0 - 0.5;
        let edges = (0..360).flat_map(|angle| {
            let (s, c) = f64::from(angle).to_radians().sin_cos();
            (-20..=20).map(move |step| [s, c, f64::from(step) * 0.02])
        });
        let covered = |edge| (0..2500).map(|i| inside(edge, fine(i % 50), fine(i / 50))).sum::<f64>() / 2500.0;
        let edges: Vec<([f64; 3], f64)> = edges.map(|edge| (edge, covered(edge))).collect();
        let wrong = |seed: u64, samples: u32| {
            let of_seed = Places::of_seed(seed);
            let places: Vec<[f64; 2]> = (0..samples).map(|n| (of_seed.at(n).as_dvec2() - 0.5).to_array()).collect();
            let mean = |edge| places.iter().map(|[x, y]| inside(edge, *x, *y)).sum::<f64>() / f64::from(samples);
            let squares: f64 = edges.iter().map(|(edge, covered)| (mean(*edge) - covered).powi(2)).sum();
            (squares / edges.len() as f64).sqrt()
        };
        // On average over seeds. Places that do not depend on the seed may be a little better by luck.
        for (samples, most) in [(4, 0.13), (16, 0.047), (64, 0.0165), (256, 0.006)] {
            let wrong = ((0..8).map(|seed| wrong(seed, samples).powi(2)).sum::<f64>() / 8.0).sqrt();
            assert!(wrong < most, "{samples}: {wrong}");
        }
    }
}
