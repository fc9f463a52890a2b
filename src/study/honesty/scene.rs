//! Random scenes: any view with parameters that it draws itself, on volumes of any type and on fields, of any size of picture, with any budget, at any
//! moment.

use glam::DVec3;
use serde_json::{Value, json};

use super::moment::Moment;
use super::subject::Subject;
use crate::error::Result;
use crate::study::bench::Bench;
use crate::study::oracle::Random;
use crate::technique::{self, Draw, Technique};

/// The draws until one is a valid request.
const TRIES: u64 = 50;
/// The technique that stands for the planner's choice.
const AUTO: &str = "auto";
/// The part of the scenes that look at a field.
const FIELDS: f64 = 0.1;
/// The parts of the scenes that are judged at their first picture, and after a motion.
const FIRST: f64 = 0.1;
const MOVED: f64 = 0.1;

/// A scene of the study.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The view whose parameters it has, or `auto`.
    pub technique: &'static str,
    /// The request.
    pub request: Value,
    /// The moment at which it is judged.
    pub moment: Moment,
    /// The request without a budget whose picture is the truth. It has no size and no seed yet.
    pub truth: Value,
}

/// The scene of a number. Views take turns, and the planner with them.
///
/// # Errors
/// Those of the store.
pub fn scene(bench: &Bench, number: u64, sizes: &[u32]) -> Result<Option<Scene>> {
    let views: Vec<&Technique> = technique::views().collect();
    let turn = number as usize % (views.len() + 1);
    for attempt in 0..TRIES {
        let mut random = Random::new(0x5eed_0000 + number * TRIES + attempt);
        let view = match views.get(turn) {
            Some(view) => view,
            None => views[(random.unit() * views.len() as f64) as usize],
        };
        let scene = draw(bench, view, turn == views.len(), number, &mut random, sizes)?;
        // What the view refuses, the planner does, too.
        let mut own = scene.request.clone();
        own["technique"] = json!(view.name);
        if bench.is_valid(&own) && bench.is_valid(&scene.truth) {
            return Ok(Some(scene));
        }
    }
    Ok(None)
}

impl Scene {
    /// The options that it has, each with its value if that is a word or a truth value; the kind of its subject, and its budget.
    pub fn options(&self) -> Vec<String> {
        let views = technique::views().filter_map(|t| Some((t.name, self.request.get(t.name)?.as_object()?)));
        let own = views.flat_map(|(name, own)| own.iter().map(move |(field, value)| (name, field, value)));
        let mut options: Vec<String> = own
            .map(|(name, field, value)| match value {
                Value::String(word) => format!("`{name}`: {field} {word}"),
                Value::Bool(truth) => format!("`{name}`: {field} {truth}"),
                _ => format!("`{name}`: {field}"),
            })
            .collect();
        let volume = &self.request["volume"];
        let kinds = [("builtin", "a built-in"), ("id", "an upload")];
        let kind = kinds.into_iter().find(|(key, _)| volume.get(key).is_some()).map_or("a field", |(_, words)| words);
        options.push(format!("subject: {kind}"));
        let budget = &self.request["budget"];
        options.push(match budget["samples"].as_u64() {
            Some(samples) => format!("budget: {samples} samples"),
            None if budget.get("max_error").is_some() => "budget: max_error".into(),
            None => "budget: time_ms".into(),
        });
        options
    }
}

fn draw(
    bench: &Bench,
    view: &Technique,
    is_planned: bool,
    number: u64,
    random: &mut Random,
    sizes: &[u32],
) -> Result<Scene> {
    let mut unit = || random.unit();
    let subject =
        if unit() < FIELDS { Subject::field(bench, &mut unit)? } else { Subject::volume(bench, number, &mut unit)? };
    let cases = (view.cases)();
    let mut own = (cases.draw)(&mut Draw::new(&mut unit, subject.range, subject.side));
    let size = |unit: &mut dyn FnMut() -> f64| sizes[(unit() * sizes.len() as f64) as usize];
    let image = json!({"width": size(&mut unit), "height": size(&mut unit)});
    let mut request =
        json!({"technique": view.name, view.name: own, "volume": subject.volume, "image": image, "seed": number});
    request["camera"] = camera(&mut unit, &subject);
    if unit() < 0.1 {
        let normal: [f64; 3] = std::array::from_fn(|_| unit() - 0.5);
        let point = subject.centre + 0.1 * subject.side * unit() * DVec3::X;
        request["clip"] = json!({"planes": [{"normal": normal, "point": point.to_array()}]});
    }
    let moment = match unit() {
        _ if is_planned => Moment::End,
        part if part < FIRST => Moment::First,
        part if part < FIRST + MOVED => Moment::Moved(camera(&mut unit, &subject)),
        _ => Moment::End,
    };
    let mut truth = request.clone();
    if let Moment::Moved(camera) = &moment {
        truth["camera"] = camera.clone();
    }
    // The planner leaves nothing of the scene out.
    let whole = technique::views().find(|t| is_planned && t.name == view.complete()).unwrap_or(view);
    if let (Some(all), Some(own)) = (truth.as_object_mut(), own.as_object_mut()) {
        all.remove(view.name);
        ((whole.cases)().truth)(own);
        all.insert(whole.name.into(), json!(own));
        all.insert("technique".into(), json!(whole.name));
    }
    request["budget"] = budget(&mut unit, is_planned);
    if is_planned {
        request["technique"] = json!(AUTO);
    }
    Ok(Scene { technique: if is_planned { AUTO } else { view.name }, request, moment, truth })
}

/// A camera around a subject, now and then inside of it or without perspective.
fn camera(unit: &mut dyn FnMut() -> f64, subject: &Subject) -> Value {
    let half = 0.5 * subject.side;
    let (turn, height) = (std::f64::consts::TAU * unit(), 2.0 * unit() - 1.0);
    let flat = (1.0 - height * height).sqrt();
    let far = half * if unit() < 0.1 { 0.3 + 0.7 * unit() } else { 2.0 + 2.0 * unit() };
    let eye = subject.centre + far * DVec3::new(flat * turn.cos(), height, flat * turn.sin());
    let target = subject.centre + 0.4 * half * DVec3::from_array(std::array::from_fn(|_| unit() - 0.5));
    json!({"eye": eye.to_array(), "target": target.to_array(), "up": [0.1, 0.2, 1],
        "fov_y_deg": 20.0 + 45.0 * unit(), "projection": if unit() < 0.15 { "orthographic" } else { "perspective" }})
}

/// A number of samples, an error, or a time. The planner needs an error.
fn budget(unit: &mut dyn FnMut() -> f64, is_planned: bool) -> Value {
    let kind = if is_planned { 0.5 } else { unit() };
    let logarithmic = |u: f64, least: f64, most: f64| least * (most / least).powf(u);
    if kind < 0.5 {
        let samples = [1, 2, 3, 4, 6, 8, 16, 24, 32, 64][(unit() * 10.0) as usize];
        json!({ "samples": samples })
    } else if kind < 0.85 {
        json!({"max_error": logarithmic(unit(), 0.01, 0.2)})
    } else {
        json!({"time_ms": logarithmic(unit(), 10.0, 300.0).round()})
    }
}
