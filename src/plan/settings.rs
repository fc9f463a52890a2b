//! The settings that could do.

use serde_json::{Map, Value, json};

use super::Considered;
use super::candidates::{Candidate, Family, is_auto, lights};
use super::features::Features;
use crate::technique;
use crate::volume::MOST_LEVEL;

/// Steps that are tried, sides of the smallest voxel, and that of the reference.
const STEPS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
const SHORTEST: f64 = 0.125;
/// Those that are tried at a coarser level, sides of its smallest voxel, and how wide that may be on the picture, pixels.
const COARSER_STEPS: [f64; 2] = [1.0, 2.0];
const WIDEST_PIXELS: f64 = 2.0;
/// Scatterings that are tried after all of them.
const SCATTERINGS: [u32; 4] = [8, 4, 2, 1];
/// A bound that is off by as much rules a setting out: it is of a slab, and the scene is not that.
const SLACK: f64 = 3.0;
/// Lights that are tried without, at most.
const FAINTEST: usize = 3;

fn given(body: &Value, technique: &str) -> Map<String, Value> {
    body.get(technique).and_then(Value::as_object).cloned().unwrap_or_default()
}

/// The setting that stands for the truth of the others.
pub fn reference(body: &Value, family: Family) -> Candidate {
    match family {
        Family::Stepping(name) => shortest_step(body, name),
        Family::Scattering => every_path(body),
    }
}

/// The candidates, the first of which is the reference, and those that a bound rules out.
pub fn candidates(body: &Value, family: Family, features: &Features, error: f64) -> (Vec<Candidate>, Vec<Considered>) {
    match family {
        Family::Stepping(name) => (stepping(body, name, features), Vec::new()),
        Family::Scattering => scattering(body, features, error),
    }
}

/// The parameters that a stepping view leaves to the planner.
struct Open<'a> {
    own: Map<String, Value>,
    name: &'a str,
    schema: &'static Value,
}

impl<'a> Open<'a> {
    fn of(body: &Value, name: &'a str) -> Self {
        let schema = technique::find(name).map(|t| (t.schema)()).unwrap_or_default();
        Self { own: given(body, name), name, schema }
    }

    fn leaves(&self, field: &str) -> bool {
        self.schema["properties"].get(field).is_some() && !self.own.contains_key(field)
    }

    fn with(&self, more: &[(&str, Value)], words: String) -> Candidate {
        let mut own = self.own.clone();
        own.extend(more.iter().map(|(k, v)| ((*k).to_owned(), v.clone())));
        let (technique, own) = (self.name.into(), Value::Object(own));
        Candidate { technique, own, lights: None, level: None, words, unbiased: false, less: Vec::new() }
    }

    /// What else may be chosen beside the step.
    fn ways(&self, flat: bool) -> Vec<(&'static str, Option<(&'static str, Value)>)> {
        let mut ways = vec![("", None)];
        if self.leaves("pre_integrated") {
            ways.push((", pre-integrated", Some(("pre_integrated", json!(true)))));
        }
        // There is no gradient for shading to show.
        if flat && self.own.get("shading") == Some(&json!(true)) {
            ways.push((", unshaded", Some(("shading", json!(false)))));
        }
        ways
    }
}

/// What a stepping view is compared with.
fn shortest_step(body: &Value, name: &str) -> Candidate {
    let open = Open::of(body, name);
    let (more, words) = match open.leaves("step_voxels") {
        true => (vec![("step_voxels", json!(SHORTEST))], format!("{name}, the shortest step")),
        false => (Vec::new(), format!("{name} as it is given")),
    };
    Candidate { unbiased: true, ..open.with(&more, words) }
}

fn stepping(body: &Value, name: &str, features: &Features) -> Vec<Candidate> {
    let open = Open::of(body, name);
    let mut all = vec![shortest_step(body, name)];
    if !open.leaves("step_voxels") {
        return all;
    }
    for (way, more) in open.ways(features.homogeneous) {
        let mut finer: Option<String> = None;
        for (level, steps) in levels(body, features) {
            // What the next finer level leaves out with its shortest step, this one does.
            let (mut less, first) = (finer, all.len());
            for step in steps {
                let set: Vec<_> = [("step_voxels", json!(step))].into_iter().chain(more.clone()).collect();
                let of_level = level.map_or(String::new(), |l| format!(" of level {l}"));
                let words = format!("{name}, step of {step} voxels{of_level}{way}");
                let less = less.replace(words.clone()).into_iter().collect();
                all.push(Candidate { level, less, ..open.with(&set, words) });
            }
            finer = Some(all[first].words.clone());
        }
    }
    all
}

/// The levels that may stand for the volume, and the steps that are tried there: their voxels are hardly wider than a pixel.
fn levels(body: &Value, features: &Features) -> Vec<(Option<usize>, &'static [f64])> {
    let volume = body.get("volume").and_then(Value::as_object);
    let fixed = volume.is_some_and(|v| v.contains_key("level") || technique::fields().any(|t| v.contains_key(t.name)));
    let wide = |level: usize| features.pixels_per_voxel * (1u64 << level) as f64;
    let coarser = (1..=MOST_LEVEL).take_while(|l| !fixed && wide(*l) <= WIDEST_PIXELS);
    [(None, &STEPS[..])].into_iter().chain(coarser.map(|l| (Some(l), &COARSER_STEPS[..]))).collect()
}

/// What is given of either of the scattering views; named, a view has only its own.
fn scattering_own(body: &Value) -> Map<String, Value> {
    match body["technique"].as_str() {
        Some(name @ ("volume_path" | "single_scatter")) => given(body, name),
        _ => {
            let mut own = given(body, "volume_path");
            own.extend(given(body, "single_scatter"));
            own
        }
    }
}

/// All paths, or where single scattering is what is asked for, all that are scattered once.
fn every_path(body: &Value) -> Candidate {
    let own = Value::Object(scattering_own(body));
    match body["technique"].as_str() {
        Some("single_scatter") => Candidate {
            technique: "single_scatter".into(),
            own,
            lights: None,
            level: None,
            words: "single_scatter, as asked".into(),
            unbiased: true,
            less: Vec::new(),
        },
        _ => Candidate {
            technique: "volume_path".into(),
            own,
            lights: None,
            level: None,
            words: "volume_path, every scattering".into(),
            unbiased: true,
            less: Vec::new(),
        },
    }
}

fn scattering(body: &Value, features: &Features, error: f64) -> (Vec<Candidate>, Vec<Considered>) {
    let own = scattering_own(body);
    let of = |technique: &str, more: &[(&str, Value)], words: String, less: String| {
        let mut own = own.clone();
        own.extend(more.iter().map(|(k, v)| ((*k).to_owned(), v.clone())));
        let (technique, own) = (technique.into(), Value::Object(own));
        Candidate { technique, own, lights: None, level: None, words, unbiased: false, less: vec![less] }
    };
    let mut all = vec![every_path(body)];
    let mut ruled_out = Vec::new();
    let free = is_auto(body) && !own.contains_key("max_scatterings") && features.albedo != Some(0.0);
    let mut more = all[0].words.clone();
    for scatterings in SCATTERINGS.into_iter().filter(|_| free) {
        let bound = features.missing(scatterings);
        let (technique, words) = match scatterings {
            1 => ("single_scatter", "single_scatter".to_owned()),
            n => ("volume_path", format!("volume_path, at most {n} scatterings")),
        };
        let limit = [("max_scatterings", json!(scatterings))];
        let limit = if scatterings == 1 { &[][..] } else { &limit[..] };
        let candidate = of(technique, limit, words.clone(), std::mem::replace(&mut more, words));
        if bound > SLACK * error {
            let why = format!("a slab as deep as this would lack {:.1} % of what it sends back", 100.0 * bound);
            ruled_out.push(Considered { bias: Some(bound), ..candidate.skipped(why) });
        } else {
            all.push(candidate);
        }
    }
    let faintest = features.faintest_lights();
    if let Some(given) = lights(&all[0].request(body)).filter(|_| is_auto(body)) {
        let sets = (1..=faintest.len().min(FAINTEST)).map(|n| &faintest[..n]);
        let fewer: Vec<Candidate> = sets.flat_map(|set| all.iter().map(|c| c.without(given, set))).collect();
        all.extend(fewer);
    }
    (all, ruled_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_are_left_out_where_they_were_given() {
        let three = json!([{"type": "sun"}, {"type": "point"}, {"type": "sky"}]);
        let two = json!([{"type": "sun"}, {"type": "sky"}]);
        let beside = json!({"technique": "auto", "lights": three});
        let own = json!({"technique": "auto", "volume_path": {"lights": three}});
        for body in [&beside, &own] {
            let all = every_path(body);
            let fewer = all.without(lights(&all.request(body)).unwrap_or(&Value::Null), &[1]);
            let request = fewer.request(body);
            assert_eq!(lights(&request), Some(&two), "{request}");
            assert_eq!(request.get("lights").is_some(), body.get("lights").is_some(), "{request}");
            assert!(!fewer.unbiased && fewer.words.ends_with("without the faintest light"));
        }
    }
}
