//! The parameters of `single_scatter` and `volume_path`, and the plan made of them.

mod cases;
mod device;
mod kernels;
mod parameters;
mod plan;
mod settings;

use serde_json::Value;

use crate::request;
pub(super) use cases::cases;
pub use device::Scattering;
pub(super) use kernels::source;
pub(super) use parameters::Parameters;
pub(super) use plan::Scatterer;
pub(super) use settings::NOT_OF_ONCE;

/// The schema of the parameters without the fields `without`, and without phase functions that are not for light.
pub(super) fn schema(without: &[&str]) -> &'static Value {
    request::kept(&format!("scattering without {without:?}"), || make_schema(without))
}

fn make_schema(without: &[&str]) -> Value {
    let mut schema = request::schema_without::<Parameters>(without);
    let kinds = schema.pointer_mut("/properties/medium/properties/phase/properties/type/enum");
    if let Some(kinds) = kinds.and_then(Value::as_array_mut) {
        kinds.retain(|kind| kind != "klein_nishina");
    }
    schema
}
