//! The findings of the pilots, and a closer look at them if it may decide.

use super::cost::Cost;
use super::noise::{Places, SMALL, random};
use super::pilot::{PIXELS, Pilot, SAMPLES, chance, deviation, lasting};
use super::reply::Considered;
use super::run::{Asked, Run};
use super::whole::WholePicture;
use crate::error::{Error, Result};
use crate::film::CLOSELY;
use crate::render::region::Region;
use crate::technique::Setting;

/// The samples of a deeper look, as multiples: of those that are likely to be planned, the same if others judge it, and at most of those of the look
/// before.
const DEEPER: u32 = 8;
const DEEPER_JUDGED: u32 = 4;
const MUCH_DEEPER: u32 = 16;
/// The samples of the whole picture with the chosen setting that confirm it, and the samples if one takes long.
const CONFIRMED: [u32; 2] = [4, 2];
/// A sample that takes longer than this, ms, takes long. A picture whose first sample takes less is timed once more.
const SHORT: f64 = 20.0;
/// The cost of a probe that looks closely, as a multiple of one that does not, of a picture whose samples take long.
const MORE_CLOSELY: f64 = 4.0;
/// With fewer pixels that matter than this, a pilot does not tell the error of the places in the picture.
const FEW: f64 = 200.0;
/// A pilot does not tell it either if the first samples of the whole picture have an error of the places, squared, that is larger or
/// smaller by this factor.
const UNLIKE: f64 = 1.5;
/// The number of deviations by which that error must exceed chance, besides being large enough to matter.
const SURE: f64 = 4.0;
/// The findings of the pilots.
#[derive(Default)]
pub struct Found {
    /// The pilots that were run, the reference first.
    pub pilots: Vec<Pilot>,
    /// The reference's runs, by two seeds.
    pub reference: Option<[Run; 2]>,
    /// The error of the places in a pixel, from all looks.
    pub places: Places,
    /// The error of the places over the whole picture, as pilots saw it.
    pub everywhere: Places,
    /// The part of the reference's pixels that are opaque.
    pub opaque: f64,
    /// The number of pixels of the reference's pilot that matter.
    pub matter: f64,
    /// The region of most of the places' error, if that is a small part of the picture, and the factor from a mean of squares there to one
    /// over the picture.
    pub part: Option<(Region, f64)>,
    /// The settings that were not run, since one that leaves out less leaves out too much.
    pub skipped: Vec<Considered>,
}

impl Found {
    /// Runs a pilot of each setting; the first setting is the reference. A setting is not run if it leaves out more than one that leaves
    /// out too much for `most`.
    ///
    /// # Errors
    /// Those of the requests.
    pub async fn of(asked: Asked<'_>, settings: &[Setting], most: f64) -> Result<Self> {
        let region = Region::some(PIXELS, [0, 0], asked.image());
        let mut found = Self::default();
        let mut too_much: Vec<&str> = Vec::new();
        for setting in settings {
            if let Some(less) = setting.less.iter().find(|less| too_much.contains(&less.as_str())) {
                too_much.push(&setting.words);
                found
                    .skipped
                    .push(Considered::skipped(setting, format!("{less} leaves out less, and that is too much")));
                continue;
            }
            let runs = asked.run_two(setting, region, SAMPLES).await?;
            let scale = found.pilots.first().map_or_else(|| runs[0].scale(), |reference| reference.scale);
            let (bias, bias_within) = match &found.reference {
                Some([a, b]) if !setting.unbiased => {
                    let apart = |run: &Run, other: &Run, i: usize| (run.luminance(i) - other.luminance(i)) / scale;
                    lasting((0..a.pixels).map(|i| apart(&runs[0], a, i) * apart(&runs[1], b, i)).collect())
                }
                _ => (0.0, 0.0),
            };
            if bias - bias_within > most {
                too_much.push(&setting.words);
            }
            let [a, b] = [runs[0].rounds(), runs[1].rounds()];
            let (random, seen) = random(a, b, scale);
            if found.reference.is_none() {
                found.matter = runs[0].film.random_noise().1;
                found.places = Places::by_two(a, b, scale, deviation(found.matter));
                found.everywhere = found.places.clone();
                found.opaque = runs[0].opaque();
            }
            found.pilots.push(Pilot {
                setting: setting.clone(),
                random,
                // The picture has more pixels, of the same kinds.
                chance: chance(seen * f64::from(region.stride).powi(2), seen * a.len() as f64),
                bias,
                bias_within,
                scale,
                ms_per_sample: runs[0].ms[1].min(runs[1].ms[1]) / runs[0].pixels as f64,
                whole: None,
            });
            found.reference.get_or_insert(runs);
        }
        found.add_the_reference_own();
        if found.pilots.is_empty() { Err(Error::internal("no setting is possible")) } else { Ok(found) }
    }

    /// Adds to each bias what the reference's own step costs. Let D(h) be the difference between a step of h and the reference's. A method of first order
    /// has D(2h) = I(h) − I(0) and D(4h) = 3 D(2h); one of second order has a third of that, and D(4h) = 5 D(2h).
    fn add_the_reference_own(&mut self) {
        let of = |longer: f64| self.pilots.iter().find(|p| p.setting.longer == Some(longer)).map(|p| p.bias);
        let Some(twice) = of(2.0).filter(|twice| *twice > 0.0) else { return };
        let second = of(4.0).map_or(0.0, |four| ((four / twice - 3.0) / 2.0).clamp(0.0, 1.0));
        let own = twice * (1.0 - second * 2.0 / 3.0);
        self.pilots.iter_mut().for_each(|pilot| pilot.bias += own);
    }

    /// Looks at the places in the region that has most of their error.
    async fn look_at_part(&mut self, asked: Asked<'_>, setting: &Setting, samples: u32, scale: f64) -> Result<()> {
        let Some((region, part)) = self.part else { return Ok(()) };
        let (runs, scale) = (asked.run_two(setting, region, samples).await?, scale / part.sqrt());
        let within = deviation(runs[0].film.random_noise().1);
        self.places = Places::by_two(runs[0].rounds(), runs[1].rounds(), scale, within);
        if asked.is_judged(setting) {
            self.judge(asked, setting, region, &runs, [0.0, scale]).await?;
        }
        // Few samples that are good there may be bad elsewhere, as along an edge of another direction.
        self.places.at_least(&self.everywhere);
        Ok(())
    }

    /// Has two runs of a region judged by two others with places of their own. J² and what it is relative to are given.
    async fn judge(
        &mut self,
        asked: Asked<'_>,
        setting: &Setting,
        region: Region,
        [a, b]: &[Run; 2],
        [random, scale]: [f64; 2],
    ) -> Result<()> {
        let judges = asked.run_judges(setting, region, a.film.main.count).await?;
        self.places.judge([a.rounds(), b.rounds()], judges.each_ref().map(|j| &**j), random, scale);
        Ok(())
    }

    /// Measures the error of the places after `samples` of a pilot's setting that are likely to be planned, unless that is known.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn deepen(&mut self, asked: Asked<'_>, index: usize, samples: u32) -> Result<bool> {
        let Pilot { setting, random, scale, .. } = self.pilots[index].clone();
        let is_judged = asked.is_judged(&setting);
        let most = asked.planner.limits.max_samples;
        let deeper = samples * if is_judged { DEEPER_JUDGED } else { DEEPER };
        let deep = deeper.min(MUCH_DEEPER * self.places.last()).min(most);
        if self.places.is_known(samples, random) || deep < SAMPLES {
            return Ok(false);
        }
        let region = Region::some(PIXELS, [0, 0], asked.image());
        if self.part.is_some() {
            self.look_at_part(asked, &setting, deep, scale).await?;
        } else if is_judged {
            let runs = asked.run_two(&setting, region, deep).await?;
            self.judge(asked, &setting, region, &runs, [random, scale]).await?;
            self.everywhere = self.places.clone();
        } else {
            let run = asked.run(&setting, region, deep, 1).await?;
            self.places.look_deeper(run.rounds(), scale, random);
        }
        Ok(true)
    }

    /// Runs the first samples of the whole picture with the setting that is likely to be chosen, unless they are there. They tell its time
    /// and its random part. A pilot may have seen more or less of the random part than there is, and so may the others.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn confirm(&mut self, asked: Asked<'_>, index: usize) -> Result<bool> {
        let Pilot { setting, ms_per_sample, whole: None, .. } = self.pilots[index].clone() else { return Ok(false) };
        let sample = ms_per_sample * f64::from(asked.image()[0]) * f64::from(asked.image()[1]);
        let samples = CONFIRMED[usize::from(sample > SHORT)];
        let runs = [asked.run_whole(&setting, samples, 1).await?, asked.run_whole(&setting, samples, 2).await?];
        let mut ms = [0, 1].map(|i| runs[0].ms[i].min(runs[1].ms[i]));
        let probe = runs[0].probe_ms.min(runs[1].probe_ms);
        let mut probe = if samples < CLOSELY { [probe, MORE_CLOSELY * probe] } else { [probe / MORE_CLOSELY, probe] };
        if ms[0] + ms[1] < SHORT {
            let again = asked.run_whole(&setting, samples, 1).await?;
            ms = [0, 1].map(|i| ms[i].min(again.ms[i]));
            probe = [asked.run_whole(&setting, 1, 1).await?.probe_ms, probe[1].min(again.probe_ms)];
        }
        // The picture may have millions of pixels: the runtime's other work goes on meanwhile.
        let seen = tokio::task::block_in_place(|| WholePicture::of(&runs, asked.image()));
        let more = if self.pilots[index].random > 0.0 { seen.random / self.pilots[index].random } else { 1.0 };
        self.pilots.iter_mut().filter(|p| p.whole.is_none()).for_each(|p| p.random *= more);
        let pilot = &mut self.pilots[index];
        (pilot.random, pilot.whole) = (seen.random, Some(Cost { besides: ms[0], sample: ms[1], probe }));
        pilot.chance = chance(seen.matter, seen.matter * f64::from(samples));
        self.look_closer(asked, &setting, &seen).await?;
        Ok(true)
    }

    /// Looks closer if few pixels matter, as those around a lamp that is seen. A pilot has too few of them or none. The first samples of
    /// the whole picture tell the error of the places and its region.
    async fn look_closer(&mut self, asked: Asked<'_>, setting: &Setting, seen: &WholePicture) -> Result<()> {
        let by_chance = seen.random / f64::from(asked.image()[0]).sqrt() / f64::from(asked.image()[1]).sqrt();
        // A pilot that has all of the pixels has seen the error.
        let all = Region::some(PIXELS, [0, 0], asked.image()).stride == 1;
        if all || self.part.is_some() || seen.missed <= (SURE * by_chance).max(SMALL * seen.random) {
            return Ok(());
        }
        let more = self.places.more_by(seen.samples, seen.missed);
        let differs = self.matter < FEW || !(1.0 / UNLIKE..UNLIKE).contains(&more);
        if more.is_finite() && (differs || seen.samples == CONFIRMED[0]) {
            self.places.scale(more, seen.within);
        }
        if let Some((region, share)) = seen.around.filter(|_| differs) {
            let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
            self.part = Some((region, pixels(region.size) / pixels(asked.image()) / share));
            self.look_at_part(asked, setting, SAMPLES, seen.scale).await?;
        }
        Ok(())
    }
}
