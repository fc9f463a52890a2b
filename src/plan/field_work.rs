//! The work that a picture needs of a field that is yet to be computed, such as photons.
//!
//! A picture I_N after work N is wrong by e² = F² / N, if the work is random. Fields with seeds of their own, some of N and one of 8 N,
//! tell F²: |I_N − I_8N|² = F² (1/N + 1/8N). If the picture is not linear in the field, as with colours that follow the field's range, it
//! is wrong by more, and that part falls faster; F² has that part too. F² does not have the view's own random part: the square is the mean
//! over the pixels of d d′, of two seeds of the view. Often only a few bright pixels make it up, as those of a beam, or one number that all
//! colours follow. One field would then tell little.

use std::sync::Arc;

use serde_json::{Value, json};

use super::found::Found;
use super::noise::in_common;
use super::pilot::{PIXELS, SAMPLES};
use super::reply::FieldAmount;
use super::run::{Asked, Run, mean, to_its_end};
use super::{Planner, looking_at};
use crate::error::{Error, Result};
use crate::film::{Round, by_chance};
use crate::render::Scene;
use crate::render::region::Region;
use crate::technique::{AskedField, Work};
use crate::volume::Volume;

/// The device time that a small field is to take, ms.
const PILOT_MS: f64 = 60.0;
/// The number of small fields, and the ratio of the large field's work to theirs.
const FIELDS: usize = 8;
const MANY: u64 = 8;
/// A planned amount of work is rounded to about this part of it.
const ROUNDED: f64 = 0.01;

/// A field as pilots see it: small fields, and a large one.
pub struct Simulated {
    asked: AskedField,
    kind: Work,
    most: u64,
    /// The work of a small field.
    few: u64,
    /// The large field, its work, and its device time, ms.
    many: Arc<Volume>,
    work: u64,
    ms: f64,
}

/// The error and the cost of a field's work.
#[derive(Debug, Clone, Copy)]
pub struct FieldWork {
    /// The name of the parameter that counts the work.
    pub of: &'static str,
    /// F², relative to the picture's mean, squared.
    pub squared: f64,
    /// The factor by which a picture's error may exceed F / √N by chance.
    pub chance: f64,
    /// The device time besides the work, and that of one piece of the work, ms.
    pub ms: [f64; 2],
    /// The amount that is asked for, if the request says it.
    pub given: Option<u64>,
    /// The most work that is permitted.
    pub most: u64,
    /// The number of pictures on the way.
    pub looks: u32,
}

impl Simulated {
    /// Computes a little of the field that a scene looks at, which tells the work of the small fields, and then the large field.
    ///
    /// # Errors
    /// Those of the renders.
    pub async fn of(planner: &Planner<'_>, scene: &Scene, asked: AskedField, kind: Work) -> Result<Self> {
        let most = (kind.most)(planner.limits);
        let first = kind.first.min(most);
        let (_, ms) = simulate(planner, scene, [first, 1]).await?;
        let few = ((PILOT_MS * first as f64 / ms) as u64).clamp(first, (most / MANY).max(first));
        let work = (MANY * few).min(most);
        let (many, ms) = simulate(planner, scene, [work, 2]).await?;
        Ok(Self { asked, kind, most, few, many, work, ms })
    }

    /// The volume that pilots look at.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.many
    }

    /// Computes the small fields of `scene`, and measures their effect on the picture of the reference.
    ///
    /// # Errors
    /// Those of the renders.
    pub async fn work(
        &self,
        asked: Asked<'_>,
        scene: &Scene,
        found: &Found,
        pixels_per_voxel: f64,
    ) -> Result<FieldWork> {
        let (Some(pilot), Some(of_many)) = (found.pilots.first(), &found.reference) else {
            return Err(Error::internal("a field that no pilot looked at"));
        };
        let region = Region::some(PIXELS, [0, 0], asked.image());
        let [a, b] = last(of_many)?;
        let (mut apart, mut of_fields, mut ms) = (vec![0.0; of_many[0].pixels], Vec::new(), f64::INFINITY);
        for seed in 3..3 + FIELDS as u64 {
            // The fields are computed one at a time, since they may be large.
            let (field, took) = simulate(asked.planner, scene, [self.few, seed]).await?;
            let looking = Asked { scene: &looking_at(scene, &field)?, ..asked };
            let [c, d] = last(&looking.run_two(&pilot.setting, region, SAMPLES).await?)?;
            let products: Vec<f64> = in_common([&c, &a], [&d, &b]).collect();
            of_fields.push(mean(products.iter().copied()));
            apart.iter_mut().zip(products).for_each(|(sum, p)| *sum += p / FIELDS as f64);
            ms = ms.min(took);
        }
        let per_piece = 1.0 / self.few as f64 + 1.0 / self.work as f64;
        let squared = mean(apart.iter().copied()).max(0.0) / pilot.scale.powi(2) / per_piece;
        // The pixels of one voxel count as one.
        let alike = (pixels_per_voxel / f64::from(region.stride)).max(1.0).powi(2);
        Ok(FieldWork {
            of: self.kind.of,
            squared,
            chance: by_chance((independent(&apart) / alike).min(freedom(&of_fields)), FIELDS as f64),
            ms: self.line(ms),
            given: self.asked.given,
            most: self.most,
            looks: self.kind.looks,
        })
    }

    /// The device time besides the work and that of one piece of it, if a small field takes `few_ms`.
    fn line(&self, few_ms: f64) -> [f64; 2] {
        let each = self.ms / self.work as f64;
        // Time that does not grow with the number of pieces is not their own.
        let one = ((self.ms - few_ms) / (self.work - self.few).max(1) as f64).clamp(0.5 * each, each);
        [self.ms - one * self.work as f64, one]
    }

    /// Puts an amount of work into a request.
    pub fn put_into(&self, request: &mut Value, work: u64) {
        request["volume"][self.asked.technique][self.kind.of] = json!(work);
    }
}

/// The last rounds of two runs.
fn last([a, b]: &[Run; 2]) -> Result<[Arc<Round>; 2]> {
    let rounds = a.rounds().last().cloned().zip(b.rounds().last().cloned());
    rounds.map(Into::into).ok_or_else(|| Error::internal("a pilot without rounds"))
}

/// The field of a scene after an amount of work, by a seed of its own, and its time on the device, ms.
async fn simulate(planner: &Planner<'_>, scene: &Scene, [work, seed]: [u64; 2]) -> Result<(Arc<Volume>, f64)> {
    let Some(asked) = scene.subject().field() else { return Err(Error::internal("there is no field")) };
    let region = Region::some(1.0, [0, 0], scene.image());
    let other = scene.subject().with_field(asked.field.with(work, seed));
    computed(planner, scene.looking_at(other)?.into_pilot(region, 1)).await
}

/// The whole field of a scene, which has no random work.
///
/// # Errors
/// Those of the render.
pub async fn whole(planner: &Planner<'_>, scene: &Scene) -> Result<Arc<Volume>> {
    let region = Region::some(1.0, [0, 0], scene.image());
    Ok(computed(planner, scene.looking_at(scene.subject().clone())?.into_pilot(region, 1)).await?.0)
}

/// The field of a pilot, and its time on the device, ms.
async fn computed(planner: &Planner<'_>, pilot: Scene) -> Result<(Arc<Volume>, f64)> {
    let job = to_its_end(planner, pilot).await?;
    let field = job.field().ok_or_else(|| Error::internal("a pilot without its field"))?;
    Ok((field, job.field_ms().max(f64::MIN_POSITIVE)))
}

impl FieldWork {
    /// An amount of this work.
    pub fn of(&self, amount: u64) -> FieldAmount {
        FieldAmount { of: self.of, amount }
    }

    /// The squared error that the field brings after an amount of work, times the square of `by_chance`.
    pub fn squared_after(&self, amount: u64, by_chance: f64) -> f64 {
        by_chance * by_chance * self.squared / amount as f64
    }

    /// The least work whose squared error is at most `room`; `None` if it is more than is permitted, or than is asked for.
    pub fn needed(&self, room: f64) -> Option<u64> {
        let least = (self.squared_after(1, self.chance) / room).max(1.0);
        match self.given {
            Some(given) => (room > 0.0 && least <= given as f64).then_some(given),
            None => (room > 0.0 && least <= self.most as f64).then(|| rounded_up(least).min(self.most)),
        }
    }

    /// The amount of work that there is time for, besides the time of any amount.
    pub fn in_time(&self, ms: f64) -> u64 {
        self.given.unwrap_or(((ms / self.ms[1]) as u64).clamp(1, self.most))
    }

    /// The device time of an amount of work, with the pictures on the way, ms.
    pub fn cost(&self, amount: u64, picture_ms: f64) -> f64 {
        self.ms[0] + self.ms[1] * amount as f64 + f64::from(self.looks) * picture_ms
    }
}

/// The effective number of pixels of a sum of squares, (Σ s)² / Σ s². The square of one that is known by k fields is too large by 1 + 2/k.
fn independent(squares: &[f64]) -> f64 {
    let (sum, of_squares) = squares.iter().fold((0.0, 0.0), |(sum, of_squares), s| (sum + s, of_squares + s * s));
    if of_squares > 0.0 { sum * sum / of_squares * (1.0 + 2.0 / FIELDS as f64) } else { 1.0 }
}

/// The degrees of freedom of sums of squares, from their variation: ν = 2 m² / s².
fn freedom(sums: &[f64]) -> f64 {
    let m = mean(sums.iter().copied());
    let variance = sums.iter().map(|s| (s - m).powi(2)).sum::<f64>() / (sums.len() - 1) as f64;
    2.0 * m * m / variance
}

/// Rounds an amount up to few digits.
fn rounded_up(amount: f64) -> u64 {
    let digit = 10f64.powf((ROUNDED * amount).log10().floor()).max(1.0);
    ((amount / digit).ceil() * digit) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn freedom_is_that_of_the_spread() {
        assert!((freedom(&[1.0, 3.0, 1.0, 3.0]) - 2.0 * 4.0 / (4.0 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn work_is_as_much_as_the_room_asks_for() {
        let work = FieldWork {
            of: "photons",
            squared: 1000.0,
            chance: 1.2,
            ms: [5.0, 1e-3],
            given: None,
            most: 1_000_000,
            looks: 5,
        };
        // 1.44 × 1000 / 0.01 = 144000.
        assert_eq!(work.needed(0.01), Some(144_000));
        assert_eq!((work.needed(1e-4), work.needed(0.0), work.needed(-1.0)), (None, None, None));
        assert_eq!((rounded_up(123_456.0), rounded_up(99.2), rounded_up(3.0)), (124_000, 100, 3));
        assert_eq!((work.in_time(100.0), work.in_time(-1.0)), (100_000, 1));
        let given = FieldWork { given: Some(200_000), ..work };
        assert_eq!((given.needed(0.01), given.needed(0.001)), (Some(200_000), None));
    }
}
