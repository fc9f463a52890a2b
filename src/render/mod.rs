//! The validated request: the subject of a render, its camera, its technique and its budget. Fields are private: the contents of a [`Scene`] have
//! been checked, and nothing downstream checks again.

mod budget;
mod export;
mod pilot;
mod projection;
pub(crate) mod region;
mod schema;
mod shared;
mod subject;

use std::sync::Arc;

use serde_json::{Map, Value};

use crate::asset::Assets;
use crate::config::Limits;
use crate::error::{Error, Result};
use crate::film::Planned;
use crate::film::picture::Background;
use crate::request::{self, CameraRequest, ImageRequest, RenderRequest};
use crate::scene::camera::Camera;
use crate::scene::clip::Clip;
use crate::technique::{self, Kind, PreparedView, Setting, Subject, Technique, View};
use crate::volume::Volume;
pub use budget::Budget;
pub use export::{ExportTask, export_schema};
use pilot::Pilot;
pub use projection::{at_projection, export_of_projection, projection_schema};
pub use schema::{parameters_schema, schema};
use shared::{own_parameters, where_it_was_given};

/// The technique of a request that leaves the choice to the planner.
pub const AUTO: &str = "auto";
/// The default number of pixels along a side.
const DEFAULT_SIDE: u32 = 512;

/// A valid render request with its defaults resolved.
#[derive(Clone)]
pub struct Scene {
    technique: &'static Technique,
    view: Arc<dyn View>,
    own: Arc<str>,
    given: Arc<Map<String, Value>>,
    level: Option<u32>,
    asked_samples: Option<u32>,
    subject: Subject,
    /// The view of its subject; `None` while the subject is a field that is not there yet.
    prepared: Option<Arc<dyn PreparedView>>,
    camera: Camera,
    clip: Clip,
    image: [u32; 2],
    background: Background,
    budget: Budget,
    seed: u64,
    places: u64,
    pilot: Option<Pilot>,
    planned: Option<Planned>,
}

impl Scene {
    /// Checks `body` and resolves its defaults; loads the volume that it names.
    ///
    /// # Errors
    /// [`Error::Invalid`] with JSON pointers and permitted ranges.
    pub fn from_json(body: &Value, assets: &Assets, limits: &Limits) -> Result<Self> {
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
        let Kind::View { parse, .. } = technique.kind else {
            return Err(Error::invalid(
                "/technique",
                "this is a field technique",
                "a view; put the field under volume",
            ));
        };
        let own = own_parameters(technique, &request)?;
        let view = parse(&own, &format!("/{}", technique.name), assets)
            .map_err(|e| where_it_was_given(e, technique, &request))?;
        let subject = subject::of_request(request.volume.as_ref(), view.bounds(), assets, limits)?;
        if view.shows_labels(None) && request.volume.as_ref().is_some_and(|v| v.level.is_some_and(|l| l > 0)) {
            return Err(Error::invalid("/volume/level", "there is no mean of labels", "0, or leave it out"));
        }
        let camera = Camera::from_request(request.camera.as_ref(), subject.bounds())?;
        let clip = Clip::from_request(request.clip.as_ref())?;
        if request.clip.is_some() && !view.clips() {
            let detail = format!("{} shows the whole volume: light comes from everywhere", technique.name);
            return Err(Error::invalid("/clip", detail, "leave it out, or another technique"));
        }
        let image = request.image.unwrap_or_default();
        let background = background(&image)?;
        let image = [image.width.unwrap_or(DEFAULT_SIDE), image.height.unwrap_or(DEFAULT_SIDE)];
        let asked = request.budget.unwrap_or_default();
        let (budget, asked_samples) = (Budget::of(&asked, limits), asked.samples);
        let scene = Self {
            technique,
            view,
            own: format!("{} {own}", technique.name).into(),
            given: Arc::new(own.as_object().cloned().unwrap_or_default()),
            level: request.volume.as_ref().and_then(|v| v.level),
            asked_samples,
            subject,
            prepared: None,
            camera,
            clip,
            image,
            background,
            budget,
            seed: request.seed.unwrap_or(0),
            places: request.seed.unwrap_or(0),
            pilot: None,
            planned: None,
        };
        scene.prepared_for_subject()
    }

    /// The scene, after a check that its view and its subject go together. With a field, that is not known before the field is there.
    fn prepared_for_subject(self) -> Result<Self> {
        let prepared = match self.subject.field() {
            None => Some(self.view.prepare(&self.subject)?),
            Some(_) => None,
        };
        Ok(Self { prepared, ..self })
    }

    /// The same picture with another of its settings.
    ///
    /// # Errors
    /// [`Error::Invalid`] when the setting and the scene do not go together.
    pub(crate) fn with_setting(&self, setting: &Setting) -> Result<Self> {
        let mut scene = self.clone();
        if setting.view.is_none() && setting.level.is_none() {
            return Ok(scene);
        }
        if let Some(view) = &setting.view {
            scene.technique = technique::find(setting.technique)
                .ok_or_else(|| Error::internal("a setting of a technique that is not in the list"))?;
            scene.view = view.clone();
            scene.own = format!("{} {}: {}", setting.technique, self.own, setting.words).into();
        }
        if let (Some(volume), Some(level)) = (self.subject.volume(), setting.level) {
            scene.subject = self.subject.with_volume(volume.level(level)?);
        }
        scene.prepared_for_subject()
    }

    /// A camera for the same scene, from the body of `PUT …/camera`.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `/camera`.
    pub fn camera_from_json(&self, body: &Value) -> Result<Camera> {
        let request: CameraRequest = request::parse(body, request::schema_of::<CameraRequest>(), "/camera")?;
        Camera::from_request(Some(&request), self.subject.bounds())
    }

    /// The scene as a planner chose it, with what the planner knows of its picture.
    pub fn as_planned(self, planned: Option<Planned>) -> Self {
        Self { planned, ..self }
    }

    /// What a planner knows of its picture.
    pub fn planned(&self) -> Option<Planned> {
        self.planned
    }

    /// Sets another camera.
    pub fn set_camera(&mut self, camera: Camera) {
        // The plan's bound is one of the first camera's picture.
        self.planned = self.planned.map(|planned| Planned { bound: None, ..planned });
        self.camera = camera;
    }

    /// The same scene with another subject.
    ///
    /// # Errors
    /// As [`View::prepare`].
    pub(crate) fn looking_at(&self, subject: Subject) -> Result<Self> {
        Self { subject, ..self.clone() }.prepared_for_subject()
    }

    /// The view of its subject, or of the volume that its field has become.
    ///
    /// # Errors
    /// As [`View::prepare`].
    pub(crate) fn prepared(&self, field: Option<&Arc<Volume>>) -> Result<Arc<dyn PreparedView>> {
        match (field, &self.prepared) {
            (None, Some(prepared)) => Ok(prepared.clone()),
            (Some(volume), _) => self.view.prepare(&self.subject.with_volume(volume.clone())),
            (None, None) => Err(Error::internal("a field that was not computed")),
        }
    }

    /// The samples of the budget, if the request gives them.
    pub(crate) fn asked_samples(&self) -> Option<u32> {
        self.asked_samples
    }

    /// The level of the volume, if the request gives one.
    pub(crate) fn level(&self) -> Option<u32> {
        self.level
    }

    /// The view's own parameters as the request has them, with the shared ones.
    pub(crate) fn given(&self) -> &Map<String, Value> {
        &self.given
    }

    /// The view technique.
    pub fn technique(&self) -> &'static Technique {
        self.technique
    }
    /// The view with its parameters.
    pub fn view(&self) -> &Arc<dyn View> {
        &self.view
    }
    /// The technique and its own parameters as the request has them. They are the key of anything that depends on them alone.
    pub(crate) fn own(&self) -> &Arc<str> {
        &self.own
    }
    /// The subject of the picture.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }
    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }
    /// The part of the volume that is shown.
    pub fn clip(&self) -> &Clip {
        &self.clip
    }
    /// The background behind the volume.
    pub fn background(&self) -> Background {
        self.background
    }
    /// The width and height in pixels.
    pub fn image(&self) -> [u32; 2] {
        self.image
    }
    /// The budget.
    pub fn budget(&self) -> Budget {
        self.budget
    }
    /// The seed of every random number but those of the places in a pixel.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The seed of the places in a pixel. It is that of the request.
    pub fn places(&self) -> u64 {
        self.places
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
