//! Volumes whose voxels are on the device, as those of a field are. The host reads them when somebody asks for them, and not before.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::words::WordScale;
use super::{NewVolume, Volume, Voxels};
use crate::error::Result;

/// A grid of floats on a device, x fastest, then y, then z.
pub trait DeviceGrid: Any + Send + Sync {
    /// Reads its values.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device fails.
    fn read(&self) -> Result<Vec<f32>>;
}

/// The statistics of a grid of floats, as its device found them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridStatistics {
    /// The least and the greatest finite value; `None` if no value is finite.
    pub range: Option<[f32; 2]>,
    /// Values that were not finite. They are NaN now.
    pub non_finite: u64,
    /// The quantile [`GridStatistics::UPPER`] of the finite values; 0 if there are none.
    pub upper: f32,
}

impl GridStatistics {
    /// The part of a field's values that are at most its upper value. The few brightest voxels, next to the source, are above it.
    pub const UPPER: f64 = 0.998;
}

/// The voxels of a volume on the device.
pub(super) struct Away {
    values: Arc<GridValues>,
    /// The words as which the volume takes the values, if it does.
    words: Option<(WordScale, OnceLock<Voxels>)>,
}

/// The values of a grid, on the device, on the host, or both.
struct GridValues {
    grid: Mutex<Option<Arc<dyn DeviceGrid>>>,
    here: OnceLock<Voxels>,
}

impl GridValues {
    fn grid(&self) -> Option<Arc<dyn DeviceGrid>> {
        self.grid.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn get(&self) -> Result<&Voxels> {
        // Values leave the device after they have been read.
        if let (None, Some(grid)) = (self.here.get(), self.grid()) {
            let read = Voxels::F32(grid.read()?);
            return Ok(self.here.get_or_init(|| read));
        }
        Ok(self.here.get_or_init(|| Voxels::F32(Vec::new())))
    }
}

impl Away {
    fn new(grid: Arc<dyn DeviceGrid>) -> Self {
        Self { values: Arc::new(GridValues { grid: Mutex::new(Some(grid)), here: OnceLock::new() }), words: None }
    }

    /// The same values as words.
    pub fn in_words(&self, scale: WordScale) -> Self {
        Self { values: self.values.clone(), words: Some((scale, OnceLock::new())) }
    }

    /// The values, not as words.
    pub fn values(&self) -> Result<&Voxels> {
        self.values.get()
    }

    /// The voxels in the volume's own type.
    pub fn voxels(&self) -> Result<&Voxels> {
        let values = self.values.get()?;
        match &self.words {
            Some((scale, made)) => Ok(made.get_or_init(|| scale.words(values))),
            None => Ok(values),
        }
    }
}

impl fmt::Debug for Away {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Away").field("here", &self.values.here.get().is_some()).field("words", &self.words).finish()
    }
}

impl Volume {
    /// A volume of floats on a device. `parts` are those of the volume, without voxels.
    ///
    /// # Errors
    /// As [`Volume::new`].
    pub fn on_device(parts: NewVolume, grid: Arc<dyn DeviceGrid>, statistics: &GridStatistics) -> Result<Self> {
        let (parts, world_from_index) = parts.placed()?;
        let range = statistics.range.map_or([0.0; 2], |ends| ends.map(f64::from));
        let upper = Some(f64::from(statistics.upper));
        let away = Some(Away::new(grid));
        let made = Self::of_parts(parts, world_from_index, range, statistics.non_finite);
        Ok(Self { upper, away, ..made })
    }

    /// The grid on the device, and the words as which this volume takes its values; `None` if the voxels are on the host only.
    pub fn device_grid(&self) -> Option<(Arc<dyn DeviceGrid>, Option<WordScale>)> {
        let away = self.away.as_ref()?;
        Some((away.values.grid()?, away.words.as_ref().map(|(scale, _)| *scale)))
    }

    /// True if the voxels are on the host: not before somebody has asked for those of a field.
    pub fn is_on_host(&self) -> bool {
        self.away.as_ref().is_none_or(|away| away.values.here.get().is_some())
    }

    /// Takes the voxels to the host and gives the device's memory back once no kernel needs it.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if the device fails; the voxels then stay where they are.
    pub fn leave_device(&self) -> Result<()> {
        let Some(away) = &self.away else { return Ok(()) };
        away.values.get()?;
        away.values.grid.lock().unwrap_or_else(PoisonError::into_inner).take();
        Ok(())
    }
}
