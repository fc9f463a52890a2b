//! The first samples of a whole picture: its random part, and the region of most of the error of its places.

use super::noise::{in_common, random};
use super::pilot::{PIXELS, deviation};
use super::run::{Run, mean};
use crate::render::region::Region;

/// The least part of that error that a closer look must cover, and the largest part of the picture that it may cover.
const PART: f64 = 0.9;
const MOST: f64 = 0.25;

/// The findings of the first samples of a whole picture, by two seeds.
pub struct WholePicture {
    pub samples: u32,
    /// The mean luminance.
    pub scale: f64,
    /// J² of `noise`, relative, and the effective number of its pixels.
    pub random: f64,
    pub matter: f64,
    /// The squared difference of the first sample and the last less its random part, relative, and its relative deviation.
    pub missed: f64,
    pub within: f64,
    /// The region of most of that difference, from `around`.
    pub around: Option<(Region, f64)>,
}

impl WholePicture {
    /// The findings of two runs of an image of these sides.
    pub fn of([a, b]: &[Run; 2], image: [u32; 2]) -> Self {
        let scale = a.scale();
        let (random, matter) = random(a.rounds(), b.rounds(), scale);
        let ends = |run: &Run| run.rounds().first().cloned().zip(run.rounds().last().cloned());
        let missed: Vec<f64> = match (ends(a), ends(b)) {
            (Some((first, last)), Some((other, another))) => in_common([&first, &last], [&other, &another]).collect(),
            _ => Vec::new(),
        };
        Self {
            samples: a.film.main.count,
            scale,
            random,
            matter,
            missed: mean(missed.iter().copied()) / (scale * scale),
            within: deviation(a.film.random_noise().1),
            around: around(&missed, image),
        }
    }
}

/// The rectangle around most of the missed squares, and the part of them inside; `None` if that is not a small part of the picture.
fn around(missed: &[f64], [width, height]: [u32; 2]) -> Option<(Region, f64)> {
    let total: f64 = missed.iter().sum();
    let mut order: Vec<usize> = (0..missed.len()).collect();
    order.sort_by(|a, b| missed[*b].total_cmp(&missed[*a]));
    let (mut sum, mut least, mut most) = (0.0, [u32::MAX; 2], [0; 2]);
    for i in order {
        if sum >= PART * total {
            break;
        }
        sum += missed[i];
        for (axis, at) in [i as u32 % width, i as u32 / width].into_iter().enumerate() {
            least[axis] = least[axis].min(at.saturating_sub(1));
            most[axis] = most[axis].max((at + 2).min([width, height][axis]));
        }
    }
    let size = [0, 1].map(|axis| most[axis].saturating_sub(least[axis]));
    let small = f64::from(size[0]) * f64::from(size[1]) <= MOST * f64::from(width) * f64::from(height);
    let inside = |i: usize| {
        let at = [i as u32 % width, i as u32 / width];
        (0..2).all(|axis| (least[axis]..most[axis]).contains(&at[axis]))
    };
    let share = (0..missed.len()).filter(|i| inside(*i)).map(|i| missed[i]).sum::<f64>() / total;
    (total > 0.0 && small).then(|| (Region::some(PIXELS, least, size), share.min(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_lamp_is_found_and_edges_everywhere_are_not_a_part() {
        let image = [100, 80];
        let mut missed: Vec<f64> = (0..8000).map(|i| if i % 2 == 0 { 1e-3 } else { -1e-3 }).collect();
        for (x, y) in [(70, 9), (72, 9), (71, 12)] {
            missed[y * 100 + x] = 5.0;
        }
        let found = around(&missed, image);
        assert_eq!(found.map(|f| f.0), Some(Region { left_top: [69, 8], size: [5, 6], stride: 1 }));
        assert!(found.is_some_and(|f| (f.1 - 1.0).abs() < 0.01), "{found:?}");
        let everywhere: Vec<f64> = (0..8000).map(|i| f64::from(i % 7 == 0)).collect();
        assert_eq!(around(&everywhere, image), None);
        assert_eq!(around(&vec![0.0; 8000], image), None);
    }
}
