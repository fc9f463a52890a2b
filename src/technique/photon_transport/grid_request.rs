//! A volume that a request names for its labels or its density.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::asset::Assets;
use crate::error::{Error, Result};
use crate::volume::{Volume, builtin};

/// A volume whose voxels say what is where.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridRequest {
    /// The id of an uploaded volume.
    id: Option<String>,
    /// The name of a built-in volume.
    builtin: Option<String>,
    /// Voxels a side of a built-in volume. Default 64.
    #[schemars(range(min = 8, max = 512))]
    resolution: Option<u32>,
    /// Seed of a built-in volume that is made of random numbers.
    #[schemars(range(min = 0, max = 9_007_199_254_740_991u64))]
    seed: Option<u64>,
}

impl GridRequest {
    /// The volume that it names.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`.
    pub fn volume(&self, assets: &Assets, at: &str) -> Result<Arc<Volume>> {
        match (&self.id, &self.builtin) {
            (Some(id), None) => assets.volumes().named(id, &format!("{at}/id")),
            (None, Some(name)) if builtin::NAMES.contains(&name.as_str()) => {
                assets.builtin(name, self.resolution.unwrap_or(64) as usize, self.seed.unwrap_or(0))
            }
            (None, Some(name)) => {
                let permitted = builtin::NAMES.join(", ");
                Err(Error::invalid(format!("{at}/builtin"), format!("there is no built-in volume '{name}'"), permitted))
            }
            _ => Err(Error::invalid(at, "a volume is named by exactly one of id and builtin", "id or builtin")),
        }
    }
}
