//! The subject of a technique: bounds, with a volume, a field, both or neither.
//!
//! Surfaces that a view defines itself are its own parameters; the view states their box ([`super::View::bounds`]). A volume of a series is a volume.

use std::sync::Arc;

use super::{Field, Work};
use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::volume::Volume;

/// The subject that a technique looks at.
#[derive(Clone)]
pub struct Subject {
    bounds: Bounds,
    volume: Option<Arc<Volume>>,
    field: Option<AskedField>,
}

/// A field that is computed first, and the amount of work that is asked for.
#[derive(Clone)]
pub struct AskedField {
    /// The field.
    pub field: Arc<dyn Field>,
    /// The technique's name.
    pub technique: &'static str,
    /// The parameter that sets its amount of random work, if it has one.
    pub work: Option<Work>,
    /// The amount of work in the request, if given.
    pub given: Option<u64>,
}

impl Subject {
    /// A box without anything stored.
    pub fn of_bounds(bounds: Bounds) -> Self {
        Self { bounds, volume: None, field: None }
    }

    /// An existing volume.
    pub fn of_volume(volume: Arc<Volume>) -> Self {
        Self { volume: Some(volume.clone()), ..Self::of_bounds(Bounds::from(&*volume)) }
    }

    /// A field that is computed first.
    pub fn of_field(asked: AskedField) -> Self {
        Self { field: Some(asked.clone()), ..Self::of_bounds(asked.field.bounds()) }
    }

    /// The same subject with this volume in place of its volume or its field: a level, or a field's grid.
    #[must_use]
    pub fn with_volume(&self, volume: Arc<Volume>) -> Self {
        Self { volume: Some(volume), field: None, ..self.clone() }
    }

    /// The same subject with another field.
    #[must_use]
    pub fn with_field(&self, field: Arc<dyn Field>) -> Self {
        Self { field: self.field.clone().map(|asked| AskedField { field, ..asked }), ..self.clone() }
    }

    /// Its box.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Its volume, if it exists already.
    pub fn volume(&self) -> Option<&Arc<Volume>> {
        self.volume.as_ref()
    }

    /// Its volume, for a technique that needs one.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `/volume` if it has none.
    pub fn needed_volume(&self) -> Result<&Arc<Volume>> {
        self.volume().ok_or_else(|| Error::invalid("/volume", "there is no volume to look at", "a volume or a field"))
    }

    /// Its field, if that is to be computed first.
    pub fn field(&self) -> Option<&AskedField> {
        self.field.as_ref()
    }
}
