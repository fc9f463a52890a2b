//! The cheapest candidate that is enough, or the best that is in time.

use super::calibration::Calibration;
use super::noise::Places;
use super::pilot::Pilot;
use super::{Considered, Predicted, Wish};

/// What a plan aims at, of the error asked for: besides what chance does, estimates are off by a percent.
pub(super) const AIM: f64 = 0.99;
/// About nine of ten device times are within this factor of the predicted one.
const TIME_FACTOR: f64 = 1.5;
/// And errors.
const ERROR_FACTOR: f64 = 1.25;

/// What was chosen.
pub struct Chosen {
    /// The pilot's index.
    pub index: usize,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether it is enough for the error asked for.
    pub enough: bool,
    /// Predicted.
    pub device_ms: Predicted,
    /// Predicted.
    pub error: Predicted,
    /// Why.
    pub reasons: Vec<String>,
    /// All of them, in the order of the pilots.
    pub considered: Vec<Considered>,
}

impl Pilot {
    /// The square of the noise after `samples`, with as much of the random part as `by_chance`.
    fn squared_after(&self, samples: f64, places: &Places, by_chance: f64) -> f64 {
        places.squared_after(samples) + by_chance * by_chance * self.random / samples
    }

    /// The whole error after `samples`.
    pub fn error_after(&self, samples: f64, places: &Places) -> f64 {
        (self.squared_after(samples, places, 1.0) + self.bias * self.bias).sqrt()
    }

    /// The fewest samples after which the error is at most `error`; none where the bias is in the way.
    fn samples_for(&self, error: f64, places: &Places, most: u32) -> Option<u32> {
        let room = error * error - (self.bias + self.bias_within).powi(2);
        let enough = |n: u32| self.squared_after(f64::from(n), places, self.chance) <= room;
        // What was looked at need not fall everywhere; beyond it, it does.
        let last = places.last().min(most);
        let looked_at = (1..=last).find(|n| room > 0.0 && enough(*n));
        looked_at.or_else(|| {
            (room > 0.0 && enough(most)).then(|| {
                let (mut low, mut high) = (last, most);
                while high - low > 1 {
                    let middle = low + (high - low) / 2;
                    if enough(middle) { high = middle } else { low = middle }
                }
                high
            })
        })
    }
}

/// Chooses for a picture of `image` pixels of at most `most` samples.
pub fn choose(
    pilots: &[Pilot],
    places: &Places,
    wish: Wish,
    image: [u32; 2],
    calibration: &Calibration,
    most: u32,
) -> Chosen {
    let pixels = f64::from(image[0]) * f64::from(image[1]);
    let cost = |p: &Pilot, samples: u32| {
        let technique = &p.candidate.technique;
        let seen = |q: &&Pilot| q.whole.is_some() && q.candidate.technique == *technique;
        let [besides, sample] = match (p.whole, pilots.iter().find(seen)) {
            (Some(whole), _) => whole,
            // Of another setting of it the whole picture was begun: this one costs as much more there as in its pilot.
            (None, Some(Pilot { whole: Some(whole), ms_per_sample, .. })) if *ms_per_sample > 0.0 => {
                whole.map(|ms| ms * p.ms_per_sample / ms_per_sample)
            }
            _ => {
                let sample = p.ms_per_sample * pixels * calibration.factor(technique, pixels);
                [calibration.besides(technique) * sample, sample]
            }
        };
        besides + sample * f64::from(samples)
    };
    let in_time = |p: &Pilot| {
        let sample = cost(p, 1) - cost(p, 0);
        wish.time_ms.map(|t| (((t - cost(p, 0)) / sample).floor().max(1.0) as u32).min(most))
    };
    let for_error = |p: &Pilot| p.samples_for(AIM * wish.error, places, most);
    let fits = |p: &Pilot, n: u32| wish.time_ms.is_none_or(|t| cost(p, n) <= t);
    let plan_of = |p: &Pilot| for_error(p).filter(|n| fits(p, *n) && wish.says_error);
    let by_cost = |i: &usize| plan_of(&pilots[*i]).map_or(f64::INFINITY, |n| cost(&pilots[*i], n));
    let by_error = |i: &usize| {
        let p = &pilots[*i];
        in_time(p).map_or(p.bias, |n| p.error_after(f64::from(n), places) + p.bias_within)
    };
    let all = || 0..pilots.len();
    let enough = all().filter(|i| plan_of(&pilots[*i]).is_some()).min_by(|a, b| by_cost(a).total_cmp(&by_cost(b)));
    let index = enough.or_else(|| all().min_by(|a, b| by_error(a).total_cmp(&by_error(b)))).unwrap_or(0);
    let best = &pilots[index];
    let samples = plan_of(best).or_else(|| in_time(best)).unwrap_or(most);
    let n = f64::from(samples);
    let (time, error) = (cost(best, samples), best.error_after(n, places));
    let considered = pilots
        .iter()
        .map(|p| {
            let samples = if wish.says_error { for_error(p) } else { in_time(p) };
            considered(p, places, samples.map(|n| (n, cost(p, n))), wish)
        })
        .collect();
    Chosen {
        index,
        samples,
        enough: enough.is_some(),
        device_ms: Predicted { value: time, interval: [time / TIME_FACTOR, time * TIME_FACTOR] },
        error: Predicted { value: error, interval: [error / ERROR_FACTOR, (error + best.bias_within) * ERROR_FACTOR] },
        reasons: vec![reason(best, samples, time, error, enough.is_some(), wish)],
        considered,
    }
}

fn percent(v: f64) -> String {
    format!("{:.2} %", 100.0 * v)
}

/// `needed` are the samples for the error asked for, or that fit into the time where only that was asked for, and their time.
fn considered(p: &Pilot, places: &Places, needed: Option<(u32, f64)>, wish: Wish) -> Considered {
    let bias = p.bias + p.bias_within;
    let late = |ms: f64| wish.time_ms.filter(|t| wish.says_error && ms > *t);
    let why = match needed {
        Some((n, ms)) if late(ms).is_some() => format!("{n} samples would bring it there, but in about {ms:.0} ms"),
        Some((n, _)) => format!("{n} samples bring it to {}", percent(p.error_after(f64::from(n), places))),
        None if bias >= AIM * wish.error => format!("wrong by up to {} however many samples it takes", percent(bias)),
        None => "more samples than are permitted would be needed".into(),
    };
    Considered {
        words: p.candidate.words.clone(),
        technique: p.candidate.technique.clone(),
        samples: needed.map(|e| e.0),
        device_ms: needed.map(|e| e.1),
        error: needed.map(|(n, _)| p.error_after(f64::from(n), places)),
        bias: Some(p.bias),
        enough: needed.is_some_and(|(_, ms)| late(ms).is_none()),
        why,
    }
}

fn reason(best: &Pilot, samples: u32, time: f64, error: f64, enough: bool, wish: Wish) -> String {
    let words = &best.candidate.words;
    match (enough, wish.time_ms) {
        (true, _) => {
            format!(
                "{words}: the cheapest that is within {}: {samples} samples, about {time:.1} ms on the device",
                percent(wish.error)
            )
        }
        (false, Some(t)) if wish.says_error => format!(
            "nothing is within {} in {t} ms; {words} comes nearest: {samples} samples, about {}",
            percent(wish.error),
            percent(error)
        ),
        (false, Some(t)) => {
            format!("{words}: the most accurate in {t} ms: {samples} samples, about {}", percent(error))
        }
        (false, None) => format!(
            "nothing that is permitted is within {}; {words} comes nearest, with {}",
            percent(wish.error),
            percent(error)
        ),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::super::candidates::Candidate;
    use super::*;

    fn pilot(words: &str, noise_one: f64, bias: f64, ms: f64) -> Pilot {
        let candidate = Candidate {
            technique: "volume_path".into(),
            own: json!({}),
            lights: None,
            level: None,
            words: words.into(),
            unbiased: bias == 0.0,
            less: Vec::new(),
        };
        Pilot {
            candidate,
            random: noise_one * noise_one,
            chance: 1.0,
            bias,
            bias_within: 0.0,
            scale: 1.0,
            ms_per_sample: ms / 1e4,
            whole: None,
        }
    }

    fn chosen(pilots: &[Pilot], error: f64, time_ms: Option<f64>, says_error: bool) -> Chosen {
        choose(
            pilots,
            &Places::default(),
            Wish { error, time_ms, says_error },
            [100, 100],
            &Calibration::default(),
            1000,
        )
    }

    #[test]
    fn the_cheapest_that_is_enough_is_taken() {
        let pilots = [pilot("all", 1.0, 0.0, 10.0), pilot("some", 1.0, 0.05, 2.0), pilot("few", 1.0, 0.5, 1.0)];
        // 0.99 × 0.2 = 0.198: √(0.198² − 0.05²) = 0.1916, 28 samples of 2 ms.
        let loose = chosen(&pilots, 0.2, None, true);
        assert_eq!((loose.index, loose.samples), (1, 28));
        assert!((loose.device_ms.value - 56.0).abs() < 1e-9 && loose.error.value <= 0.198, "{:?}", loose.device_ms);
        // 0.0495 is less than the bias of 0.05: all paths are needed, 409 of them.
        let tight = chosen(&pilots, 0.05, None, true);
        assert_eq!((tight.index, tight.samples), (0, 409));
        assert!(tight.considered[1].why.contains("however many"), "{:?}", tight.considered[1]);
    }

    #[test]
    fn in_a_given_time_the_most_accurate_is_taken() {
        let pilots = [pilot("all", 1.0, 0.0, 10.0), pilot("some", 1.0, 0.05, 2.0)];
        let short = chosen(&pilots, 0.02, Some(100.0), false);
        assert_eq!((short.index, short.samples), (1, 50));
        let long = chosen(&pilots, 0.02, Some(8000.0), false);
        assert_eq!((long.index, long.samples), (0, 800));
        let both = chosen(&pilots, 0.02, Some(100.0), true);
        assert!(both.reasons[0].contains("nothing is within 2.00 % in 100 ms"), "{:?}", both.reasons);
    }
}
