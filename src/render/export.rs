//! The validated request of an export: the subject that is turned into a file, and the technique that does it.

use std::sync::Arc;

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::schema::{parameters_schema, with_fields};
use super::subject;
use crate::asset::Assets;
use crate::config::Limits;
use crate::error::{Error, Result};
use crate::request::{self, VolumeRequest};
use crate::scene::bounds::Bounds;
use crate::technique::{self, Export, Kind, Subject, Technique};

/// The body of `POST /v1/exports`, less the techniques' own parameters.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
struct ExportRequest {
    /// The export technique that makes the file.
    technique: String,
    /// What is exported: an uploaded volume, a built-in one, or a field technique's name with its parameters. Default: the built-in `smoke`.
    volume: Option<VolumeRequest>,
    /// The techniques' own parameters, by technique.
    #[serde(flatten)]
    #[schemars(skip)]
    parameters: Map<String, Value>,
}

/// A valid export request with its defaults resolved.
#[derive(Clone)]
pub struct ExportTask {
    technique: &'static Technique,
    export: Arc<dyn Export>,
    subject: Subject,
    /// True if its file becomes an asset.
    is_kept: bool,
}

impl ExportTask {
    /// Checks `body` and resolves its defaults; loads the volume that it names.
    ///
    /// # Errors
    /// [`Error::Invalid`] with JSON pointers and permitted ranges.
    pub fn from_json(body: &Value, assets: &Assets, limits: &Limits) -> Result<Self> {
        if !body.is_object() {
            return Err(Error::invalid("", "not an object", "a JSON object with at least technique"));
        }
        let request: ExportRequest = request::parse(body, export_schema(limits), "")?;
        let found = technique::find(&request.technique).map(|t| (t, t.kind));
        let Some((technique, Kind::Export { parse })) = found else {
            return Err(Error::internal("the schema permits an export that is not in the list"));
        };
        let own = request.parameters.get(technique.name).cloned().unwrap_or_else(|| Value::Object(Map::new()));
        let export = parse(&own, &format!("/{}", technique.name), assets)?;
        if request.volume.is_some() && !export.needs_volume() {
            return Err(Error::invalid("/volume", "what is exported is not a volume", "leave it out"));
        }
        // What is exported has no box that anybody sees.
        let own = (!export.needs_volume()).then(|| Bounds::of_corners(DVec3::ZERO, DVec3::ONE));
        let subject = subject::of_request(request.volume.as_ref(), own, assets, limits)?;
        let task = Self { technique, export, subject, is_kept: false };
        task.export.check(task.subject.bounds())?;
        if task.subject.field().is_none() {
            // The error is found here, and not on the device's thread.
            task.export.kernels(&task.subject)?;
        }
        Ok(task)
    }

    /// The same, with a file that becomes an asset before it is done.
    #[must_use]
    pub fn kept(self) -> Self {
        Self { is_kept: true, ..self }
    }

    /// True if its file becomes an asset.
    pub fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// The export technique.
    pub fn technique(&self) -> &'static Technique {
        self.technique
    }

    /// The export with its parameters.
    pub fn export(&self) -> &Arc<dyn Export> {
        &self.export
    }

    /// The subject of the export.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }
}

/// The JSON Schema of an export request under `limits`: the shared fields and every export's own.
pub fn export_schema(limits: &Limits) -> &'static Value {
    request::kept(&format!("exports {limits:?}"), || {
        let mut schema = request::schema_of::<ExportRequest>().clone();
        schema["properties"]["technique"]["enum"] = technique::exports().map(|t| t.name).collect();
        for t in technique::exports() {
            schema["properties"][t.name] = parameters_schema(t, limits);
        }
        with_fields(schema, limits)
    })
}
