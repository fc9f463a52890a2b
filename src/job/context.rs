//! What all jobs on the device thread share: the device, the volumes on it, what is compiled.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use crate::device::cells::{self, Cells};
use crate::device::program::{Source, Variant};
use crate::device::{Buffer, Device};
use crate::error::{Error, Result};
use crate::technique;
use crate::volume::{Volume, Voxels};

/// Device memory for volumes that no job uses just now.
const IDLE_VOLUME_BYTES: usize = 1 << 30;

/// A volume on the device.
pub(super) struct DeviceVolume {
    pub voxels: Buffer,
    pub cells: Cells,
    /// Distances to what views wanted to see of it, newest last: a client that turns a volume asks the same again and again.
    distances: RefCell<Vec<(DistancesKey, Rc<Buffer>)>>,
}

/// Intervals of raw values and the overshoot, as bits.
type DistancesKey = (Vec<[u32; 2]>, u32);

/// Distances that are kept for a volume.
const KEPT_DISTANCES: usize = 4;

impl DeviceVolume {
    fn bytes(&self) -> usize {
        self.voxels.len() + self.cells.ranges.len()
    }

    /// How far each cell is from a value in `intervals`: [`Cells::distances`].
    pub fn distances(&self, device: &mut Device, intervals: &[[f32; 2]], overshoot: f32) -> Result<Rc<Buffer>> {
        let key = (intervals.iter().map(|ends| ends.map(f32::to_bits)).collect(), overshoot.to_bits());
        let mut kept = self.distances.borrow_mut();
        if let Some((_, distances)) = kept.iter().find(|(other, _)| *other == key) {
            return Ok(distances.clone());
        }
        let distances = Rc::new(self.cells.distances(device, intervals, overshoot)?);
        if kept.len() == KEPT_DISTANCES {
            kept.remove(0);
        }
        kept.push((key, distances.clone()));
        Ok(distances)
    }
}

/// Everything on the device that outlives a job.
pub(super) struct DeviceContext {
    pub device: Device,
    volumes: HashMap<usize, (Weak<Volume>, Rc<DeviceVolume>)>,
    /// Rays a millisecond of the last pass, by kernel variant.
    speed: HashMap<Variant, f64>,
}

impl DeviceContext {
    /// Builds the common variants of every technique and launches each once on a tiny case: PoCL compiles at the first launch.
    pub fn warm(mut device: Device) -> Result<Self> {
        let started = Instant::now();
        for source in technique::ALL.iter().map(|t| (t.source)()).chain(cells::sources()) {
            for variant in (source.variants)().iter().take(source.common) {
                warm(&mut device, &source, variant)?;
            }
        }
        tracing::info!(ms = started.elapsed().as_millis() as u64, lanes = device.info().lanes, "kernels are warm");
        Ok(Self { device, volumes: HashMap::new(), speed: HashMap::new() })
    }

    /// The volume on the device, uploaded and its cells built at first use.
    pub fn volume(&mut self, volume: &Arc<Volume>) -> Result<Rc<DeviceVolume>> {
        let key = Arc::as_ptr(volume) as usize;
        if let Some((weak, buffer)) = self.volumes.get(&key)
            && weak.strong_count() > 0
        {
            return Ok(buffer.clone());
        }
        let voxels = self.device.upload(volume.voxels().as_bytes(), 8)?;
        let cells = Cells::new(&mut self.device, &voxels, volume.dims(), volume.voxel_type())?;
        let [wide, high, deep] = volume.dims();
        let most = self.device.info().largest_image_3d;
        let fits = wide <= most[0] && high <= most[1] && deep <= most[2];
        let voxels = if self.device.info().volumes_are_images {
            if !fits {
                return Err(Error::internal(format!("the device takes images of at most {most:?} voxels")));
            }
            self.device.upload_image(volume.voxels(), volume.dims())?
        } else {
            voxels
        };
        let on_device = Rc::new(DeviceVolume { voxels, cells, distances: RefCell::default() });
        self.volumes.insert(key, (Arc::downgrade(volume), on_device.clone()));
        self.tidy();
        Ok(on_device)
    }

    /// Notes how many rays a variant managed.
    pub fn measured(&mut self, variant: &Variant, rays: usize, took: Duration) {
        self.speed.insert(*variant, rays as f64 / (took.as_secs_f64() * 1e3).max(1e-3));
    }

    /// How many rays a millisecond a variant managed of late, if it has run.
    pub fn speed(&self, variant: &Variant) -> Option<f64> {
        self.speed.get(variant).copied()
    }

    /// Lets go of volumes that are gone from the host, and of idle ones past the limit.
    pub fn tidy(&mut self) {
        self.volumes.retain(|_, (weak, _)| weak.strong_count() > 0);
        let idle = |v: &Rc<DeviceVolume>| Rc::strong_count(v) == 1;
        let mut bytes: usize = self.volumes.values().filter(|(_, v)| idle(v)).map(|(_, v)| v.bytes()).sum();
        self.volumes.retain(|_, (_, volume)| {
            let drop = bytes > IDLE_VOLUME_BYTES && idle(volume);
            bytes -= if drop { volume.bytes() } else { 0 };
            !drop
        });
    }
}

/// Builds a variant and launches it once on nothing.
pub(super) fn warm(device: &mut Device, source: &Source, variant: &Variant) -> Result<()> {
    if device.is_built(variant) {
        return Ok(());
    }
    device.build(source, variant)?;
    // Zeroed buffers ask for an image of no pixels or a launch of no histories: compiled, and nothing done.
    let mut zero: Vec<Buffer> = (0..source.arguments).map(|_| device.upload(&[0; 1024], 0)).collect::<Result<_>>()?;
    if let (Some(volume), true) = (source.volume, device.info().volumes_are_images) {
        zero[volume] = device.upload_image(&Voxels::U8(vec![0]), [1; 3])?;
    }
    device.run(variant, &zero.iter().collect::<Vec<_>>(), 1).map(drop)
}
