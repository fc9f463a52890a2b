//! The choice of the cheapest candidate that is enough, or of the best that is in time.

use super::calibration::Calibration;
use super::cost::Cost;
use super::field_work::FieldWork;
use super::noise::{Places, SMALL};
use super::pilot::Pilot;
use super::reply::{Considered, FieldAmount, Predicted};
use super::target::Target;

/// The part of the error asked for that a plan aims at. Besides chance, estimates are off by a few percent.
pub(super) const AIM: f64 = 0.97;
/// About nine of ten device times are within this factor of the predicted one.
const TIME_FACTOR: f64 = 1.5;
/// About nine of ten errors are within this factor of the predicted one.
const ERROR_FACTOR: f64 = 1.25;
/// The number of ways to split the error or the time between a view and its field that are tried.
const PARTS: u32 = 40;

/// The chosen setting, with its prediction.
pub struct Chosen {
    /// The pilot's index.
    pub index: usize,
    /// The amount of the setting.
    pub amount: Amount,
    /// True if it is enough for the error asked for.
    pub enough: bool,
    /// The predicted device time, ms.
    pub device_ms: Predicted,
    /// The predicted error, relative.
    pub error: Predicted,
    /// The reasons in words.
    pub reasons: Vec<String>,
    /// All settings, in the order of the pilots.
    pub considered: Vec<Considered>,
}

/// The amount of a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Amount {
    /// Samples per pixel.
    pub samples: u32,
    /// The work of a field, if one is to be computed first.
    pub work: Option<FieldAmount>,
}

/// The candidates of a choice, and its target.
pub struct Choice<'a> {
    /// The settings.
    pub pilots: &'a [Pilot],
    /// The error of the sample places in a pixel.
    pub places: &'a Places,
    /// The error or the time that is asked for.
    pub target: Target,
    /// The sides of the picture.
    pub image: [u32; 2],
    /// The calibration of the device.
    pub calibration: &'a Calibration,
    /// The most samples that are permitted.
    pub most: u32,
    /// The work of a field, if the scene looks at one.
    pub work: Option<&'a FieldWork>,
}

impl Choice<'_> {
    /// The cost of a setting's picture.
    fn picture(&self, p: &Pilot) -> Cost {
        let technique = p.setting.technique;
        let seen = |q: &&Pilot| q.whole.is_some() && q.setting.technique == technique;
        match (p.whole, self.pilots.iter().find(seen)) {
            (Some(whole), _) => whole,
            // The whole picture was begun with another setting of this technique. This setting costs as much more there as in its pilot.
            (None, Some(Pilot { whole: Some(whole), ms_per_sample, .. })) if *ms_per_sample > 0.0 => {
                whole.times(p.ms_per_sample / ms_per_sample)
            }
            _ => {
                let pixels = f64::from(self.image[0]) * f64::from(self.image[1]);
                let sample = p.ms_per_sample * pixels * self.calibration.factor(technique, pixels);
                Cost { besides: self.calibration.besides(technique) * sample, sample, ..Cost::default() }
            }
        }
    }

    /// The device time of an amount, ms.
    pub(super) fn cost(&self, p: &Pilot, amount: Amount) -> f64 {
        let picture = self.picture(p);
        let field = self.work.zip(amount.work).map_or(0.0, |(work, n)| work.cost(n.amount, picture.of(1)));
        field + picture.of(amount.samples)
    }

    pub(super) fn error(&self, p: &Pilot, amount: Amount) -> f64 {
        let of_field = self.work.zip(amount.work).map_or(0.0, |(work, n)| work.squared_after(n.amount, 1.0));
        (p.error_after(f64::from(amount.samples), self.places).powi(2) + of_field).sqrt()
    }

    /// The cheapest amount whose error is at most the one asked for.
    fn for_error(&self, p: &Pilot) -> Option<Amount> {
        let error = AIM * self.target.error;
        let samples = |error: f64| p.samples_for(error, self.places, self.most);
        let Some(work) = self.work else {
            return samples(error).map(|samples| Amount { samples, work: None });
        };
        let split = |part: f64| {
            let samples = samples(part.sqrt() * error)?;
            let view = p.squared_after(f64::from(samples), self.places, p.chance) + (p.bias + p.bias_within).powi(2);
            let needed = work.needed(error * error - view)?;
            Some(Amount { samples, work: Some(work.of(needed)) })
        };
        parts().filter_map(split).min_by(|a, b| self.cost(p, *a).total_cmp(&self.cost(p, *b)))
    }

    /// The best amount that there is time for, if a time is asked for.
    fn in_time(&self, p: &Pilot) -> Option<Amount> {
        let picture = self.picture(p);
        let samples = |ms: f64| picture.samples_in(ms).min(self.most);
        let time = self.target.time_ms?;
        let Some(work) = self.work else { return Some(Amount { samples: samples(time), work: None }) };
        let left = time - work.cost(0, picture.of(1));
        let split = |part: f64| {
            let n = work.in_time((1.0 - part) * left);
            Amount { samples: samples(time - work.cost(n, picture.of(1))), work: Some(work.of(n)) }
        };
        parts().map(split).min_by(|a, b| self.error(p, *a).total_cmp(&self.error(p, *b)))
    }

    /// The amount at which a setting comes nearest. The view's error need not be any smaller beside its field's.
    fn nearest(&self, p: &Pilot) -> Amount {
        let Some(work) = self.work else { return Amount { samples: self.most, work: None } };
        let n = work.given.unwrap_or(work.most);
        let room = SMALL * work.squared_after(n, 1.0);
        let enough = |samples: &u32| p.squared_after(f64::from(*samples), self.places, 1.0) <= room;
        let samples = (0..31).map(|power| 1 << power).take_while(|n| *n < self.most).find(enough);
        Amount { samples: samples.unwrap_or(self.most), work: Some(work.of(n)) }
    }

    /// Chooses a setting and its amount.
    pub fn choose(&self) -> Chosen {
        let Self { pilots, target, .. } = *self;
        let for_error: Vec<Option<Amount>> = pilots.iter().map(|p| self.for_error(p)).collect();
        let in_time = |p: &Pilot, n: &Amount| target.time_ms.is_none_or(|t| self.cost(p, *n) <= t);
        let each = || pilots.iter().zip(&for_error).enumerate();
        let enough = least(each().filter_map(|(i, (p, n))| {
            let n = n.filter(|n| target.says_error && in_time(p, n))?;
            Some((i, n, self.cost(p, n)))
        }));
        let nearest = || {
            least(each().map(|(i, (p, _))| {
                let n = self.in_time(p).unwrap_or_else(|| self.nearest(p));
                (i, n, self.error(p, n) + p.bias_within)
            }))
        };
        let none = (0, Amount { samples: self.most, work: None });
        let (index, amount) = enough.or_else(nearest).unwrap_or(none);
        let best = &pilots[index];
        let (time, error) = (self.cost(best, amount), self.error(best, amount));
        let considered = pilots.iter().zip(&for_error).map(|(p, for_error)| {
            let amount = if target.says_error { *for_error } else { self.in_time(p) };
            self.considered(p, amount.map(|n| (n, self.cost(p, n))))
        });
        Chosen {
            index,
            amount,
            enough: enough.is_some(),
            device_ms: Predicted { value: time, interval: [time / TIME_FACTOR, time * TIME_FACTOR] },
            error: Predicted {
                value: error,
                interval: [error / ERROR_FACTOR, (error + best.bias_within) * ERROR_FACTOR],
            },
            reasons: vec![self.reason(best, amount, [time, error], enough.is_some())],
            considered: considered.collect(),
        }
    }
}

/// The setting and its amount with the least value.
fn least(all: impl Iterator<Item = (usize, Amount, f64)>) -> Option<(usize, Amount)> {
    all.min_by(|a, b| a.2.total_cmp(&b.2)).map(|(i, n, _)| (i, n))
}

/// The tried parts of a squared error, or of a time, that a view may have; the rest is its field's.
fn parts() -> impl Iterator<Item = f64> {
    (0..=PARTS).map(|i| 0.5 - 0.49 * (std::f64::consts::PI * f64::from(i) / f64::from(PARTS)).cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::technique::Setting;

    fn pilot(words: &str, noise_one: f64, bias: f64, ms: f64) -> Pilot {
        let unbiased = bias == 0.0;
        let setting = Setting { unbiased, ..Setting::as_given("volume_path", words.into()) };
        Pilot {
            setting,
            random: noise_one * noise_one,
            chance: 1.0,
            bias,
            bias_within: 0.0,
            scale: 1.0,
            ms_per_sample: ms / 1e4,
            whole: None,
        }
    }

    fn target(error: f64, time_ms: Option<f64>) -> Target {
        Target { error, time_ms, says_error: true }
    }

    fn chosen(pilots: &[Pilot], target: Target, work: Option<&FieldWork>) -> Chosen {
        let (places, calibration) = (&Places::default(), &Calibration::default());
        Choice { pilots, places, target, image: [100, 100], calibration, most: 1000, work }.choose()
    }

    #[test]
    fn the_cheapest_that_is_enough_is_taken() {
        let pilots = [pilot("all", 1.0, 0.0, 10.0), pilot("some", 1.0, 0.05, 2.0), pilot("few", 1.0, 0.5, 1.0)];
        // 0.97 × 0.2 = 0.194: √(0.194² − 0.05²) = 0.1874, 29 samples of 2 ms.
        let loose = chosen(&pilots, target(0.2, None), None);
        assert_eq!((loose.index, loose.amount.samples), (1, 29));
        assert!((loose.device_ms.value - 58.0).abs() < 1e-9 && loose.error.value <= 0.194, "{:?}", loose.device_ms);
        // 0.0485 is less than the bias of 0.05: all paths are needed, 426 of them.
        let tight = chosen(&pilots, target(0.05, None), None);
        assert_eq!((tight.index, tight.amount.samples), (0, 426));
        assert!(tight.considered[1].why.contains("however many"), "{:?}", tight.considered[1]);
    }

    #[test]
    fn in_a_given_time_the_most_accurate_is_taken() {
        let pilots = [pilot("all", 1.0, 0.0, 10.0), pilot("some", 1.0, 0.05, 2.0)];
        let short = chosen(&pilots, Target { says_error: false, ..target(0.02, Some(100.0)) }, None);
        assert_eq!((short.index, short.amount.samples), (1, 50));
        let long = chosen(&pilots, Target { says_error: false, ..target(0.02, Some(8000.0)) }, None);
        assert_eq!((long.index, long.amount.samples), (0, 800));
        let both = chosen(&pilots, target(0.02, Some(100.0)), None);
        assert!(both.reasons[0].contains("nothing is within 2.00 % in 100 ms"), "{:?}", both.reasons);
    }

    #[test]
    fn work_and_samples_share_an_error_and_a_time() {
        let pilots = [pilot("all", 1.0, 0.0, 1.0)];
        let work = FieldWork {
            of: "photons",
            squared: 1000.0,
            chance: 1.0,
            ms: [0.0, 1e-3],
            given: None,
            most: u64::MAX,
            looks: 5,
        };
        // 0.097² = 1/n + 1000/N costs n + N/1000 + 5, the least where n = N/1000: 213 of each.
        let error = chosen(&pilots, target(0.1, None), Some(&work));
        let n = error.amount.work.map_or(0, |w| w.amount);
        assert!((203..=223).contains(&error.amount.samples) && (203_000..=223_000).contains(&n), "{:?}", error.amount);
        assert!(error.enough && error.error.value <= 0.097 && error.device_ms.value < 436.0, "{:?}", error.device_ms);
        // The rest of 205 ms after the pictures on the way is split in halves.
        let time = chosen(&pilots, Target { says_error: false, ..target(0.1, Some(205.0)) }, Some(&work));
        assert!((95..=105).contains(&time.amount.samples) && time.device_ms.value <= 205.0, "{:?}", time.amount);
        // With too few photons no sample helps. There are enough samples to be small beside them.
        let given = FieldWork { given: Some(1000), ..work };
        let few = chosen(&pilots, target(0.1, None), Some(&given));
        assert_eq!(
            (few.enough, few.amount),
            (false, Amount { samples: 16, work: Some(work.of(1000)) }),
            "{:?}",
            few.reasons
        );
    }
}
