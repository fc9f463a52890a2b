//! The planner: model no more than a scene needs.
//!
//! A request says what is looked at and how wrong the picture may be or how long it may take. From the scene's [`features`] come the
//! `settings` that could do, less those that a bound rules out; a `pilot` of a few thousand pixels of the picture itself measures what each
//! of the rest costs here and is wrong by; what was `found` is looked at closer where that might be the best, and the likely one is
//! confirmed on the whole picture; `choose` takes the cheapest that is enough, or the best that is in time, and says why in `words`. Of a
//! field that is yet to be computed some small ones stand for it, and tell how many `photons` its picture needs.
//!
//! What grows how is what the study measured: random `noise` falls as the root of the samples, what the places in a pixel miss by a power
//! between ½ and 1 and not everywhere; time is linear in samples and pixels.

mod calibration;
mod candidates;
mod choose;
pub mod features;
mod found;
mod noise;
mod photons;
mod pilot;
mod reply;
mod run;
mod settings;
mod words;

use serde_json::{Value, json};

use crate::config::Limits;
use crate::error::{Error, Result};
use crate::job::Engine;
use crate::scene::{Scene, Subject};
use crate::volume::Store;
pub use calibration::Calibrations;
pub use candidates::is_auto;
use candidates::{Candidate, Family};
use choose::{Choice, Chosen};
use features::Features;
use found::Found;
use photons::{Photons, Simulated};
use pilot::Pilot;
pub use reply::{Considered, Plan, Predicted};
use run::Asked;

/// What is asked for where the budget is silent.
const USUAL_ERROR: f64 = 0.02;

/// How often one plan looks deeper or at the whole picture, at most.
const LOOKS: usize = 12;
/// Of fewer samples than these the film knows its noise less well than a pilot.
const FEW: u32 = 8;

/// What is looked at.
struct Seen {
    /// As the reference shows it.
    scene: Scene,
    simulated: Option<Simulated>,
    features: Features,
}

/// What planning needs.
pub struct Planner<'a> {
    /// Runs the pilots.
    pub engine: &'a Engine,
    /// Has the volumes.
    pub store: &'a Store,
    /// What is permitted.
    pub limits: &'a Limits,
    /// What is known of this device.
    pub calibrations: &'a Calibrations,
}

impl Planner<'_> {
    /// Plans a request whose technique is `auto`, or a view of which only what is not given is planned.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn plan(&self, body: &Value) -> Result<Plan> {
        if !body.is_object() {
            return Err(Error::invalid("", "not an object", "a JSON object such as a render's"));
        }
        // One for all of its pilots.
        let _place = self.engine.reserve()?;
        let family = Family::of(body);
        let mut seen = self.see(body, family).await?;
        let wish = Wish::of(&seen.scene);
        let (candidates, mut considered) = settings::candidates(body, family, &seen.features, wish.error);
        let possible: Vec<Candidate> =
            candidates.into_iter().filter(|c| self.scene(&c.request(body)).is_ok()).collect();
        let field = seen.simulated.as_ref().map(Simulated::volume);
        let asked = Asked { planner: self, body, image: seen.scene.image(), field };
        // What is wrong by too much is of no use, unless all that there is time for is.
        let useless = if wish.time_ms.is_none() { wish.error } else { f64::INFINITY };
        let mut found = pilot::run_all(asked, &possible, useless).await?;
        seen.features.opaque = (family != Family::Scattering).then_some(found.opaque);
        let photons = match &seen.simulated {
            Some(simulated) => Some(simulated.photons(asked, &found, seen.features.pixels_per_voxel).await?),
            None => None,
        };
        let chosen = self.choose(asked, &mut found, wish, photons.as_ref()).await?;
        considered.splice(0..0, chosen.considered.into_iter().chain(found.skipped));
        let best = &found.pilots[chosen.index];
        let mut request = best.candidate.request(body);
        request["budget"] = budget(best, chosen.amount.samples, chosen.enough && photons.is_none(), wish);
        if let Some((simulated, photons)) = seen.simulated.as_ref().zip(chosen.amount.photons) {
            simulated.with_photons(&mut request, photons);
        }
        let mut reasons = seen.features.words();
        reasons.extend(chosen.reasons);
        Ok(Plan {
            technique: best.candidate.technique.clone(),
            options: best.candidate.own.clone(),
            samples: chosen.amount.samples,
            photons: chosen.amount.photons,
            device_ms: chosen.device_ms,
            error: chosen.error,
            reasons,
            considered,
            features: seen.features,
            request,
        })
    }

    /// Chooses, and looks closer where that might change what is chosen, until it does not.
    async fn choose(
        &self,
        asked: Asked<'_>,
        found: &mut Found,
        wish: Wish,
        photons: Option<&Photons>,
    ) -> Result<Chosen> {
        let calibration = self.calibrations.of(self).await?;
        let samples = asked.body.pointer("/budget/samples").and_then(Value::as_u64).map_or(u32::MAX, |n| n as u32);
        let most = self.limits.max_samples.min(samples);
        let choose = |found: &Found| {
            let (Found { pilots, places, .. }, image, calibration) = (found, asked.image, &calibration);
            Choice { pilots, places, wish, image, calibration, most, photons }.choose()
        };
        let mut chosen = choose(found);
        for _ in 0..LOOKS {
            let looked = (chosen.enough && found.deepen(asked, chosen.index, chosen.amount.samples).await?)
                || ((chosen.enough || wish.time_ms.is_some()) && found.confirm(asked, chosen.index).await?);
            if !looked && !std::mem::take(&mut found.places.hopeful) {
                break;
            }
            chosen = choose(found);
        }
        found.places.hopeful = false;
        Ok(choose(found))
    }

    /// What a request looks at, as the planner sees it: of a field that is yet to be computed a simulation of few photons.
    async fn see(&self, body: &Value, family: Family) -> Result<Seen> {
        let scene = self.reference(body, family)?;
        let reference = settings::reference(body, family);
        let simulated = match scene.subject() {
            Subject::Volume(_) => None,
            Subject::Field(_) => Some(Simulated::of(self, body, &reference).await?),
        };
        let volume = match (scene.subject(), &simulated) {
            (_, Some(simulated)) => simulated.volume(),
            (Subject::Volume(volume), _) => volume,
            (Subject::Field(_), None) => return Err(Error::internal("a field that was not simulated")),
        };
        let features = Features::of(&scene, volume, &reference.request(body));
        Ok(Seen { scene, simulated, features })
    }

    /// Measures what is to be known of this device, unless that is known.
    ///
    /// # Errors
    /// When a render fails.
    pub async fn calibrate(&self) -> Result<()> {
        self.calibrations.of(self).await.map(drop)
    }

    /// Every setting that could be chosen, whatever a bound says of it, in words and as a request; the first is the reference.
    ///
    /// # Errors
    /// Those of the request.
    pub async fn settings(&self, body: &Value) -> Result<Vec<(String, Value)>> {
        let family = Family::of(body);
        let features = self.see(body, family).await?.features;
        let (candidates, _) = settings::candidates(body, family, &features, f64::INFINITY);
        let requests = candidates.into_iter().map(|c| (c.words.clone(), c.request(body)));
        Ok(requests.filter(|(_, request)| self.scene(request).is_ok()).collect())
    }

    /// The request to render, and what the planner says of it: of another technique than `auto` the request as it is.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub async fn resolve(&self, body: Value) -> Result<(Value, Option<Value>)> {
        if !body.is_object() || !is_auto(&body) {
            return Ok((body, None));
        }
        let plan = self.plan(&body).await?;
        let request = plan.request.clone();
        let mut words = serde_json::to_value(plan).map_err(Error::internal)?;
        if let Some(words) = words.as_object_mut() {
            words.retain(|name, _| name != "request");
        }
        Ok((request, Some(words)))
    }

    /// The scene of the reference, after the request has been looked at as it came.
    fn reference(&self, body: &Value, family: Family) -> Result<Scene> {
        let as_it_came = match &body["technique"] {
            Value::Null => candidates::with_technique(body, family.technique()),
            _ if is_auto(body) => candidates::with_technique(body, family.technique()),
            _ => body.clone(),
        };
        self.scene(&as_it_came)?;
        self.scene(&settings::reference(body, family).request(body))
    }

    fn scene(&self, request: &Value) -> Result<Scene> {
        // A volume may have to be decoded first: the runtime's other work goes on meanwhile.
        tokio::task::block_in_place(|| Scene::from_json(request, self.store, self.limits))
    }
}

/// A plan's samples are enough by what the pilots know; where the film finds that it is so sooner, the render stops.
fn budget(best: &Pilot, samples: u32, enough: bool, wish: Wish) -> Value {
    let room = (choose::AIM * wish.error).powi(2) - (best.bias + best.bias_within).powi(2);
    let mut budget = json!({"samples": samples});
    // Where a stepping view finds its step too long it starts over with a shorter one: what the plan knows better.
    if enough
        && Family::of(&json!({"technique": best.candidate.technique})) == Family::Scattering
        && room > 0.0
        && samples >= FEW
    {
        budget["max_error"] = json!(room.sqrt() / best.chance);
    }
    if let Some(time) = wish.time_ms {
        budget["time_ms"] = json!(time as u64);
    }
    budget
}

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish {
    error: f64,
    time_ms: Option<f64>,
    /// Whether the error was asked for, or is only the usual one.
    says_error: bool,
}

impl Wish {
    fn of(scene: &Scene) -> Self {
        let budget = scene.budget();
        Self {
            error: budget.max_error.unwrap_or(USUAL_ERROR),
            time_ms: budget.time_ms.map(|t| t as f64),
            says_error: budget.max_error.is_some() || budget.time_ms.is_none(),
        }
    }
}
