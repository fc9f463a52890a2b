//! The plan of scattering views: their kernel, parameters and tables.

use std::sync::Arc;

use serde_json::{Value, json};

use super::device::{Density, Scattering};
use super::kernels::{Features, STATE_WORDS, of, permitted};
use super::parameters::{Parameters, Tracking as Asked};
use crate::device::cells::CELL;
use crate::device::program::Variant;
use crate::error::{Error, Result};
use crate::scene;
use crate::scene::bounds::Bounds;
use crate::scene::camera::Camera;
use crate::scene::depth::greatest_along_axes;
use crate::scene::interpolation::Interpolation;
use crate::scene::lights::Lights;
use crate::technique::majorant::{Tracking, march_bias};
use crate::technique::optics::Optics;
use crate::technique::{CellUse, Open, PreparedView, Random, Settings, Subject, View, ViewPlan};
use crate::volume::Volume;

/// The smallest step as a part of the voxels along an axis; shorter steps are lost in single precision.
const LOST: f64 = 1.0 / (1u64 << 20) as f64;
/// The number of voxels that give the mean density.
const MEAN_OF: usize = 4096;

/// The part of the scattered light that a picture may lack without a warning.
const SCATTERINGS_MISSING: f64 = 0.01;

/// A scattering view with valid parameters.
#[derive(Clone)]
pub(in crate::technique) struct Scatterer {
    pub(super) kernel: &'static str,
    pub(super) parameters: Parameters,
    pub(super) lights: Lights,
}

impl Scatterer {
    /// Checks the parameters of the technique `kernel`.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the field under `at`.
    pub fn new(kernel: &'static str, parameters: Parameters, at: &str) -> Result<Self> {
        parameters.check(at)?;
        let lights = Lights::from_request(parameters.lights.as_deref(), &format!("{at}/lights"))?;
        if parameters.medium.index != 1.0 && (kernel != "volume_path" || lights.count() > 0) {
            let detail = "light that is bent at the faces cannot be aimed at";
            let permitted = "1; in volume_path under a sky alone, 1 to 4";
            return Err(Error::invalid(format!("{at}/medium/index"), detail, permitted));
        }
        if !parameters.next_event
            && let Some(i) = lights.first_without_size()
        {
            let detail = "no path meets a light without size by chance";
            let permitted = "true, or lights that have a size";
            let field = if parameters.lights.is_some() { format!("; /lights/{i} has none") } else { String::new() };
            return Err(Error::invalid(format!("{at}/next_event"), detail.to_owned() + &field, permitted));
        }
        Ok(Self { kernel, parameters, lights })
    }

    /// True if the density is the same everywhere.
    fn is_box(volume: &Volume) -> bool {
        volume.non_finite() == 0 && volume.range()[0] == volume.range()[1]
    }

    fn features(&self, volume: &Volume) -> Result<(&'static Features, String)> {
        let (p, interpolation) = (&self.parameters, self.parameters.interpolation());
        let any = matches!(p.tracking, Asked::Auto | Asked::Exact);
        let (wanted, why) = match p.tracking {
            _ if any && Self::is_box(volume) => (
                of(Density::Constant, Tracking::Exact, Interpolation::Nearest),
                "exact: from face to face a free path is a closed form",
            ),
            Asked::Auto => {
                (of(Density::Grid, Tracking::Delta, interpolation), "delta: with the majorants of macro-cells")
            }
            Asked::Exact => (of(Density::Grid, Tracking::Exact, interpolation), "exact, as asked"),
            Asked::March => {
                (of(Density::Grid, Tracking::March, interpolation), "march, as asked: biased by up to a step a path")
            }
            Asked::Delta => (of(Density::Grid, Tracking::Delta, interpolation), "delta, as asked"),
            Asked::Weighted => (of(Density::Grid, Tracking::Weighted, interpolation), "weighted, as asked"),
        };
        Ok((permitted(self.kernel, wanted)?, format!("tracking {why}")))
    }

    /// Refuses a march whose step is lost in the rounding of positions along an axis: it would never end.
    fn check_march(&self, volume: &Volume) -> Result<()> {
        let largest = volume.spacing().into_iter().fold(0.0, f64::max);
        let most = volume.dims().into_iter().max().unwrap_or(1) as f64;
        let least = most * LOST * largest / volume.smallest_side();
        if self.parameters.tracking != Asked::March || self.parameters.march_step_voxels >= least {
            return Ok(());
        }
        let at = format!("/{}/march_step_voxels", self.kernel);
        Err(Error::invalid(at, "too short for voxels of so different sides", format!("at least {least:.3}")))
    }

    /// The mean density of a few thousand voxels.
    fn mean_density(&self, volume: &Volume) -> Result<f64> {
        let (n, values) = (volume.voxel_count(), volume.values()?);
        let stride = (n / MEAN_OF).max(1) | 1;
        let density = |i: usize| {
            let value = values.of(i);
            if value.is_finite() { self.parameters.medium.density_of(value) } else { 0.0 }
        };
        let count = n.div_ceil(stride) as f64;
        Ok((0..n).step_by(stride).map(density).sum::<f64>() / count)
    }

    /// The cells of the DDA, and the majorant of free paths within them.
    fn cells(&self, volume: &Volume, features: &Features, greatest_sigma: f64, device: &mut Scattering) {
        let is = |feature: (&'static str, i32)| features.contains(&feature);
        let p = &self.parameters;
        let grid = is(("DENSITY", Density::Grid.code()));
        let by_majorants = [Tracking::Delta, Tracking::Weighted].iter().any(|t| is(("TRACKING", t.code())));
        let local = grid && by_majorants && p.majorant.grid == "local";
        let side = match grid && is(("TRACKING", Tracking::Exact.code())) {
            true => Some(1),
            false if local => Some(CELL),
            false => None,
        };
        for a in 0..3 {
            let n = volume.dims()[a];
            device.cells[a] = side.map_or(1, |s| n.div_ceil(s) as i32);
            device.voxels_per_cell[a] = side.unwrap_or(n) as f32;
            device.cells_per_voxel[a] = if device.cells[a] > 1 { 1.0 / device.voxels_per_cell[a] } else { 0.0 };
        }
        let scale = if grid { p.majorant.scale } else { 1.0 };
        device.whole = i32::from(!local);
        let density = if local { 1.0 } else { p.medium.greatest_density(volume) };
        device.majorant = (greatest_sigma * scale * density) as f32;
    }

    fn sky(&self, volume: &Volume, device: &mut Scattering) {
        let Some(sky) = self.lights.sky() else { return };
        let [zenith, horizon, ground] = sky.radiance.map(|c| c.map(|v| v as f32));
        (device.sky_zenith, device.sky_horizon, device.sky_ground) = (zenith, horizon, ground);
        (device.sky, device.sky_visible) = (1, i32::from(sky.visible));
        device.sky_up = sky.up.unwrap_or_else(|| Bounds::from(volume).up()).as_vec3().to_array();
    }
}

impl View for Scatterer {
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>> {
        let volume = subject.needed_volume()?.clone();
        self.check_march(&volume)?;
        let (features, why) = self.features(&volume)?;
        let sigma = self.parameters.medium.sigma_t_per_unit(&volume);
        let plan = ViewPlan {
            variant: Variant::new(self.kernel, Some(volume.voxel_type()), features),
            cells: CellUse::Ranges,
            step: (CELL as f64 * volume.smallest_side()) as f32,
            state_words: STATE_WORDS,
            stepless: true,
            cheap: false,
            biased: self.parameters.tracking == Asked::March,
            extremum: false,
            opacity_threshold: 1.0,
            reasons: vec![why, format!("sigma_t_per_unit: {:.6}, {:.6}, {:.6}", sigma[0], sigma[1], sigma[2])],
        };
        let medium = &self.parameters.medium;
        Ok(Arc::new(Prepared {
            depths: greatest_along_axes(&volume, |v| medium.density_of(v))?,
            mean_density: self.mean_density(&volume)?,
            scatterer: self.clone(),
            volume,
            features,
            sigma_t_per_unit: sigma,
            plan,
        }))
    }

    fn clips(&self) -> bool {
        false
    }

    fn random(&self) -> Option<Random> {
        let p = &self.parameters;
        Some(Random { adaptive: p.adaptive, clamp_luminance: p.clamp_luminance })
    }
}

/// A scattering view of a volume.
struct Prepared {
    scatterer: Scatterer,
    volume: Arc<Volume>,
    features: &'static Features,
    sigma_t_per_unit: [f64; 3],
    /// The greatest integral of the density along each axis, world units.
    depths: [f64; 3],
    mean_density: f64,
    plan: ViewPlan,
}

impl PreparedView for Prepared {
    fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn volume(&self) -> Option<&Arc<Volume>> {
        Some(&self.volume)
    }

    fn settings(&self, open: &Open<'_>) -> Option<Settings> {
        Some(self.scatterer.settings_of(&self.volume, self.depths, open))
    }

    fn optics(&self) -> Option<Optics> {
        Some(self.scatterer.optics_of(&self.volume, self.depths))
    }

    fn parameters(&self, _camera: &Camera) -> Vec<u8> {
        let (view, volume, sigma) = (&self.scatterer, &*self.volume, self.sigma_t_per_unit);
        let (p, m, lights) = (&view.parameters, &view.parameters.medium, &view.lights);
        let most = sigma.into_iter().fold(0.0, f64::max);
        let [scale, offset, density_most] = m.density();
        let world_from_index = volume.world_from_index();
        let emission = m.emission.rgb();
        let phase = m.phase.numbers(&mut Vec::new(), lights.count() * scene::lights::LIGHT_NUMBERS);
        let mut device = Scattering {
            world_from_index: std::array::from_fn(|i| world_from_index.to_cols_array()[i] as f32),
            density_scale: (scale * volume.slope()) as f32,
            density_offset: (scale * volume.inter() + offset) as f32,
            density_most: density_most as f32,
            density_box: m.greatest_density(volume) as f32,
            sigma_t: sigma.map(|v| v as f32),
            sigma_most: most as f32,
            colour: sigma.map(|v| if most > 0.0 { (v / most) as f32 } else { 1.0 }),
            chromatic: i32::from(sigma.iter().any(|v| *v != sigma[0])),
            march_step: (p.march_step_voxels * volume.smallest_side()) as f32,
            albedo: m.albedo.rgb().map(|v| v as f32),
            emission: std::array::from_fn(|i| if sigma[i] > 0.0 { (emission[i] / sigma[i]) as f32 } else { 0.0 }),
            index: m.index as f32,
            phase,
            lights: lights.count() as i32,
            discs: i32::from(lights.any_with_size()),
            lit_by_chance: i32::from(
                lights.any_with_size() || lights.sky().is_some() || emission.iter().any(|e| *e > 0.0),
            ),
            next_event: i32::from(p.next_event),
            max_scatterings: p.max_scatterings.map_or(i32::MAX, |n| n as i32),
            roulette_threshold: p.roulette_threshold as f32,
            clamp_luminance: p.clamp_luminance.unwrap_or(0.0) as f32,
            equiangular: i32::from(p.equiangular),
            sigma_mean: (most * self.mean_density) as f32,
            ..Scattering::default()
        };
        view.cells(volume, self.features, most, &mut device);
        view.sky(volume, &mut device);
        bytemuck::bytes_of(&device).to_vec()
    }

    /// The lights, then the rows of a tabulated phase function.
    fn table(&self, _step: f32) -> Vec<u32> {
        let bounds = Bounds::from(&*self.volume);
        let mut table = self.scatterer.lights.table(bounds.radius(), bounds.up());
        let mut rows = Vec::new();
        self.scatterer.parameters.medium.phase.numbers(&mut rows, table.len());
        table.extend(rows);
        table.into_iter().map(f32::to_bits).collect()
    }

    fn warnings(&self) -> Vec<Value> {
        let (p, volume) = (&self.scatterer.parameters, &*self.volume);
        let mut warnings = Vec::new();
        let mut warn = |code: &str, message: &str, measured: f64, bound: f64| {
            warnings.push(json!({"code": code, "message": message, "measured": measured, "bound": bound}));
        };
        let least = volume.range()[0];
        if p.medium.density_window.is_none() && least < 0.0 {
            warn("negative_density", "values below 0 are rendered as empty; give medium a density_window", least, 0.0);
        }
        let tracked = matches!(p.tracking, Asked::Delta | Asked::Auto);
        if tracked && p.majorant.scale < 1.0 && !Scatterer::is_box(volume) {
            warn("broken_majorant", "majorants are below the extinction: biased", p.majorant.scale, 1.0);
        }
        if p.tracking == Asked::March {
            let depth = p.march_step_voxels * volume.smallest_side();
            let sigma = self.sigma_t_per_unit.into_iter().fold(0.0, f64::max);
            let h = depth * sigma * p.medium.greatest_density(volume);
            let message = "the march's free paths are whole steps: where it is densest they are too long by this part";
            warn("march_bias", message, march_bias(h), 0.0);
        }
        let missing = self.scatterer.missing(volume, self.depths);
        if missing > SCATTERINGS_MISSING {
            let message = "this part of what a slab of the same depth would send back is scattered more often than is followed here";
            warn("multiple_scattering_missing", message, missing, SCATTERINGS_MISSING);
        }
        warnings
    }
}
