//! Random subjects: built-ins, their values in other types of voxels, and fields.

use glam::DVec3;
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::study::bench::Bench;
use crate::technique::{self, Draw, Technique};
use crate::volume::builtin::BUILTINS;
use crate::volume::{RawQuery, Volume, VoxelType, Voxels};

/// What a scene looks at.
pub(super) struct Subject {
    /// The request's `volume`.
    pub volume: Value,
    /// The range of its values; of a field, that of most of them.
    pub range: [f64; 2],
    /// The centre of its box, and the mean of its sides, world units.
    pub centre: DVec3,
    pub side: f64,
}

impl Subject {
    fn new(volume: Value, range: [f64; 2], values: &Volume) -> Self {
        let bounds = Bounds::from(values);
        let corners = bounds.corners();
        let side = 2.0 * bounds.radius() / 3f64.sqrt();
        Self { volume, range, centre: 0.5 * (corners[0] + corners[7]), side }
    }

    /// A field whose parameters its technique draws.
    pub fn field(bench: &Bench, unit: &mut dyn FnMut() -> f64) -> Result<Self> {
        let fields: Vec<&Technique> = technique::random_fields().collect();
        let field = fields[(unit() * fields.len() as f64) as usize];
        let own = ((field.cases)().draw)(&mut Draw::new(unit, [0.0, 1.0], 1.0));
        let volume = json!({ field.name: own });
        let small = json!({"technique": "projection", "volume": volume, "image": {"width": 8, "height": 8},
            "budget": {"samples": 1}});
        let grid = bench.finish(&small)?.field().ok_or_else(|| Error::internal("a scene without its field"))?;
        let most = grid.contents()?.window;
        Ok(Self::new(volume, most, &grid))
    }

    /// A built-in volume as it is, or its values in another type of voxels.
    pub fn volume(bench: &Bench, number: u64, unit: &mut dyn FnMut() -> f64) -> Result<Self> {
        let builtin = &BUILTINS[(unit() * BUILTINS.len() as f64) as usize];
        let resolution = [16, 24, 32, 48, 64, 96][(unit() * 6.0) as usize];
        let values = bench.assets().builtin(builtin.name, resolution, number)?;
        let voxel = VoxelType::ALL[(unit() * 4.0) as usize];
        if unit() < 0.5 || voxel == VoxelType::F32 {
            let volume = json!({"builtin": builtin.name, "resolution": resolution, "seed": number});
            return Ok(Self::new(volume, values.range(), &values));
        }
        let most = match voxel {
            VoxelType::U8 => f64::from(u8::MAX),
            VoxelType::I16 => f64::from(i16::MAX),
            VoxelType::U16 | VoxelType::F32 => f64::from(u16::MAX),
        };
        let ([low, high], floats) = (values.range(), values.values()?);
        let whole = |i: usize| (most * (floats.of(i) - low) / (high - low).max(f64::MIN_POSITIVE)).round();
        let all = 0..values.voxel_count();
        let voxels = match voxel {
            VoxelType::U8 => Voxels::U8(all.map(|i| whole(i) as u8).collect()),
            VoxelType::I16 => Voxels::I16(all.map(|i| whole(i) as i16).collect()),
            VoxelType::U16 | VoxelType::F32 => Voxels::U16(all.map(|i| whole(i) as u16).collect()),
        };
        let query = RawQuery {
            dims: Some(values.dims().map(|n| n.to_string()).join(",")),
            r#type: Some(format!("{voxel:?}").to_lowercase()),
            spacing: Some(values.spacing().map(|s| s.to_string()).join(",")),
            endian: None,
        };
        let (stored, id, _) = bench.assets().volumes().insert(voxels.as_bytes().to_vec(), "honesty", query.parse()?)?;
        Ok(Self::new(json!({ "id": id }), stored.range(), &stored))
    }
}
