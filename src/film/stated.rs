//! The statement of a picture's error. docs/error.md has the whole.

use serde::Serialize;

use super::Planned;

/// The least error that is stated, unless a lesser one is asked for or there is none at all. The bytes of a PNG round a mid grey by five times as much, and
/// a probe of some pixels is no proof of less.
pub const LEAST_STATED: f64 = 1e-3;

/// The estimated error of a picture: root mean square over its pixels of the error of linear luminance, divided by the picture's mean
/// luminance (absolute if that is 0). A part is null if it is not known, or not apart from the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct ErrorEstimate {
    /// An upper bound of the error of all parts together, which 95 of 100 pictures keep. It is null if a part is not known yet.
    pub total: Option<f64>,
    /// The standard error of the mean over the samples.
    pub noise: Option<f64>,
    /// An upper bound of what the step costs; with what is behind the ends of rays, if they end early.
    pub discretisation: Option<f64>,
    /// The loss of a picture of fewer pixels than asked for.
    pub resolution: Option<f64>,
    /// The contribution from behind the opacity at which rays end. It is null if a probe has measured it together with the step's.
    pub truncation: Option<f64>,
    /// The standard error by a field of random work: the change of the picture since the field had half of it. It is null if that is not known.
    pub field: Option<f64>,
    /// What the planner's choice leaves out of the scene that was asked for, if it chose.
    pub model: Option<f64>,
    /// The planner's upper bound of the error, if the picture is the planned one.
    pub planned: Option<f64>,
    /// Whose bound the total is.
    pub source: Source,
    /// The reason for which the total is not known.
    pub unknown: Option<Unknown>,
}

/// The reason for which an error is not known. It is served in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Unknown {
    /// A method whose bias is not measured.
    #[serde(rename = "the bias of fixed steps is not measured")]
    Bias,
    /// Random paths that have found nothing yet.
    #[serde(rename = "no path has found light yet, which does not say that there is none")]
    Nothing,
    /// Random paths of which too few have found light.
    #[serde(rename = "too few paths have found light to tell how much there is")]
    Few,
    /// Samples without a probe.
    #[serde(rename = "the picture's probe is not there yet")]
    Probe,
    /// A step without a probe, as a preview's, or a moving picture's before any other has shown what its step costs.
    #[serde(rename = "what the step costs is not known before the picture's probe")]
    Step,
    /// A field, before there is a picture of half its work.
    #[serde(rename = "there is no picture of half the field's work yet")]
    Field,
    /// A field under random paths, whose pictures differ by their own noise.
    #[serde(rename = "random paths hide what the field's own noise does to the picture")]
    Hidden,
}

/// What a stated error is founded on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The samples of the picture and of its probe.
    #[default]
    Picture,
    /// What the planner's pilots measured: references of many samples, and the picture's own settings beside them.
    Plan,
}

impl ErrorEstimate {
    /// All parts but the noise.
    pub fn bias(&self) -> f64 {
        [self.discretisation, self.resolution, self.truncation, self.field].into_iter().flatten().fold(0.0, f64::hypot)
    }

    /// The estimate with no smaller total than this, unless that is 0.
    pub(super) fn at_least(self, least: f64) -> Self {
        Self { total: self.total.map(|total| if total > 0.0 { total.max(least) } else { total }), ..self }
    }

    /// The estimate beside a planner's. Its own bound knows nothing of what the plan leaves out. Both bounds hold, so the lesser is the better founded.
    pub(super) fn beside(self, planned: Option<Planned>) -> Self {
        let Some(planned) = planned else { return self };
        let own = self.total.map(|total| total.hypot(planned.bias));
        let better = planned.bound.filter(|bound| own.is_none_or(|own| *bound < own));
        Self {
            total: better.or(own),
            model: Some(planned.bias),
            planned: planned.bound,
            source: if better.is_some() { Source::Plan } else { Source::Picture },
            unknown: self.unknown.filter(|_| better.is_none()),
            ..self
        }
    }
}
