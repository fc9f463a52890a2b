//! A setting that could do: what of a request the planner may choose.

use serde_json::{Value, json};

use super::Considered;
use crate::scene::AUTO;
use crate::technique;

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
    /// The level of the volume, where that is not its own.
    pub level: Option<usize>,
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
        if let Some(level) = self.level {
            let volume = request.get("volume").filter(|v| v.is_object()).cloned();
            request["volume"] = volume.unwrap_or_else(|| json!({"builtin": "smoke"}));
            request["volume"]["level"] = json!(level);
        }
        request
    }

    /// The same without the faintest of the lights; the one before is without one of these fewer.
    pub fn without(&self, given: &Value, faintest: &[usize]) -> Self {
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
            photons: None,
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
