//! The description of a volume that the service gives.

use super::builtin::{self, Builtin};
use super::voxels::{Histogram, VoxelType};
use super::{Contents, RawType, Volume};
use crate::error::Result;
use glam::DMat4;
use serde_json::{Value, json};

/// A volume in words and numbers; with its histogram where it was decoded for the answer.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct VolumeInfo {
    /// What goes under `volume` in a render request: `{"id": …}` or `{"builtin": …, "resolution": …}`.
    pub reference: Value,
    /// The id of an upload.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The name of a built-in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub builtin: Option<String>,
    /// A name for people.
    pub name: String,
    /// `nifti`, `nrrd`, `raw`, `builtin` or `field`.
    pub format: String,
    /// Voxels along x, y, z.
    pub dims: [usize; 3],
    /// World distance between neighbouring voxels along each index axis, in `unit`.
    pub spacing: [f64; 3],
    /// The type in which voxels are kept.
    pub voxel_type: VoxelType,
    /// Least and greatest value, scaled. Of a built-in that is only listed: the bounds of its formula.
    pub range: [f64; 2],
    /// Voxels that are NaN or were infinite.
    pub non_finite: u64,
    /// Bytes of the voxels in memory.
    pub bytes: u64,
    /// The world's length unit: `mm`, or `unit` for what has no physical size.
    pub unit: String,
    /// Column-major map from continuous index (voxel centres at i + 0.5) to the world.
    pub world_from_index: [f64; 16],
    /// Row-major map from integer voxel indices to patient space (RAS), in the file's own length unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file_affine: Option<[[f64; 4]; 4]>,
    /// value = raw · slope + inter.
    pub slope: f64,
    /// value = raw · slope + inter.
    pub inter: f64,
    /// What the values are taken for, where the volume was decoded for the answer. Defaults depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contents: Option<Contents>,
    /// What was lost or assumed while reading.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// How many voxels have which value, without outliers and what stands for no data: these count to the ends. Left out of lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub histogram: Option<Histogram>,
}

impl VolumeInfo {
    /// The description of an uploaded volume.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn of_upload(id: &str, volume: &Volume) -> Result<Self> {
        Ok(Self { id: Some(id.to_owned()), ..Self::of(volume, json!({ "id": id }))? })
    }

    /// The description of a built-in that was built.
    ///
    /// # Errors
    /// As [`Volume::voxels`].
    pub fn of_builtin(name: &str, resolution: usize, seed: u64, volume: &Volume) -> Result<Self> {
        Ok(Self { builtin: Some(name.to_owned()), ..Self::of(volume, builtin_reference(name, resolution, seed))? })
    }

    fn of(volume: &Volume, reference: Value) -> Result<Self> {
        Ok(Self {
            reference,
            id: None,
            builtin: None,
            name: volume.name().to_owned(),
            format: volume.format().to_owned(),
            dims: volume.dims(),
            spacing: volume.spacing(),
            voxel_type: volume.voxel_type(),
            range: volume.range(),
            non_finite: volume.non_finite(),
            bytes: volume.bytes(),
            unit: volume.unit().to_owned(),
            world_from_index: DMat4::from(volume.world_from_index()).to_cols_array(),
            file_affine: volume.file_affine(),
            slope: volume.slope(),
            inter: volume.inter(),
            contents: Some(volume.contents()?.clone()),
            notes: volume.notes().to_vec(),
            histogram: Some(volume.histogram_within(volume.contents()?.data)?),
        })
    }

    /// The description of a built-in at its default resolution, without building it.
    pub(crate) fn of_unbuilt(builtin: &Builtin) -> Self {
        let n = builtin::DEFAULT_RESOLUTION;
        let step = 2.0 / n as f64;
        let mut world_from_index = DMat4::from_scale(glam::DVec3::splat(step));
        world_from_index.w_axis = glam::DVec4::new(-1.0, -1.0, -1.0, 1.0);
        Self {
            reference: builtin_reference(builtin.name, n, 0),
            id: None,
            builtin: Some(builtin.name.to_owned()),
            name: builtin.name.to_owned(),
            format: "builtin".to_owned(),
            dims: [n; 3],
            spacing: [step; 3],
            voxel_type: RawType::F32.kept_as(),
            range: builtin.bounds,
            non_finite: 0,
            bytes: (n * n * n * VoxelType::F32.bytes()) as u64,
            unit: "unit".to_owned(),
            world_from_index: world_from_index.to_cols_array(),
            file_affine: None,
            slope: 1.0,
            inter: 0.0,
            contents: None,
            notes: Vec::new(),
            histogram: None,
        }
    }

    /// The description without its histogram and contents, for lists.
    pub(crate) fn brief(mut self) -> Self {
        (self.histogram, self.contents) = (None, None);
        self
    }
}

fn builtin_reference(name: &str, resolution: usize, seed: u64) -> Value {
    match seed {
        0 => json!({ "builtin": name, "resolution": resolution }),
        _ => json!({ "builtin": name, "resolution": resolution, "seed": seed }),
    }
}
