//! The validated scene. Fields are private: what a `Scene` holds has been checked, and nothing downstream checks again.

pub mod camera;
pub mod clip;
pub mod depth;
pub mod interpolation;
pub mod light;
pub mod lights;
pub mod medium;
pub mod phase;
pub mod presets;
pub(crate) mod region;
mod subject;
pub mod transfer;
pub mod window;

use std::sync::Arc;

use glam::DVec3;
use serde_json::Value;

use crate::config::Limits;
use crate::error::{Error, Result};
use crate::film::picture::Background;
use crate::request::{self, BudgetRequest, CameraRequest, ImageRequest, RenderRequest};
use crate::technique::{self, Technique, View};
use crate::volume::{Store, Volume};
use camera::{Camera, Framing};
use clip::Clip;
use region::Region;
pub use subject::Subject;

/// The technique of a request that leaves it to the planner.
pub const AUTO: &str = "auto";
/// Pixels a side when the request is silent.
const DEFAULT_SIDE: u32 = 512;
/// Samples when the budget is silent: enough that the jitter's noise is below a grey level in most pictures.
const DEFAULT_SAMPLES: u32 = 16;

/// When a render stops: at the first that is reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Samples per pixel.
    pub samples: u32,
    /// Milliseconds since the render's start.
    pub time_ms: Option<u64>,
    /// The error, as the film estimates it.
    pub max_error: Option<f64>,
}

/// A valid render request with its defaults resolved.
#[derive(Clone)]
pub struct Scene {
    technique: &'static Technique,
    view: Arc<dyn View>,
    own: Arc<str>,
    subject: Subject,
    framing: Framing,
    camera: Camera,
    clip: Clip,
    image: [u32; 2],
    background: Background,
    budget: Budget,
    seed: u64,
    pilot: Option<Region>,
}

/// The radius of the sphere around a volume's box, world units.
pub(crate) fn radius(volume: &Volume) -> f64 {
    let [x, y, z] = volume.dims().map(|n| n as f64);
    0.5 * volume.world_from_index().transform_vector3(DVec3::new(x, y, z)).length()
}

/// The mean side of a volume's box, world units.
pub(crate) fn mean_side(volume: &Volume) -> f64 {
    let side = |axis: usize| volume.dims()[axis] as f64 * volume.spacing()[axis];
    (side(0) + side(1) + side(2)) / 3.0
}

/// The JSON Schema of a technique's own parameters under `limits`.
pub fn parameters_schema(technique: &Technique, limits: &Limits) -> Value {
    let mut schema = (technique.schema)().clone();
    if let Some(photons) = schema.pointer_mut("/properties/photons/maximum") {
        *photons = limits.max_photons.into();
    }
    schema
}

/// The JSON Schema of a render request under `limits`: the shared fields and every technique's own.
pub fn schema(limits: &Limits) -> &'static Value {
    request::kept(&format!("{limits:?}"), || make_schema(limits))
}

fn make_schema(limits: &Limits) -> Value {
    let mut schema = request::schema_of::<RenderRequest>().clone();
    let names: Vec<&str> = technique::views().map(|t| t.name).collect();
    schema["properties"]["technique"]["enum"] = names.into_iter().chain([AUTO]).collect();
    for t in technique::views() {
        schema["properties"][t.name] = parameters_schema(t, limits);
    }
    for name in ["medium", "lights"] {
        let of = technique::find("volume_path").map(|t| (t.schema)()["properties"][name].clone());
        schema["properties"][name] = of.unwrap_or_default();
    }
    schema["properties"]["volume"]["additionalProperties"] = false.into();
    for t in technique::fields() {
        schema["properties"]["volume"]["properties"][t.name] = (t.schema)().clone();
        schema["properties"]["volume"]["properties"][t.name]["properties"]["photons"]["maximum"] =
            limits.max_photons.into();
    }
    for side in ["width", "height"] {
        schema["properties"]["image"]["properties"][side]["maximum"] = limits.max_image_side.into();
    }
    schema["properties"]["budget"]["properties"]["samples"]["maximum"] = limits.max_samples.into();
    schema["properties"]["budget"]["properties"]["time_ms"]["maximum"] = limits.max_time_ms.into();
    schema
}

impl Scene {
    /// Checks `body` and resolves its defaults; loads the volume that it names.
    ///
    /// # Errors
    /// [`Error::Invalid`] with JSON pointers and permitted ranges.
    pub fn from_json(body: &Value, store: &Store, limits: &Limits) -> Result<Self> {
        if !body.is_object() {
            return Err(Error::invalid("", "not an object", "a JSON object with at least technique"));
        }
        let request: RenderRequest = request::parse(body, schema(limits), "")?;
        if request.technique == AUTO {
            let permitted = "a technique's name; POST /v1/renders and /v1/plan resolve it";
            return Err(Error::invalid("/technique", "this has to be planned first", permitted));
        }
        let technique = technique::find(&request.technique)
            .ok_or_else(|| Error::internal("the schema permits a technique that is not in the list"))?;
        let technique::Kind::View(parse) = technique.kind else {
            return Err(Error::invalid(
                "/technique",
                "this is a field technique",
                "a view; put the field under volume",
            ));
        };
        let own = own_parameters(technique, &request)?;
        let view =
            parse(&own, &format!("/{}", technique.name)).map_err(|e| where_it_was_given(e, technique, &request))?;
        let (subject, framing) = subject::of_request(request.volume.as_ref(), store, limits)?;
        if view.shows_labels() && request.volume.as_ref().is_some_and(|v| v.level.is_some_and(|l| l > 0)) {
            return Err(Error::invalid("/volume/level", "there is no mean of labels", "0, or leave it out"));
        }
        let camera = Camera::from_request(request.camera.as_ref(), &framing)?;
        let clip = Clip::from_request(request.clip.as_ref())?;
        if request.clip.is_some() && !view.clips() {
            let detail = format!("{} shows the whole volume: light comes from everywhere", technique.name);
            return Err(Error::invalid("/clip", detail, "leave it out, or another technique"));
        }
        let image = request.image.unwrap_or_default();
        let background = background(&image)?;
        let image = [image.width.unwrap_or(DEFAULT_SIDE), image.height.unwrap_or(DEFAULT_SIDE)];
        let budget = budget(&request.budget.unwrap_or_default(), limits);
        let scene = Self {
            technique,
            view,
            own: format!("{} {own}", technique.name).into(),
            subject,
            framing,
            camera,
            clip,
            image,
            background,
            budget,
            seed: request.seed.unwrap_or(0),
            pilot: None,
        };
        if let Subject::Volume(volume) = &scene.subject {
            scene.view.plan(volume)?;
            // Made here, so that the device thread finds them there.
            scene.words_of(volume)?;
        }
        Ok(scene)
    }

    /// The same scene from another camera, given as the body of `PUT …/camera`.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `/camera`.
    pub fn camera_from_json(&self, body: &Value) -> Result<Camera> {
        let request: CameraRequest = request::parse(body, request::schema_of::<CameraRequest>(), "/camera")?;
        Camera::from_request(Some(&request), &self.framing)
    }

    /// Puts another camera in.
    pub fn set_camera(&mut self, camera: Camera) {
        self.camera = camera;
    }

    /// Only these pixels of the picture, with what each had come to on the way.
    pub(crate) fn into_pilot(self, region: Region) -> Self {
        Self { pilot: Some(region), ..self }
    }

    /// With a volume that is there in place of what is looked at.
    pub(crate) fn looking_at(self, volume: Arc<Volume>) -> Self {
        Self { subject: Subject::Volume(volume), ..self }
    }

    /// Whether it has only some of its pixels, for a planner.
    pub(crate) fn is_pilot(&self) -> bool {
        self.pilot.is_some()
    }

    /// The pixels of the picture that it has: but for a pilot all of them.
    pub(crate) fn region(&self) -> Region {
        self.pilot.unwrap_or(Region::every(1, self.image))
    }

    /// The view technique.
    pub fn technique(&self) -> &'static Technique {
        self.technique
    }
    /// The view with its parameters.
    pub fn view(&self) -> &Arc<dyn View> {
        &self.view
    }
    /// The technique and its own parameters as the request has them: what belongs to those alone can be kept by it.
    pub(crate) fn own(&self) -> &Arc<str> {
        &self.own
    }
    /// The words that the view takes a volume's floats as, where it does.
    ///
    /// # Errors
    /// As [`View::plan`].
    pub(crate) fn words_of(&self, volume: &Volume) -> Result<Option<Arc<Volume>>> {
        Ok(self.view.resolution(volume)?.and_then(|resolution| volume.words(resolution)))
    }
    /// What is looked at.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }
    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }
    /// What of the volume is shown.
    pub fn clip(&self) -> &Clip {
        &self.clip
    }
    /// What is behind the volume.
    pub fn background(&self) -> Background {
        self.background
    }
    /// Width and height in pixels.
    pub fn image(&self) -> [u32; 2] {
        self.image
    }
    /// When to stop.
    pub fn budget(&self) -> Budget {
        self.budget
    }
    /// The seed of every random number.
    pub fn seed(&self) -> u64 {
        self.seed
    }
}

fn background(image: &ImageRequest) -> Result<Background> {
    match (image.background, image.transparent) {
        (Some(_), Some(true)) => Err(Error::invalid(
            "/image/background",
            "the picture is to be transparent",
            "one of background and transparent",
        )),
        (_, Some(true)) => Ok(Background::Transparent),
        (color, _) => Ok(Background::Colour(color.unwrap_or_default().map(|c| c as f32))),
    }
}

/// A technique's own parameters, with the parts of the scene that several techniques share put among them.
fn own_parameters(technique: &Technique, request: &RenderRequest) -> Result<Value> {
    let mut own = request.parameters.get(technique.name).cloned().unwrap_or_else(|| Value::Object(Default::default()));
    for (name, shared) in [("medium", &request.medium), ("lights", &request.lights)] {
        let Some(shared) = shared else { continue };
        if (technique.schema)()["properties"].get(name).is_none() {
            let detail = format!("{} scatters no light", technique.name);
            return Err(Error::invalid(format!("/{name}"), detail, "single_scatter or volume_path, or leave it out"));
        }
        if own.get(name).is_some() {
            let detail = format!("/{}/{name} is given too", technique.name);
            return Err(Error::invalid(format!("/{name}"), detail, "in one place"));
        }
        own[name] = shared.clone();
    }
    Ok(own)
}

/// The error with the pointers that the request has, for what was put among a technique's own parameters.
fn where_it_was_given(error: Error, technique: &Technique, request: &RenderRequest) -> Error {
    let shared = [("medium", request.medium.is_some()), ("lights", request.lights.is_some())];
    error.with_pointers(|pointer| {
        let rest = pointer.strip_prefix(&format!("/{}", technique.name))?;
        let name = rest.strip_prefix('/')?.split('/').next()?;
        shared.contains(&(name, true)).then(|| rest.to_owned())
    })
}

/// A budget that names only a time or an error may take as many samples as the server permits.
fn budget(request: &BudgetRequest, limits: &Limits) -> Budget {
    let open = request.time_ms.is_some() || request.max_error.is_some();
    let default = if open { limits.max_samples } else { DEFAULT_SAMPLES.min(limits.max_samples) };
    Budget { samples: request.samples.unwrap_or(default), time_ms: request.time_ms, max_error: request.max_error }
}
