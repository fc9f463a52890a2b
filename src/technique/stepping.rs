//! The planner's choices for views that sample along their rays: steps, and levels of the volume.

use std::sync::Arc;

use serde_json::{Value, json};

use super::view::{Open, Setting, Settings, View};

/// The steps that are tried, in sides of the smallest voxel, and the reference's step.
const STEPS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
const SHORTEST: f64 = 0.125;
/// The steps that are tried at a coarser level, in sides of its smallest voxel.
const COARSER_STEPS: [f64; 2] = [1.0, 2.0];

/// A way to make the picture, apart from its step.
pub(super) struct Way<P> {
    /// Its description, which follows the step's.
    pub words: &'static str,
    /// The parameter that it changes, in the form of a request.
    pub change: Option<(&'static str, Value)>,
    /// The parameters.
    pub parameters: P,
}

impl<P: Clone> Way<P> {
    /// The request's own parameters.
    pub fn as_given(parameters: &P) -> Self {
        Self { words: "", change: None, parameters: parameters.clone() }
    }
}

/// The settings of a view that samples along its rays: steps, at the volume's levels, in each of some `ways`. `with_step` gives a way's parameters a
/// step in sides of the smallest voxel. The reference is the way without steps, if there is one, or else the shortest step. `None` if the request
/// gives the step.
pub(super) fn stepping<P>(
    technique: &'static str,
    open: &Open<'_>,
    ways: &[Way<P>],
    without_steps: Option<Way<P>>,
    with_step: impl Fn(&P, f64) -> Arc<dyn View>,
) -> Option<Settings> {
    let as_given = &ways.first().filter(|_| open.leaves("step_voxels"))?.parameters;
    let of_step = |step: f64| vec![("step_voxels", json!(step))];
    let has_steps = without_steps.is_none();
    let mut all = vec![match without_steps {
        Some(Way { words, change, parameters }) => Setting {
            view: Some(with_step(&parameters, SHORTEST)),
            changes: change.into_iter().collect(),
            ..Setting::as_given(technique, format!("{technique}{words}"))
        },
        None => Setting {
            view: Some(with_step(as_given, SHORTEST)),
            changes: of_step(SHORTEST),
            ..Setting::as_given(technique, format!("{technique}, the shortest step"))
        },
    }];
    let coarser = open.levels.iter().map(|level| (Some(*level), &COARSER_STEPS[..]));
    let levels: Vec<_> = [(None, &STEPS[..])].into_iter().chain(coarser).collect();
    for (place, Way { words: way, change, parameters }) in ways.iter().enumerate() {
        let mut finer: Option<String> = None;
        for (level, steps) in &levels {
            // All that the next finer level leaves out with its shortest step is left out here as well.
            let (mut less, first) = (finer, all.len());
            for &step in *steps {
                let of_level = level.map_or(String::new(), |l| format!(" of level {l}"));
                let words = format!("{technique}, step of {step} voxels{of_level}{way}");
                all.push(Setting {
                    view: Some(with_step(parameters, step)),
                    changes: of_step(step).into_iter().chain(change.clone()).collect(),
                    level: *level,
                    unbiased: false,
                    longer: (has_steps && place == 0 && level.is_none()).then(|| step / SHORTEST),
                    less: less.replace(words.clone()).into_iter().collect(),
                    ..Setting::as_given(technique, words)
                });
            }
            finer = Some(all[first].words.clone());
        }
    }
    Some(Settings { all, ruled_out: Vec::new() })
}
