//! The settings that could do.

use serde_json::{Map, Value, json};

use super::Considered;
use super::features::Features;
use crate::scene::AUTO;
use crate::technique;

/// Steps that are tried, sides of the smallest voxel, and that of the reference.
const STEPS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
const SHORTEST: f64 = 0.125;
/// Scatterings that are tried after all of them.
const SCATTERINGS: [u32; 4] = [8, 4, 2, 1];
/// A bound that is off by as much rules a setting out: it is of a slab, and the scene is not that.
const SLACK: f64 = 3.0;
/// Lights that are tried without, at most.
const FAINTEST: usize = 3;

/// Whether a request leaves the technique to the planner.
pub fn is_auto(body: &Value) -> bool {
    body["technique"] == AUTO
}

/// Settings of which one stands for the truth of the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Views that sample along a ray: the truth is a short step.
    Stepping(&'static str),
    /// Views that scatter light: the truth is all of its paths.
    Scattering,
}

impl Family {
    /// The family that a request is of: its technique's, or that of what it says of the scene.
    pub fn of(body: &Value) -> Self {
        let named = |name: &str| match name {
            "volume_path" | "single_scatter" => Some(Self::Scattering),
            name => technique::views().find(|t| t.name == name).map(|t| Self::Stepping(t.name)),
        };
        let given = || technique::views().find(|t| body.get(t.name).is_some()).and_then(|t| named(t.name));
        let scatters = body.get("medium").is_some() || body.get("lights").is_some();
        let named = body["technique"].as_str().and_then(named);
        named
            .or_else(|| scatters.then_some(Self::Scattering))
            .or_else(given)
            .unwrap_or(Self::Stepping("emission_absorption"))
    }

    /// The technique that a request of the family is checked as.
    pub fn technique(self) -> &'static str {
        match self {
            Self::Stepping(name) => name,
            Self::Scattering => "volume_path",
        }
    }
}

/// A technique with its own parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The technique.
    pub technique: String,
    /// Its own parameters.
    pub own: Value,
    /// The lights that it has, where they are not all that are given.
    pub lights: Option<Value>,
    /// What it is, in words.
    pub words: String,
    /// Whether more samples take all of its error away.
    pub unbiased: bool,
    /// The words of those that leave out less: where one of them leaves out too much, so does this.
    pub less: Vec<String>,
}

impl Candidate {
    /// The request with this setting in it.
    pub fn request(&self, body: &Value) -> Value {
        let mut request = with_technique(body, &self.technique);
        for technique in technique::views() {
            if let Some(object) = request.as_object_mut() {
                object.remove(technique.name);
            }
        }
        request[self.technique.as_str()] = self.own.clone();
        if let (Some(fewer), Some(lights)) = (&self.lights, lights_mut(&mut request)) {
            *lights = fewer.clone();
        }
        request
    }

    /// The same without the faintest of the lights; the one before is without one of these fewer.
    fn without(&self, given: &Value, faintest: &[usize]) -> Self {
        let all = given.as_array().cloned().unwrap_or_default();
        let kept = all.into_iter().enumerate().filter(|(i, _)| !faintest.contains(i)).map(|(_, light)| light);
        let without = |words: &str, n: usize| match n {
            0 => words.to_owned(),
            1 => format!("{words}, without the faintest light"),
            n => format!("{words}, without the {n} faintest lights"),
        };
        let n = faintest.len();
        let less = self.less.iter().map(|less| without(less, n)).chain([without(&self.words, n - 1)]).collect();
        Self { lights: Some(kept.collect()), words: without(&self.words, n), unbiased: false, less, ..self.clone() }
    }

    /// What a plan says of it where it was not tried.
    pub fn skipped(&self, why: String) -> Considered {
        Considered {
            words: self.words.clone(),
            technique: self.technique.clone(),
            samples: None,
            device_ms: None,
            error: None,
            bias: None,
            enough: false,
            why,
        }
    }
}

/// The lights of a request of a scattering view, where they are given: beside the volume, or among its own parameters.
pub fn lights(request: &Value) -> Option<&Value> {
    let own = || request.get(request["technique"].as_str()?)?.get("lights");
    request.get("lights").or_else(own)
}

fn lights_mut(request: &mut Value) -> Option<&mut Value> {
    let technique = request["technique"].as_str()?.to_owned();
    if request.get("lights").is_some() {
        request.get_mut("lights")
    } else {
        request.get_mut(technique)?.get_mut("lights")
    }
}

/// The body with another technique.
pub fn with_technique(body: &Value, technique: &str) -> Value {
    let mut request = body.clone();
    request["technique"] = json!(technique);
    request
}

/// The setting that stands for the truth of the others.
pub fn reference(body: &Value, family: Family) -> Candidate {
    match family {
        Family::Stepping(name) => stepping(body, name, false).swap_remove(0),
        Family::Scattering => every_path(body),
    }
}

/// The candidates, the first of which is the reference, and those that a bound rules out.
pub fn candidates(body: &Value, family: Family, features: &Features, error: f64) -> (Vec<Candidate>, Vec<Considered>) {
    match family {
        Family::Stepping(name) => (stepping(body, name, features.homogeneous), Vec::new()),
        Family::Scattering => scattering(body, features, error),
    }
}

fn given(body: &Value, technique: &str) -> Map<String, Value> {
    body.get(technique).and_then(Value::as_object).cloned().unwrap_or_default()
}

/// `flat` where there is no gradient for shading to show.
fn stepping(body: &Value, name: &str, flat: bool) -> Vec<Candidate> {
    let own = given(body, name);
    let schema = technique::find(name).map(|t| (t.schema)()).unwrap_or_default();
    let open = |field: &str| schema["properties"].get(field).is_some() && !own.contains_key(field);
    let of = |more: &[(&str, Value)], words: String, less: Option<String>| {
        let mut own = own.clone();
        own.extend(more.iter().map(|(k, v)| ((*k).to_owned(), v.clone())));
        let (technique, own) = (name.into(), Value::Object(own));
        Candidate { technique, own, lights: None, words, unbiased: false, less: less.into_iter().collect() }
    };
    if !open("step_voxels") {
        return vec![Candidate { unbiased: true, ..of(&[], format!("{name} as it is given"), None) }];
    }
    let mut ways = vec![("", None)];
    if open("pre_integrated") {
        ways.push((", pre-integrated", Some(("pre_integrated", json!(true)))));
    }
    if flat && own.get("shading") == Some(&json!(true)) {
        ways.push((", unshaded", Some(("shading", json!(false)))));
    }
    let shortest = [("step_voxels", json!(SHORTEST))];
    let mut all = vec![Candidate { unbiased: true, ..of(&shortest, format!("{name}, the shortest step"), None) }];
    for (way, more) in ways {
        let mut shorter = None;
        for step in STEPS {
            let set: Vec<_> = [("step_voxels", json!(step))].into_iter().chain(more.clone()).collect();
            let words = format!("{name}, step of {step} voxels{way}");
            all.push(of(&set, words.clone(), shorter.replace(words)));
        }
    }
    all
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
            words: "single_scatter, as asked".into(),
            unbiased: true,
            less: Vec::new(),
        },
        _ => Candidate {
            technique: "volume_path".into(),
            own,
            lights: None,
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
        Candidate { technique, own, lights: None, words, unbiased: false, less: vec![less] }
    };
    let mut all = vec![every_path(body)];
    let mut ruled_out = Vec::new();
    let free = super::is_auto(body) && !own.contains_key("max_scatterings") && features.albedo != Some(0.0);
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
    if let Some(given) = lights(&all[0].request(body)).filter(|_| super::is_auto(body)) {
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
