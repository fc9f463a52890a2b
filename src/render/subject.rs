//! The subject of a request: a volume, at a level of it, or a field.

use std::sync::Arc;

use serde_json::Value;

use crate::asset::Assets;
use crate::config::Limits;
use crate::error::{Error, Result};
use crate::request::VolumeRequest;
use crate::scene::bounds::Bounds;
use crate::technique::{self, AskedField, Kind, Subject, Technique, Work};
use crate::volume::{Volume, builtin};

/// The subject of a request. It loads the volume that the request names. `own` is the box of a view that needs no volume.
///
/// # Errors
/// [`Error::Invalid`] with a pointer under `/volume`.
pub(super) fn of_request(
    request: Option<&VolumeRequest>,
    own: Option<Bounds>,
    assets: &Assets,
    limits: &Limits,
) -> Result<Subject> {
    let Some(request) = request else {
        return match own {
            Some(bounds) => Ok(Subject::of_bounds(bounds)),
            None => at_level(&built_in("smoke", None, None, assets)?, 0),
        };
    };
    let given = usize::from(request.id.is_some()) + usize::from(request.builtin.is_some()) + request.field.len();
    if given != 1 {
        let permitted = "exactly one of id, builtin, or a field technique";
        return Err(Error::invalid("/volume", format!("{given} sources are given"), permitted));
    }
    if request.builtin.is_none() {
        for (name, set) in [("resolution", request.resolution.is_some()), ("seed", request.seed.is_some())] {
            if set {
                return Err(Error::invalid(
                    format!("/volume/{name}"),
                    "only for a built-in volume",
                    "leave it out, or name a builtin",
                ));
            }
        }
    }
    if request.level.is_some() && !request.field.is_empty() {
        return Err(Error::invalid("/volume/level", "a field has no coarser levels", "leave it out, or a volume"));
    }
    let level = request.level.unwrap_or(0) as usize;
    if let Some(id) = &request.id {
        return at_level(&assets.volumes().named(id, "/volume/id")?, level);
    }
    if let Some(name) = &request.builtin {
        return at_level(&built_in(name, request.resolution, request.seed, assets)?, level);
    }
    let (name, parameters) = request.field.iter().next().ok_or_else(|| Error::internal("a field without a name"))?;
    let technique = technique::find(name);
    let Some((technique, Kind::Field { parse, work })) = technique.map(|t| (t, t.kind)) else {
        return Err(Error::internal("the schema permits a field that is not in the list"));
    };
    let field = parse(&within_limits(technique, work, parameters, limits), &format!("/volume/{name}"), assets)?;
    let given = work.and_then(|work| parameters.get(work.of)).and_then(Value::as_u64);
    Ok(Subject::of_field(AskedField { field, technique: technique.name, work, given }))
}

/// The parameters with a default amount of work that the limits permit.
fn within_limits(technique: &Technique, work: Option<Work>, parameters: &Value, limits: &Limits) -> Value {
    let mut parameters = parameters.clone();
    let Some(work) = work else { return parameters };
    let default = (technique.schema)()["properties"][work.of]["default"].as_u64();
    if let (Some(fields), Some(default)) = (parameters.as_object_mut(), default) {
        fields.entry(work.of).or_insert(default.min((work.most)(limits)).into());
    }
    parameters
}

fn at_level(volume: &Arc<Volume>, level: usize) -> Result<Subject> {
    Ok(Subject::of_volume(volume.clone()).with_volume(volume.level(level)?))
}

fn built_in(name: &str, resolution: Option<u32>, seed: Option<u64>, assets: &Assets) -> Result<Arc<Volume>> {
    if !builtin::NAMES.contains(&name) {
        let permitted = builtin::NAMES.join(", ");
        return Err(Error::invalid("/volume/builtin", format!("there is no built-in volume '{name}'"), permitted));
    }
    assets.builtin(name, resolution.unwrap_or(128) as usize, seed.unwrap_or(0))
}
