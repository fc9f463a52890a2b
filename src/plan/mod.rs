//! The planner: model no more than a scene needs.
//!
//! A request gives a scene and the error that the picture may have or the time that it may take. The scene's [`features`] give the
//! `settings` that could do, less those that a bound rules out. A `pilot` of a few thousand pixels of the picture itself measures the cost
//! and the error of each of the rest here. The planner looks closer at what was `found` if that might be the best, and confirms the likely
//! setting on the `whole` picture. `choose` takes the cheapest setting that is enough, or the best that is in time, and gives the reasons in
//! `words`. For a field that is yet to be computed, some small fields stand in. They tell the `field_work` that its picture needs.
//!
//! The laws of growth are those that the study measured. Random `noise` falls as the root of the samples. The error of the places in a
//! pixel falls by a power between ½ and 1, and not everywhere. Time is linear in samples and pixels.

mod calibration;
mod choose;
mod cost;
pub mod features;
mod field_work;
mod found;
mod noise;
mod pilot;
mod reply;
mod run;
mod target;
mod whole;
mod words;

use std::sync::Arc;

use serde_json::{Value, json};

use crate::asset::Assets;
use crate::config::Limits;
use crate::error::{Error, Result};
use crate::film::Planned;
use crate::job::Engine;
use crate::render::{AUTO, Scene};
use crate::technique::{self, Open, PreparedView, Setting, Settings, Technique};
use crate::volume::{MOST_LEVEL, Volume};
pub use calibration::Calibrations;
use choose::{Choice, Chosen};
use features::Features;
use field_work::{FieldWork, Simulated};
use found::Found;
use pilot::Pilot;
pub use reply::{Considered, FieldAmount, Plan, Predicted};
use run::Asked;
use target::Target;

/// The most times that one plan looks deeper or at the whole picture.
const LOOKS: usize = 12;
/// With fewer samples than these, the film knows its noise less well than a pilot.
const FEW: u32 = 8;
/// The greatest width of the voxels of a coarser level in the picture, pixels.
const WIDEST_PIXELS: f64 = 2.0;

/// The scene of a request, as the planner sees it.
struct Seen {
    /// The scene as it was asked for.
    asked: Scene,
    /// The scene as it looks at a volume that is there.
    scene: Scene,
    view: Arc<dyn PreparedView>,
    simulated: Option<Simulated>,
    features: Features,
    open: bool,
}

/// The planner, with the engine and the data that it needs.
pub struct Planner<'a> {
    /// The engine that runs the pilots.
    pub engine: &'a Engine,
    /// The stored assets.
    pub assets: &'a Assets,
    /// The limits of requests.
    pub limits: &'a Limits,
    /// The calibration of this device.
    pub calibrations: &'a Calibrations,
}

impl Planner<'_> {
    /// Plans a request whose technique is `auto`. Of a view it plans only the parameters that are not given.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn plan(&self, body: &Value) -> Result<Plan> {
        if !body.is_object() {
            return Err(Error::invalid("", "not an object", "a JSON object such as a render's"));
        }
        // All of its pilots share one place.
        let _place = self.engine.reserve()?;
        let mut seen = self.see(body).await?;
        let target = Target::of(&seen.scene);
        let asked = Asked { planner: self, scene: &seen.scene };
        let Settings { all, ruled_out } = seen.settings(target.error);
        let steps = seen.view.plan();
        let to_the_end = seen.view.parameters_to_the_end(seen.scene.camera()).is_none();
        let is_whole = !steps.biased && to_the_end && (steps.stepless || all.len() > 1);
        let skipped = |(setting, bound, why)| Considered { bias: Some(bound), ..Considered::skipped(&setting, why) };
        let mut considered: Vec<Considered> = ruled_out.into_iter().map(skipped).collect();
        // A setting that is wrong by too much is of no use, unless a time is asked for.
        let useless = if target.time_ms.is_none() { target.error } else { f64::INFINITY };
        let mut found = Found::of(asked, &all, useless).await?;
        seen.features.opaque = seen.features.optical_depth.is_none().then_some(found.opaque);
        let work = match &seen.simulated {
            Some(simulated) => Some(simulated.work(asked, &seen.asked, &found, seen.features.pixels_per_voxel).await?),
            None => None,
        };
        let chosen = self.choose(asked, &mut found, target, work.as_ref()).await?;
        considered.splice(0..0, chosen.considered.into_iter().chain(found.skipped));
        let best = &found.pilots[chosen.index];
        let mut request = reply::request(body, &best.setting);
        request["budget"] = budget(best, &seen.scene, &chosen.amount, chosen.enough && work.is_none(), target);
        if let Some((simulated, work)) = seen.simulated.as_ref().zip(chosen.amount.work) {
            simulated.put_into(&mut request, work.amount);
        }
        let mut reasons = seen.features.words();
        reasons.extend(chosen.reasons);
        Ok(Plan {
            technique: best.setting.technique.into(),
            options: Value::Object(reply::options(body, &best.setting)),
            samples: chosen.amount.samples,
            work: chosen.amount.work,
            device_ms: chosen.device_ms,
            error: chosen.error,
            bias: best.bias + best.bias_within,
            reasons,
            considered,
            features: seen.features,
            request,
            is_whole,
        })
    }

    /// Chooses, and looks closer as long as that might change the choice.
    async fn choose(
        &self,
        asked: Asked<'_>,
        found: &mut Found,
        target: Target,
        work: Option<&FieldWork>,
    ) -> Result<Chosen> {
        let calibration = self.calibrations.of(self).await?;
        let most = self.limits.max_samples.min(asked.scene.asked_samples().unwrap_or(u32::MAX));
        let choose = |found: &Found| {
            let (Found { pilots, places, .. }, image, calibration) = (found, asked.image(), &calibration);
            Choice { pilots, places, target, image, calibration, most, work }.choose()
        };
        let mut chosen = choose(found);
        for _ in 0..LOOKS {
            let looked = (chosen.enough && found.deepen(asked, chosen.index, chosen.amount.samples).await?)
                || ((chosen.enough || target.time_ms.is_some()) && found.confirm(asked, chosen.index).await?);
            if !looked && !std::mem::take(&mut found.places.hopeful) {
                break;
            }
            chosen = choose(found);
        }
        found.places.hopeful = false;
        Ok(choose(found))
    }

    /// The scene of a request, as the planner sees it. A field that is yet to be computed becomes a simulation of little work.
    async fn see(&self, body: &Value) -> Result<Seen> {
        let technique = technique_of(body);
        let mut with_technique = body.clone();
        if reply::is_open(body) {
            let setting = Setting::as_given(technique.name, String::new());
            with_technique["technique"] = json!(technique.name);
            with_technique[technique.name] = Value::Object(reply::options(body, &setting));
        }
        let asked = self.scene(&with_technique)?;
        let field = asked.subject().field().cloned();
        let (simulated, volume) = match field.map(|field| (field.work, field)) {
            None => (None, None),
            Some((None, _)) => (None, Some(field_work::whole(self, &asked).await?)),
            Some((Some(work), field)) => {
                let simulated = Simulated::of(self, &asked, field, work).await?;
                let volume = simulated.volume().clone();
                (Some(simulated), Some(volume))
            }
        };
        let scene = volume.map_or_else(|| Ok(asked.clone()), |volume| looking_at(&asked, &volume))?;
        let view = scene.prepared(None)?;
        let features = Features::of(&scene, &*view);
        Ok(Seen { asked, scene, view, simulated, features, open: body["technique"] == AUTO })
    }

    /// Calibrates this device, unless it is calibrated.
    ///
    /// # Errors
    /// The error of a render that fails.
    pub async fn calibrate(&self) -> Result<()> {
        self.calibrations.of(self).await.map(drop)
    }

    /// Every setting that could be chosen, whatever a bound says of it, in words and as a request. The first is the reference.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn settings(&self, body: &Value) -> Result<Vec<(String, Value)>> {
        let settings = self.see(body).await?.settings(f64::INFINITY);
        Ok(settings.all.iter().map(|s| (s.words.clone(), reply::request(body, s))).collect())
    }

    /// The request to render, with the planner's words about it and what it knows of the picture. A request of another technique than `auto` stays as it is.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub async fn resolve(&self, body: Value) -> Result<(Value, Option<(Value, Planned)>)> {
        if body["technique"] != AUTO {
            return Ok((body, None));
        }
        let plan = self.plan(&body).await?;
        let request = plan.request.clone();
        let known = Planned { bound: plan.bound(&body), samples: plan.samples, bias: plan.bias };
        let mut words = serde_json::to_value(plan).map_err(Error::internal)?;
        if let Some(words) = words.as_object_mut() {
            words.retain(|name, _| name != "request");
        }
        Ok((request, Some((words, known))))
    }

    fn scene(&self, request: &Value) -> Result<Scene> {
        // A volume may have to be decoded first: the runtime's other work goes on meanwhile.
        tokio::task::block_in_place(|| Scene::from_json(request, self.assets, self.limits))
    }
}

impl Seen {
    /// The settings that could do, the reference first. Those that do not go together with the scene are left out.
    fn settings(&self, error: f64) -> Settings {
        let name = self.scene.technique().name;
        let as_given =
            || Settings { all: vec![Setting::as_given(name, format!("{name} as it is given"))], ruled_out: Vec::new() };
        let open = Open { given: self.scene.given(), auto: self.open, levels: self.levels(), error };
        let mut settings = self.view.settings(&open).unwrap_or_else(as_given);
        tokio::task::block_in_place(|| settings.all.retain(|setting| self.scene.with_setting(setting).is_ok()));
        settings
    }

    /// The levels that may stand for the volume: their voxels are hardly wider than a pixel.
    fn levels(&self) -> Vec<usize> {
        let fixed = self.scene.level().is_some()
            || self.simulated.is_some()
            || self.scene.view().shows_labels(self.scene.subject().volume().map(|v| &**v));
        let wide = |level: usize| self.features.pixels_per_voxel * (1u64 << level) as f64;
        (1..=MOST_LEVEL).take_while(|level| !fixed && wide(*level) <= WIDEST_PIXELS).collect()
    }
}

/// The scene with this volume in place of its field. It may take a while.
fn looking_at(scene: &Scene, volume: &Arc<Volume>) -> Result<Scene> {
    tokio::task::block_in_place(|| scene.looking_at(scene.subject().with_volume(volume.clone())))
}

/// The technique that a request is planned as. If it names none, that is the complete technique of the request's sections about the scene,
/// or the first of the list.
fn technique_of(body: &Value) -> &'static Technique {
    let complete = |t: &Technique| technique::find(t.complete());
    let shares = |t: &&Technique| t.shares.iter().any(|section| body.get(section).is_some());
    let named = body["technique"].as_str().and_then(technique::find);
    let sharing = || technique::views().find(shares).and_then(complete);
    let given = || technique::views().find(|t| body.get(t.name).is_some()).and_then(complete);
    named.or_else(sharing).or_else(given).unwrap_or(&technique::ALL[0])
}

/// The budget of a planned request. The samples are enough by the findings of the pilots; if the film finds so sooner, the render stops. A
/// stepping view gets no error, since it would start over with a shorter step if it found its step too long. The plan knows the step
/// better.
fn budget(best: &Pilot, scene: &Scene, amount: &choose::Amount, enough: bool, target: Target) -> Value {
    let room = (choose::AIM * target.error).powi(2) - (best.bias + best.bias_within).powi(2);
    let mut budget = json!({"samples": amount.samples});
    let view = best.setting.view.as_ref().unwrap_or(scene.view());
    if enough && view.random().is_some() && room > 0.0 && amount.samples >= FEW {
        budget["max_error"] = json!(room.sqrt() / best.chance);
    }
    if let Some(time) = target.time_ms {
        budget["time_ms"] = json!(time as u64);
    }
    budget
}
