//! How many photons a picture needs of a field that is yet to be computed.
//!
//! What a picture I_N of N photons is wrong by is random in them, e² = F² / N. Fields with seeds of their own, some of N and one of 8 N
//! photons, tell F²: |I_N − I_8N|² = F² (1/N + 1/8N). Where the picture is not linear in the field, as where its colours follow the field's
//! range, it is wrong by more, and by what falls faster: that is in it too. The view's own random part is not: the square is the mean over
//! the pixels of d d′, of two seeds of the view. Often it is of a few bright pixels, as those of a beam, or of one number
//! that all colours follow: one field would tell little.

use std::sync::Arc;

use serde_json::{Value, json};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Planner;
use super::candidates::Candidate;
use super::found::Found;
use super::noise::in_common;
use super::pilot::{PIXELS, SAMPLES};
use super::run::{Asked, Run, mean, to_its_end};
use crate::error::{Error, Result};
use crate::film::Round;
use crate::job::PICTURES_ON_THE_WAY;
use crate::scene::region::Region;
use crate::technique::{self, Technique};
use crate::volume::Volume;

/// Photons of the first simulation, which tells how fast they are, and how long the second is to take, ms.
const FIRST: u64 = 20_000;
const PILOT_MS: f64 = 60.0;
/// How many of such fields there are, and how many times as many photons the last has.
const FIELDS: usize = 8;
const MANY: u64 = 8;
/// Digits of a planned number of photons are kept but for this part of it.
const ROUNDED: f64 = 0.01;
/// Of more pixels than these it does not matter how many there are.
const MOST_FREEDOM: f64 = 1e4;

/// A field as pilots see it.
pub struct Simulated {
    technique: &'static str,
    given: Option<u64>,
    most: u64,
    /// Photons of the small ones.
    few: u64,
    /// The large one, its photons, and what these took, ms.
    many: Arc<Volume>,
    photons: u64,
    ms: f64,
}

/// What is known of a field's photons.
#[derive(Debug, Clone, Copy)]
pub struct Photons {
    /// F², relative to the picture's mean, squared.
    pub squared: f64,
    /// How much more than F² / N says a picture may be wrong by chance.
    pub chance: f64,
    /// Device time besides them, and of one, ms.
    pub ms: [f64; 2],
    /// How many are asked for, where that is said.
    pub given: Option<u64>,
    /// How many are permitted.
    pub most: u64,
}

impl Simulated {
    /// Simulates a few photons, which tell how many the small fields may have, and the large one.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn of(planner: &Planner<'_>, body: &Value, reference: &Candidate) -> Result<Self> {
        let asked = |t: &Technique| Some((t.name, body.get("volume")?.get(t.name)?));
        let found = technique::fields().find_map(asked);
        let (technique, own) = found.ok_or_else(|| Error::internal("a field of no technique"))?;
        let (given, most) = (own.get("photons").and_then(Value::as_u64), planner.limits.max_photons);
        let request = reference.request(body);
        let first = FIRST.min(most);
        let (_, ms) = simulate(planner, &request, technique, [first, 1]).await?;
        let few = ((PILOT_MS * first as f64 / ms) as u64).clamp(first, (most / MANY).max(first));
        let photons = (MANY * few).min(most);
        let (many, ms) = simulate(planner, &request, technique, [photons, 2]).await?;
        Ok(Self { technique, given, most, few, many, photons, ms })
    }

    /// What pilots look at.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.many
    }

    /// Simulates the small fields, and sees what they do to the picture as the reference shows it.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn photons(&self, asked: Asked<'_>, found: &Found, pixels_per_voxel: f64) -> Result<Photons> {
        let (Some(pilot), Some(of_many)) = (found.pilots.first(), &found.reference) else {
            return Err(Error::internal("a field that no pilot looked at"));
        };
        let region = Region::some(PIXELS, [0, 0], asked.image);
        let [a, b] = last(of_many)?;
        let (mut apart, mut of_fields, mut ms) = (vec![0.0; of_many[0].pixels], Vec::new(), f64::INFINITY);
        let request = pilot.candidate.request(asked.body);
        for seed in 3..3 + FIELDS as u64 {
            // One at a time: they may be large.
            let (field, took) = simulate(asked.planner, &request, self.technique, [self.few, seed]).await?;
            let looking = Asked { field: Some(&field), ..asked };
            let [c, d] = last(&looking.run_two(&pilot.candidate, region, SAMPLES).await?)?;
            let products: Vec<f64> = in_common([&c, &a], [&d, &b]).collect();
            of_fields.push(mean(products.iter().copied()));
            apart.iter_mut().zip(products).for_each(|(sum, p)| *sum += p / FIELDS as f64);
            ms = ms.min(took);
        }
        let per_photon = 1.0 / self.few as f64 + 1.0 / self.photons as f64;
        let squared = mean(apart.iter().copied()).max(0.0) / pilot.scale.powi(2) / per_photon;
        // Pixels of one voxel are one.
        let alike = (pixels_per_voxel / f64::from(region.apart)).max(1.0).powi(2);
        Ok(Photons {
            squared,
            chance: by_chance((independent(&apart) / alike).min(freedom(&of_fields))),
            ms: self.line(ms),
            given: self.given,
            most: self.most,
        })
    }

    /// What the device takes besides the photons and for one of them, where the small fields take so long.
    fn line(&self, few_ms: f64) -> [f64; 2] {
        let each = self.ms / self.photons as f64;
        // What few of them take as long for as many is not their own time.
        let one = ((self.ms - few_ms) / (self.photons - self.few).max(1) as f64).clamp(0.5 * each, each);
        [self.ms - one * self.photons as f64, one]
    }

    /// The request with so many of them.
    pub fn with_photons(&self, request: &mut Value, photons: u64) {
        request["volume"][self.technique]["photons"] = json!(photons);
    }
}

/// What two runs came to.
fn last([a, b]: &[Run; 2]) -> Result<[Arc<Round>; 2]> {
    let rounds = a.rounds().last().cloned().zip(b.rounds().last().cloned());
    rounds.map(Into::into).ok_or_else(|| Error::internal("a pilot without rounds"))
}

/// The field of a request with so many photons, by a seed of its own, and their time on the device, ms.
async fn simulate(
    planner: &Planner<'_>,
    request: &Value,
    technique: &str,
    [photons, seed]: [u64; 2],
) -> Result<(Arc<Volume>, f64)> {
    let mut request = request.clone();
    let own = &mut request["volume"][technique];
    (own["photons"], own["seed"]) = (json!(photons), json!(own["seed"].as_u64().unwrap_or(0) ^ seed));
    request["budget"] = json!({"samples": 1});
    let scene = planner.scene(&request)?;
    let region = Region::some(1.0, [0, 0], scene.image());
    let job = to_its_end(planner, request, scene.into_pilot(region)).await?;
    let speed = job.resource().pointer("/result/photons_per_ms").and_then(Value::as_f64).unwrap_or(0.0);
    let field = job.field().ok_or_else(|| Error::internal("a pilot without its field"))?;
    Ok((field, photons as f64 / speed.max(f64::MIN_POSITIVE)))
}

impl Photons {
    /// The square of what they bring after so many, with as much as may be by chance.
    pub fn squared_after(&self, photons: u64, by_chance: f64) -> f64 {
        by_chance * by_chance * self.squared / photons as f64
    }

    /// The fewest that are wrong by no more than `room`, squared; none where that is more than are permitted, or than are asked for.
    pub fn needed(&self, room: f64) -> Option<u64> {
        let least = (self.squared_after(1, self.chance) / room).max(1.0);
        match self.given {
            Some(given) => (room > 0.0 && least <= given as f64).then_some(given),
            None => (room > 0.0 && least <= self.most as f64).then(|| rounded_up(least).min(self.most)),
        }
    }

    /// How many there is time for, besides what any number takes.
    pub fn in_time(&self, ms: f64) -> u64 {
        self.given.unwrap_or(((ms / self.ms[1]) as u64).clamp(1, self.most))
    }

    /// What they cost, with the pictures on the way.
    pub fn cost(&self, photons: u64, picture_ms: f64) -> f64 {
        self.ms[0] + self.ms[1] * photons as f64 + f64::from(PICTURES_ON_THE_WAY) * picture_ms
    }
}

/// Of how many pixels a sum of squares is, (Σ s)² / Σ s², where the square of one that is known by so many fields is too large by 1 + 2/k.
fn independent(squares: &[f64]) -> f64 {
    let (sum, of_squares) = squares.iter().fold((0.0, 0.0), |(sum, of_squares), s| (sum + s, of_squares + s * s));
    if of_squares > 0.0 { sum * sum / of_squares * (1.0 + 2.0 / FIELDS as f64) } else { 1.0 }
}

/// How free sums of squares are that vary so from one to the next: ν = 2 m² / s².
fn freedom(sums: &[f64]) -> f64 {
    let m = mean(sums.iter().copied());
    let variance = sums.iter().map(|s| (s - m).powi(2)).sum::<f64>() / (sums.len() - 1) as f64;
    2.0 * m * m / variance
}

/// What a picture may be wrong by over what pictures of all fields are, in 19 of 20: the square is a ratio of sums of ν squares and of
/// k ν, and that has Fisher's distribution.
fn by_chance(freedom: f64) -> f64 {
    let freedom = if freedom.is_finite() { freedom.clamp(1.0, MOST_FREEDOM) } else { MOST_FREEDOM };
    let ratio = FisherSnedecor::new(freedom, FIELDS as f64 * freedom);
    ratio.map_or(1.0, |ratio| ratio.inverse_cdf(0.95)).sqrt()
}

/// With few digits, and no less.
fn rounded_up(photons: f64) -> u64 {
    let digit = 10f64.powf((ROUNDED * photons).log10().floor()).max(1.0);
    ((photons / digit).ceil() * digit) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_that_of_tables() {
        // F of 1 and 8 degrees of freedom at 0.95 is 5.318, of 4 and 32 it is 2.668.
        assert!((by_chance(1.0).powi(2) - 5.318).abs() < 1e-3, "{}", by_chance(1.0).powi(2));
        assert!((by_chance(4.0).powi(2) - 2.668).abs() < 1e-3, "{}", by_chance(4.0).powi(2));
        assert!(by_chance(1e9) < 1.02 && by_chance(f64::NAN) < 1.02 && by_chance(0.0) == by_chance(1.0));
        assert!((freedom(&[1.0, 3.0, 1.0, 3.0]) - 2.0 * 4.0 / (4.0 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn photons_are_as_many_as_the_room_asks_for() {
        let photons = Photons { squared: 1000.0, chance: 1.2, ms: [5.0, 1e-3], given: None, most: 1_000_000 };
        // 1.44 × 1000 / 0.01 = 144000.
        assert_eq!(photons.needed(0.01), Some(144_000));
        assert_eq!((photons.needed(1e-4), photons.needed(0.0), photons.needed(-1.0)), (None, None, None));
        assert_eq!((rounded_up(123_456.0), rounded_up(99.2), rounded_up(3.0)), (124_000, 100, 3));
        assert_eq!((photons.in_time(100.0), photons.in_time(-1.0)), (100_000, 1));
        let given = Photons { given: Some(200_000), ..photons };
        assert_eq!((given.needed(0.01), given.needed(0.001)), (Some(200_000), None));
    }
}
