//! What the pilots found, and a closer look at it where it may decide.

use serde_json::Value;

use super::candidates::Candidate;
use super::noise::{Places, SMALL, in_common, mean, random};
use super::pilot::{Pilot, SAMPLES, chance, deviation, run, some};
use super::run::Run;
use super::{Considered, Planner};
use crate::error::Result;
use crate::scene::Window;

/// Samples of a deeper look, of those that are likely to be planned, and of those of the one before.
const DEEPER: [u32; 2] = [8, 16];
/// Samples of the whole picture with the chosen setting that confirm it, and where one takes long.
const CONFIRMED: [u32; 2] = [4, 2];
/// A picture of which a sample takes less, ms, is timed so often.
const SHORT: f64 = 20.0;
const REPEATS: usize = 3;
/// Of fewer pixels that matter a pilot does not tell what the places miss in the picture,
const FEW: f64 = 200.0;
/// nor where the first samples of the whole picture miss so many times as much, squared, or so many times less,
const UNLIKE: f64 = 1.5;
/// which must be seen by so many deviations, and matter.
const SURE: f64 = 4.0;
/// What part of that a closer look must have, and what part of the picture it may.
const PART: f64 = 0.9;
const MOST: f64 = 0.25;

/// What the pilots found.
pub struct Found {
    /// Of those that were run, the reference first.
    pub pilots: Vec<Pilot>,
    /// What the places in a pixel miss, of all of them.
    pub places: Places,
    /// Pixels of the reference's pilot that matter.
    pub matter: f64,
    /// Where in the picture what the places miss is, if that is a small part of it, and what a mean of squares there is in the picture.
    pub part: Option<(Window, f64)>,
    /// Those that were not run, as one that leaves out less leaves out too much.
    pub skipped: Vec<Considered>,
}

impl Found {
    /// What the places miss in the part of the picture where that is.
    async fn look_at_part(
        &self,
        planner: &Planner<'_>,
        body: &Value,
        candidate: &Candidate,
        samples: u32,
        scale: f64,
    ) -> Result<Places> {
        let Some((window, part)) = self.part else { return Ok(self.places.clone()) };
        let a = run(planner, body, candidate, window, samples, 1).await?;
        let b = run(planner, body, candidate, window, samples, 2).await?;
        let within = deviation(a.film.random_noise().1);
        Ok(Places::by_two(a.rounds(), b.rounds(), scale / part.sqrt(), within))
    }

    /// Looks at what the places miss after `samples` of a pilot that are likely to be planned, unless that is known.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn deepen(
        &mut self,
        planner: &Planner<'_>,
        body: &Value,
        image: [u32; 2],
        index: usize,
        samples: u32,
    ) -> Result<bool> {
        let pilot = &self.pilots[index];
        let deep = (DEEPER[0] * samples).min(DEEPER[1] * self.places.last()).min(planner.limits.max_samples);
        if self.places.is_known(samples, pilot.random) || deep < SAMPLES {
            return Ok(false);
        }
        if self.part.is_some() {
            self.places = self.look_at_part(planner, body, &pilot.candidate, deep, pilot.scale).await?;
        } else {
            let run = run(planner, body, &pilot.candidate, some([0, 0], image), deep, 1).await?;
            self.places.look_deeper(run.rounds(), pilot.scale, pilot.random);
        }
        Ok(true)
    }

    /// The first samples of the whole picture, with the setting that is likely to be chosen, unless they are there: its time, and its
    /// random part, of which a pilot may have seen more or less than there is, the others alike.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn confirm(
        &mut self,
        planner: &Planner<'_>,
        body: &Value,
        image: [u32; 2],
        index: usize,
    ) -> Result<bool> {
        let Pilot { candidate, ms_per_sample, whole: None, .. } = self.pilots[index].clone() else { return Ok(false) };
        let sample = ms_per_sample * f64::from(image[0]) * f64::from(image[1]);
        let (samples, whole) = (CONFIRMED[usize::from(sample > SHORT)], Window::every(1, image));
        let mut runs = Vec::new();
        for seed in 1..=2 {
            runs.push(run(planner, body, &candidate, whole, samples, seed).await?);
        }
        while runs.len() < REPEATS && runs[0].ms[0] + runs[0].ms[1] < SHORT {
            runs.push(run(planner, body, &candidate, whole, samples, 1).await?);
        }
        let median = |i: usize| {
            let mut all: Vec<f64> = runs.iter().map(|r| r.ms[i]).collect();
            all.sort_by(f64::total_cmp);
            all[(all.len() - 1) / 2]
        };
        let ms = [median(0), median(1)];
        let [a, b] = [runs[0].rounds(), runs[1].rounds()];
        let ((seen, matter), numbers) = (random(a, b, runs[0].mean()), a.len() as f64);
        let more = if self.pilots[index].random > 0.0 { seen / self.pilots[index].random } else { 1.0 };
        self.pilots.iter_mut().filter(|p| p.whole.is_none()).for_each(|p| p.random *= more);
        let pilot = &mut self.pilots[index];
        (pilot.random, pilot.chance, pilot.whole) = (seen, chance(matter, matter * numbers), Some(ms));
        self.look_closer(planner, body, image, &candidate, [&runs[0], &runs[1]]).await?;
        Ok(true)
    }

    /// Where few pixels matter, as those around a lamp that is seen, a pilot has too few of them or none: the first samples of the whole
    /// picture, with seeds of their own, tell how much the places miss and where that is.
    async fn look_closer(
        &mut self,
        planner: &Planner<'_>,
        body: &Value,
        image: [u32; 2],
        candidate: &Candidate,
        runs: [&Run; 2],
    ) -> Result<()> {
        let ([Some(first), Some(other)], [Some(last), Some(another)]) =
            (runs.map(|r| r.rounds().first()), runs.map(|r| r.rounds().last()))
        else {
            return Ok(());
        };
        let (random, scale) = (random(runs[0].rounds(), runs[1].rounds(), runs[0].mean()).0, runs[0].mean());
        let missed = in_common([first, last], [other, another]);
        let squared = mean(&missed) / (scale * scale);
        let is_seen = squared > random * (SURE / (missed.len() as f64).sqrt()).max(SMALL);
        let more = self.places.more_by(last.samples, squared);
        if self.part.is_some() || !is_seen {
            return Ok(());
        }
        let differs = self.matter < FEW || !(1.0 / UNLIKE..UNLIKE).contains(&more);
        if more.is_finite() && (differs || last.samples == CONFIRMED[0]) {
            self.places.scale(more, deviation(runs[0].film.random_noise().1));
        }
        if !differs {
            return Ok(());
        }
        if let Some((window, share)) = around(&missed, image) {
            let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
            self.part = Some((window, pixels(window.size) / pixels(image) / share));
            self.places = self.look_at_part(planner, body, candidate, SAMPLES, scale).await?;
        }
        Ok(())
    }
}

/// The rectangle around most of what is missed, and the part of it that it has; none where that is not a small part of the picture.
fn around(missed: &[f64], [width, height]: [u32; 2]) -> Option<(Window, f64)> {
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
    (total > 0.0 && small).then(|| (some(least, size), share.min(1.0)))
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
        assert_eq!(found.map(|f| f.0), Some(Window { left_top: [69, 8], size: [5, 6], apart: 1 }));
        assert!(found.is_some_and(|f| (f.1 - 1.0).abs() < 0.01), "{found:?}");
        let everywhere: Vec<f64> = (0..8000).map(|i| f64::from(i % 7 == 0)).collect();
        assert_eq!(around(&everywhere, image), None);
        assert_eq!(around(&vec![0.0; 8000], image), None);
    }
}
