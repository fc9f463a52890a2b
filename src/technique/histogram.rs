//! # `histogram`
//!
//! The number of voxels per value, as a table. Read from the right it is the dose–volume histogram of radiotherapy (Drzymala et al., International
//! Journal of Radiation Oncology 21(1), 1991): the part of the volume that has at least a value.
//!
//! The range is divided into equal bins. A voxel's bin is found in single precision, so a value within rounding of an edge may be counted on either
//! side; the highest value belongs to the last bin. Voxels below or above the range, and NaN voxels, are counted apart. A
//! warning tells if bins are narrower than the rounding.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `bins` | | 1–65,536 | 256 |
//! | `range` | values | the first less than the last | the volume's least and greatest value |
//!
//! The file is CSV: the ends of each bin, its voxels, and the part of the finite voxels with at least the value at its lower end.
//!
//! Example: see [`example`], which a test runs.

mod process;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::case::{Case, Cases};
use super::{Export, File, Kind, OnDevice, Process, Subject, Technique};
use crate::asset::Assets;
use crate::device::Device;
use crate::device::program::{Source, Variant};
use crate::device::structs::DeviceStruct;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::volume::{Volume, VoxelType};
use process::{PER_ITEM, Run};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "histogram",
    summary: "How many voxels have which value, as a table; also the part of the volume that has at least a value",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    shares: &[],
    cases,
    kind: Kind::Export { parse },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct HistogramPass {
        /// The first voxel of the launch.
        pub first: u32,
        /// The voxel after the last of the volume.
        pub end: u32,
        /// Voxels of a work-item.
        pub per_item: u32,
        /// Bins of the range.
        pub bins: i32,
        /// The raw value where bin 0 begins.
        pub low: f32,
        /// Bins per raw value; below 0 if values fall as raw ones rise.
        pub per_raw: f32,
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Bins of equal width.
    #[serde(default = "default_bins")]
    #[schemars(range(min = 1, max = 65536))]
    bins: u32,
    /// The values where the first bin begins and the last one ends. Default: the volume's least and greatest value.
    #[schemars(inner(range(min = -1e30, max = 1e30)))]
    range: Option<[f64; 2]>,
}

fn default_bins() -> u32 {
    256
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({"technique": "histogram", "volume": {"builtin": "shepp_logan", "resolution": 64}, "histogram": {"bins": 32}})
}

fn cases() -> Cases {
    let tiny = |more: Value| json!({"technique": "histogram", "volume": {"builtin": "sphere", "resolution": 8}, "histogram": more});
    Cases {
        all: vec![Case::from(json!({"bins": 7}))],
        tiny: vec![tiny(json!({"bins": 5, "range": [0.1, 0.6]})), tiny(json!({"bins": 3}))],
        ..Cases::default()
    }
}

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: String::new,
        structs: || vec![HistogramPass::LAYOUT],
        variants: || VoxelType::ALL.map(variant).to_vec(),
        common: 0,
    }
}

fn variant(voxel: VoxelType) -> Variant {
    Variant::new(TECHNIQUE.name, Some(voxel), &[])
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn Export>> {
    let parameters: Parameters = request::read(parameters, at)?;
    if let Some([low, high]) = parameters.range
        && low >= high
    {
        return Err(Error::invalid(format!("{at}/range/1"), "the range is empty", format!("more than {low}")));
    }
    Ok(Arc::new(parameters))
}

impl Parameters {
    /// The values where the first bin begins and the last one ends. If all voxels have one value, the range is around it, as wide as its magnitude,
    /// or 1 for 0.
    fn range_of(&self, volume: &Volume) -> [f64; 2] {
        let [low, high] = self.range.unwrap_or(volume.range());
        let half = if low == high { (0.5 * low.abs()).max(if low == 0.0 { 0.5 } else { 0.0 }) } else { 0.0 };
        [low - half, high + half]
    }

    /// The kernel's parameters for a volume, before its first launch.
    fn pass(&self, volume: &Volume) -> HistogramPass {
        let raw = self.range_of(volume).map(|value| (value - volume.inter()) / volume.slope());
        HistogramPass {
            first: 0,
            end: volume.voxel_count() as u32,
            per_item: PER_ITEM,
            bins: self.bins as i32,
            low: raw[0] as f32,
            per_raw: (f64::from(self.bins) / (raw[1] - raw[0])) as f32,
        }
    }
}

impl Export for Parameters {
    fn kernels(&self, subject: &Subject) -> Result<Vec<Variant>> {
        let volume = subject.needed_volume()?;
        let most = u64::from(u32::MAX);
        if volume.voxel_count() as u64 > most {
            return Err(Error::TooLarge {
                what: format!("a volume of {} voxels", volume.voxel_count()),
                limit: format!("{most} voxels"),
            });
        }
        let pass = self.pass(volume);
        if !(pass.low.is_finite() && pass.per_raw.is_normal()) {
            let detail = "single precision cannot tell its bins apart";
            return Err(Error::invalid("/histogram/range", detail, "a range that is wider, or nearer to the volume's"));
        }
        Ok(vec![variant(volume.voxel_type())])
    }

    fn begin(&self, device: &mut Device, seen: OnDevice) -> Result<Box<dyn Process<Look = File>>> {
        let volume = seen.subject.needed_volume()?.clone();
        let voxels = seen.voxels.ok_or_else(|| Error::internal("a volume that is not on the device"))?;
        let (range, pass) = (self.range_of(&volume), self.pass(&volume));
        Ok(Box::new(Run::new(device, volume, voxels, range, pass)?))
    }
}
