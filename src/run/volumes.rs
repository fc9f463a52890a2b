//! The volumes on the device: those of the host, uploaded when a job first needs them, and the grids of fields, which never leave the device unless
//! somebody asks for their voxels or the device needs the room.

use std::any::Any;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::{Arc, Weak};

use super::device_volume::DeviceVolume;
use crate::device::cells::{self, Cells};
use crate::device::grid::{self, Grid};
use crate::device::program::Variant;
use crate::device::{Buffer, Device};
use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::volume::{NewVolume, Volume, VoxelType, Voxels};

/// The device memory for volumes that no job uses, and for the grids of fields, bytes each.
const IDLE_BYTES: usize = 1 << 30;

/// The volumes on the device.
#[derive(Default)]
pub(super) struct Volumes {
    volumes: HashMap<usize, (Weak<Volume>, Rc<DeviceVolume>)>,
    /// The grids of fields, the newest last.
    grids: Vec<Weak<Volume>>,
}

/// The kernels that a volume on the device needs.
pub(super) fn kernels_for(volume: &Volume) -> impl Iterator<Item = Variant> {
    let is_in_words = volume.device_grid().is_some_and(|(_, words)| words.is_some());
    cells::needed(volume.voxel_type()).into_iter().chain(is_in_words.then_some(grid::IN_WORDS))
}

impl Volumes {
    /// A volume on the device, whose kernels are built. At first use it is uploaded and its macro-cells are built.
    ///
    /// # Errors
    /// [`Error::Internal`] if the device has no room or fails.
    pub fn get(&mut self, device: &mut Device, volume: &Arc<Volume>) -> Result<Rc<DeviceVolume>> {
        let key = Arc::as_ptr(volume) as usize;
        if let Some((weak, on_device)) = self.volumes.get(&key)
            && weak.strong_count() > 0
        {
            return Ok(on_device.clone());
        }
        let (voxel, dims) = (volume.voxel_type(), volume.dims());
        let voxels = voxels_of(device, volume)?;
        let cells = Cells::new(device, &voxels, dims, voxel)?;
        let voxels = if device.info().volumes_are_images { image_of(device, &voxels, voxel, dims)? } else { voxels };
        let on_device = Rc::new(DeviceVolume::new(voxels, cells));
        self.volumes.insert(key, (Arc::downgrade(volume), on_device.clone()));
        self.tidy();
        Ok(on_device)
    }

    /// The volume of a field's grid, whose voxels are on the device. The kernels of its statistics are built.
    ///
    /// # Errors
    /// As [`Volumes::get`].
    pub fn of_field(
        &mut self,
        device: &Device,
        voxels: Buffer,
        bounds: &Bounds,
        technique: &str,
    ) -> Result<Arc<Volume>> {
        let dims = bounds.dims();
        let count = dims.iter().product();
        let statistics = grid::statistics(device, &voxels, count)?;
        let parts = NewVolume {
            dims,
            spacing: bounds.spacing(),
            linear: Some(bounds.world_from_index().matrix3),
            voxels: Voxels::F32(Vec::new()),
            slope: 1.0,
            inter: 0.0,
            name: technique.into(),
            format: "field".into(),
            file_affine: None,
            unit: "mm".into(),
            notes: Vec::new(),
        };
        let grid = Arc::new(Grid::new(device, voxels, count)?);
        let volume = Arc::new(Volume::on_device(parts, grid, &statistics)?);
        self.grids.push(Arc::downgrade(&volume));
        self.make_room_for_grids();
        Ok(volume)
    }

    /// Takes the oldest grids past the limit to the host. The newest stays.
    fn make_room_for_grids(&mut self) {
        self.grids.retain(|grid| grid.upgrade().is_some_and(|volume| volume.device_grid().is_some()));
        let grids: Vec<Arc<Volume>> = self.grids.iter().filter_map(Weak::upgrade).collect();
        let mut bytes: u64 = grids.iter().map(|volume| volume.bytes()).sum();
        for volume in grids.iter().take(grids.len().saturating_sub(1)) {
            if bytes <= IDLE_BYTES as u64 {
                return;
            }
            if let Err(cause) = volume.leave_device() {
                tracing::error!(%cause, "a grid cannot leave the device");
            }
            bytes -= volume.bytes();
        }
    }

    /// Drops volumes that are gone from the host, and idle volumes past the limit.
    pub fn tidy(&mut self) {
        self.volumes.retain(|_, (weak, _)| weak.strong_count() > 0);
        let idle = |v: &Rc<DeviceVolume>| Rc::strong_count(v) == 1;
        let mut bytes: usize = self.volumes.values().filter(|(_, v)| idle(v)).map(|(_, v)| v.bytes()).sum();
        self.volumes.retain(|_, (_, volume)| {
            let drop = bytes > IDLE_BYTES && idle(volume);
            bytes -= if drop { volume.bytes() } else { 0 };
            !drop
        });
    }
}

/// The voxels of a volume in memory of the device: those that are there already, or the host's.
fn voxels_of(device: &Device, volume: &Volume) -> Result<Arc<Buffer>> {
    let on_device = volume.device_grid();
    let here = on_device.as_ref().and_then(|(grid, words)| {
        let grid: &dyn Any = &**grid;
        Some((grid.downcast_ref::<Grid>()?.values(), words))
    });
    match here {
        Some((values, None)) => Ok(values.clone()),
        Some((values, Some(scale))) => grid::in_words(device, values, volume.voxel_count(), *scale).map(Arc::new),
        None => device.upload(volume.voxels()?.as_bytes(), grid::PADDING).map(Arc::new),
    }
}

/// A copy of voxels as an image, if the device takes one so large.
fn image_of(device: &Device, voxels: &Buffer, voxel: VoxelType, dims: [usize; 3]) -> Result<Arc<Buffer>> {
    let most = device.info().largest_image_3d;
    if (0..3).any(|axis| dims[axis] > most[axis]) {
        return Err(Error::internal(format!("the device takes images of at most {most:?} voxels")));
    }
    device.image_of(voxels, voxel, dims).map(Arc::new)
}
