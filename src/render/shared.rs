//! Sections of a request that techniques share, such as the medium and the lights of those that scatter light.

use serde_json::Value;

use crate::error::{Error, Result};
use crate::request::RenderRequest;
use crate::technique::{self, Technique};

/// The sections of the request that techniques share, if the request has them.
fn shared_sections(request: &RenderRequest) -> [(&'static str, &Option<Value>); 2] {
    [("medium", &request.medium), ("lights", &request.lights)]
}

/// A technique's own parameters, together with the request's shared sections.
pub(super) fn own_parameters(technique: &Technique, request: &RenderRequest) -> Result<Value> {
    let mut own = request.parameters.get(technique.name).cloned().unwrap_or_else(|| Value::Object(Default::default()));
    for (name, shared) in shared_sections(request) {
        let Some(shared) = shared else { continue };
        if !technique.shares.contains(&name) {
            let sharing: Vec<&str> = technique::views().filter(|t| t.shares.contains(&name)).map(|t| t.name).collect();
            let detail = format!("{} scatters no light", technique.name);
            let permitted = format!("{}, or leave it out", sharing.join(" or "));
            return Err(Error::invalid(format!("/{name}"), detail, permitted));
        }
        if own.get(name).is_some() {
            let detail = format!("/{}/{name} is given too", technique.name);
            return Err(Error::invalid(format!("/{name}"), detail, "in one place"));
        }
        own[name] = shared.clone();
    }
    Ok(own)
}

/// The error with the request's pointers, if it is in a shared section that was put among a technique's own parameters.
pub(super) fn where_it_was_given(error: Error, technique: &Technique, request: &RenderRequest) -> Error {
    let shared = shared_sections(request);
    error.with_pointers(|pointer| {
        let rest = pointer.strip_prefix(&format!("/{}", technique.name))?;
        let name = rest.strip_prefix('/')?.split('/').next()?;
        shared.iter().any(|(section, given)| *section == name && given.is_some()).then(|| rest.to_owned())
    })
}
