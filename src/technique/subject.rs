//! What a technique looks at: bounds, and any of a volume and a field.
//!
//! Surfaces that a view brings itself are its own parameters; it says what they fill ([`super::View::bounds`]). A volume of a series is a
//! volume.

use std::sync::Arc;

use super::{Field, Work};
use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::volume::Volume;

/// What is looked at.
#[derive(Clone)]
pub struct Subject {
    bounds: Bounds,
    volume: Option<Arc<Volume>>,
    field: Option<AskedField>,
}

/// A field that is computed first, and how much of it is asked for.
#[derive(Clone)]
pub struct AskedField {
    /// The field.
    pub field: Arc<dyn Field>,
    /// The technique's name.
    pub technique: &'static str,
    /// The parameter that says how much.
    pub work: Work,
    /// How much the request says, where it says so.
    pub given: Option<u64>,
}

impl Subject {
    /// A box without anything that is stored.
    pub fn of_bounds(bounds: Bounds) -> Self {
        Self { bounds, volume: None, field: None }
    }

    /// A volume that is there.
    pub fn of_volume(volume: Arc<Volume>) -> Self {
        Self { volume: Some(volume.clone()), ..Self::of_bounds(Bounds::from(&*volume)) }
    }

    /// A field that is computed first.
    pub fn of_field(asked: AskedField) -> Self {
        Self { field: Some(asked.clone()), ..Self::of_bounds(asked.field.bounds()) }
    }

    /// The same with this in place of its volume or its field: a level, or what a field has become.
    #[must_use]
    pub fn with_volume(&self, volume: Arc<Volume>) -> Self {
        Self { volume: Some(volume), field: None, ..self.clone() }
    }

    /// The same with another of its field.
    #[must_use]
    pub fn with_field(&self, field: Arc<dyn Field>) -> Self {
        Self { field: self.field.clone().map(|asked| AskedField { field, ..asked }), ..self.clone() }
    }

    /// Where it is.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Its volume, where that is there.
    pub fn volume(&self) -> Option<&Arc<Volume>> {
        self.volume.as_ref()
    }

    /// Its volume, for a technique that needs one.
    ///
    /// # Errors
    /// [`Error::Invalid`] at `/volume` where it has none.
    pub fn needed_volume(&self) -> Result<&Arc<Volume>> {
        self.volume().ok_or_else(|| Error::invalid("/volume", "there is no volume to look at", "a volume or a field"))
    }

    /// Its field, where that is to be computed first.
    pub fn field(&self) -> Option<&AskedField> {
        self.field.as_ref()
    }
}
