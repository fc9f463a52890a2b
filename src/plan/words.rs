//! The words about a choice.

use super::choose::{AIM, Amount, Choice};
use super::pilot::Pilot;
use super::reply::{Considered, FieldAmount};

impl Choice<'_> {
    /// A considered setting with its reason. `needed` is the amount for the error asked for, or the amount that fits into the time if only
    /// that was asked for, and its time.
    pub(super) fn considered(&self, p: &Pilot, needed: Option<(Amount, f64)>) -> Considered {
        let (bias, target) = (p.bias + p.bias_within, self.target);
        let late = |ms: f64| target.time_ms.filter(|t| target.says_error && ms > *t);
        let why = match needed {
            Some((n, ms)) if late(ms).is_some() => format!("{n} would do, but in about {ms:.0} ms"),
            Some((n, _)) => format!("wrong by {} with {n}", percent(self.error(p, n))),
            None if bias >= AIM * target.error => {
                format!("wrong by up to {} however many samples it takes", percent(bias))
            }
            None => {
                let of_field = self.work.map_or(String::new(), |work| format!("{} or ", work.of));
                format!("more {of_field}samples than are permitted would be needed")
            }
        };
        Considered {
            words: p.setting.words.clone(),
            technique: p.setting.technique.into(),
            samples: needed.map(|e| e.0.samples),
            work: needed.and_then(|e| e.0.work),
            device_ms: needed.map(|e| e.1),
            error: needed.map(|(n, _)| self.error(p, n)),
            bias: Some(p.bias),
            enough: needed.is_some_and(|(_, ms)| late(ms).is_none()),
            why,
        }
    }

    pub(super) fn reason(&self, best: &Pilot, amount: Amount, [time, error]: [f64; 2], enough: bool) -> String {
        let (words, target) = (&best.setting.words, self.target);
        let [asked, error] = [target.error, error].map(percent);
        match (enough, target.time_ms) {
            (true, _) => {
                format!("{words}: the cheapest that is within {asked}: {amount}, about {time:.1} ms on the device")
            }
            (false, Some(t)) if target.says_error => {
                format!("nothing is within {asked} in {t} ms; {words} comes nearest: {amount}, about {error}")
            }
            (false, Some(t)) => format!("{words}: the most accurate in {t} ms: {amount}, about {error}"),
            (false, None) => {
                format!("nothing that is permitted is within {asked}; {words} comes nearest, with {error}")
            }
        }
    }
}

impl std::fmt::Display for Amount {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(FieldAmount { of, amount }) = self.work {
            write!(f, "{amount} {of}, ")?;
        }
        write!(f, "{} {}", self.samples, if self.samples == 1 { "sample" } else { "samples" })
    }
}

fn percent(v: f64) -> String {
    format!("{:.2} %", 100.0 * v)
}
