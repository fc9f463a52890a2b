//! The planner's reply, and the request that carries its plan out.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use serde_json::{Map, Value, json};

use super::features::Features;
use crate::technique;
use crate::technique::Setting;

/// A number with the interval that it is expected in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Predicted {
    /// The expectation.
    pub value: f64,
    /// The least and the most that it should be, in about nine of ten cases.
    pub interval: [f64; 2],
}

/// An amount of a field's work, under the name of its parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldAmount {
    /// The parameter.
    pub of: &'static str,
    /// The amount of the work.
    pub amount: u64,
}

impl Serialize for FieldAmount {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry(self.of, &self.amount)?;
        map.end()
    }
}

/// A setting that was considered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Considered {
    /// The setting in words.
    pub words: String,
    /// Its technique.
    pub technique: String,
    /// The samples per pixel that it would take for the error asked for, or could take in the time.
    pub samples: Option<u32>,
    /// The work of the field, if one is computed first.
    #[serde(flatten)]
    pub work: Option<FieldAmount>,
    /// The device time that it would take, milliseconds.
    pub device_ms: Option<f64>,
    /// The error that it would have, relative.
    pub error: Option<f64>,
    /// The error that it has however many samples it takes.
    pub bias: Option<f64>,
    /// True if it is enough.
    pub enough: bool,
    /// The reason that it is enough, or is not.
    pub why: String,
}

impl Considered {
    /// A setting that was not tried.
    pub(super) fn skipped(setting: &Setting, why: String) -> Self {
        Self {
            words: setting.words.clone(),
            technique: setting.technique.into(),
            samples: None,
            work: None,
            device_ms: None,
            error: None,
            bias: None,
            enough: false,
            why,
        }
    }
}

/// A plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// The technique.
    pub technique: String,
    /// Its own parameters.
    pub options: Value,
    /// Samples per pixel.
    pub samples: u32,
    /// The work of the field, if one is computed first.
    #[serde(flatten)]
    pub work: Option<FieldAmount>,
    /// The time on the device, ms.
    pub device_ms: Predicted,
    /// The error, relative.
    pub error: Predicted,
    /// The part of the error that no number of samples takes away: what the setting leaves out of the scene that was asked for, relative.
    pub bias: f64,
    /// The reasons in words.
    pub reasons: Vec<String>,
    /// Every setting that was considered.
    pub considered: Vec<Considered>,
    /// The features of the scene.
    pub features: Features,
    /// The request to post: this plan carried out.
    pub request: Value,
    /// True if all that its error is made of was measured. The cost of a step that the request gives was not, nor what rays leave out that end early.
    #[serde(skip)]
    pub is_whole: bool,
}

impl Plan {
    /// The upper bound of the picture's error that 95 of 100 pictures keep. An error that was asked for and is predicted to be met is one, as the study
    /// of the planner measures (docs/charts/planner.md). Else it is the upper end of the interval. `None` if a part of the error was not measured.
    pub fn bound(&self, body: &Value) -> Option<f64> {
        let asked = body["budget"]["max_error"].as_f64().filter(|asked| self.error.value <= *asked);
        let [_, most] = self.error.interval;
        self.is_whole.then(|| asked.unwrap_or(most))
    }
}

/// The parameters of a setting's technique in a request: those that the request gives, with the changes of the setting. A request that
/// leaves the technique open may give those of any technique that shows the same scene.
pub(super) fn options(body: &Value, setting: &Setting) -> Map<String, Value> {
    let of = technique::find(setting.technique).map(|t| t.complete());
    let alike = |t: &&technique::Technique| body["technique"] == t.name || (is_open(body) && Some(t.complete()) == of);
    let given = technique::views().filter(alike).filter_map(|t| body.get(t.name)?.as_object());
    let changes = setting.changes.iter().map(|(field, value)| ((*field).to_owned(), value.clone()));
    given.flatten().map(|(field, value)| (field.clone(), value.clone())).chain(changes).collect()
}

/// The request with a setting in it.
pub(super) fn request(body: &Value, setting: &Setting) -> Value {
    let mut request = body.clone();
    if let Some(fields) = request.as_object_mut() {
        technique::views().for_each(|t| drop(fields.remove(t.name)));
    }
    request["technique"] = json!(setting.technique);
    request[setting.technique] = Value::Object(options(body, setting));
    let own = format!("/{}/lights", setting.technique);
    let place = if request.get("lights").is_some() { "/lights" } else { own.as_str() };
    if let Some(lights) = request.pointer_mut(place).and_then(Value::as_array_mut) {
        let mut at = 0..;
        lights.retain(|_| at.next().is_some_and(|i| !setting.without_lights.contains(&i)));
    }
    if let Some(level) = setting.level {
        let volume = request.get("volume").filter(|v| v.is_object()).cloned();
        request["volume"] = volume.unwrap_or_else(|| json!({"builtin": "smoke"}));
        request["volume"]["level"] = json!(level);
    }
    request
}

/// True if a request leaves the technique to the planner.
pub(super) fn is_open(body: &Value) -> bool {
    body["technique"].is_null() || body["technique"] == crate::render::AUTO
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
        let setting = Setting { without_lights: vec![1], ..Setting::as_given("volume_path", String::new()) };
        for body in [&beside, &own] {
            let request = request(body, &setting);
            let lights = request.get("lights").or_else(|| request["volume_path"].get("lights"));
            assert_eq!(lights, Some(&two), "{request}");
            assert_eq!(request.get("lights").is_some(), body.get("lights").is_some(), "{request}");
        }
    }
}
