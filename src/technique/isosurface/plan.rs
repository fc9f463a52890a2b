//! The plan of `isosurface`: its kernels, parameters and tables.

use std::sync::Arc;

use serde_json::{Value, json};

use super::surfaces::{self, Surface};
use super::{Isosurface, Normals, Output, Parameters, Sampling, TECHNIQUE};
use crate::device::Resume;
use crate::device::program::{Source, Variant, each_voxel_type, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene;
use crate::scene::bounds::Bounds;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::light::LightRequest;
use crate::technique::stepping::{Way, stepping};
use crate::technique::steps::coarse_step;
use crate::technique::{CellUse, Open, PreparedView, Settings, Subject, View, ViewPlan, view_words};
use crate::volume::{Volume, VoxelType};

/// Words of a lane that a launch leaves to the next: a packet's search.
const STATE_WORDS: usize = 7;

/// The tolerance of a crossing, in voxels.
const TOLERANCE_VOXELS: f64 = 1e-4;
/// The same as a part of the path through the volume: a few times the resolution of single precision.
const TOLERANCE_OF_WAY: f64 = 3e-7;
/// A ray through transparent surfaces ends at this opacity.
const OPACITY_THRESHOLD: f64 = 0.999;

type Features = [(&'static str, i32); 2];

const fn features(interpolation: Interpolation, layered: bool) -> Features {
    [("INTERPOLATION", interpolation.code()), ("LAYERED", layered as i32)]
}

/// Every set of features that may be built; the first is built before the service is ready.
static FEATURES: [Features; 7] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        features(Trilinear, false),
        features(Trilinear, true),
        features(Nearest, false),
        features(BSpline, false),
        features(BSpline, true),
        features(CatmullRom, false),
        features(CatmullRom, true),
    ]
};

fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

pub(super) fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: || view_words() + &Resume::opencl_text_of_beams("SEARCH", STATE_WORDS),
        structs: || vec![DeviceView::LAYOUT, Isosurface::LAYOUT],
        variants: || each_voxel_type(TECHNIQUE.name, &FEATURES),
        common: VoxelType::ALL.len(),
    }
}

impl Parameters {
    fn interpolation(&self) -> Interpolation {
        match self.sampling {
            Sampling::Nearest => Interpolation::Nearest,
            Sampling::Refined => self.interpolation.unwrap_or(Interpolation::Trilinear),
        }
    }

    /// The surfaces by ascending raw value.
    fn surfaces(&self, volume: &Volume) -> Result<Vec<Surface>> {
        let isovalue = || self.isovalue.map_or_else(|| surfaces::default_isovalue(volume), Ok);
        let mut surfaces = match &self.surfaces {
            Some(surfaces) => surfaces.clone(),
            None => vec![Surface::new(isovalue()?, self.color, self.opacity)],
        };
        surfaces.sort_by(|a, b| (a.isovalue * volume.slope()).total_cmp(&(b.isovalue * volume.slope())));
        Ok(surfaces)
    }

    fn layered(&self, surfaces: &[Surface]) -> bool {
        surfaces.len() > 1 || self.output == Output::Color && surfaces[0].opacity < 1.0
    }

    /// The intervals of values that a cell must meet to contain a crossing.
    fn wanted(&self, surfaces: &[Surface]) -> Vec<[f64; 2]> {
        let least = surfaces.iter().map(|s| s.isovalue).fold(f64::INFINITY, f64::min);
        match self.sampling {
            Sampling::Nearest => vec![[least, f64::MAX]],
            Sampling::Refined => surfaces.iter().map(|s| [s.isovalue; 2]).collect(),
        }
    }
}

/// The surfaces of a volume.
struct Prepared {
    parameters: Parameters,
    volume: Arc<Volume>,
    /// The surfaces, by ascending raw value.
    surfaces: Vec<Surface>,
    plan: ViewPlan,
}

impl View for Parameters {
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>> {
        let volume = subject.needed_volume()?.clone();
        let surfaces = self.surfaces(&volume)?;
        let wanted = features(self.interpolation(), self.layered(&surfaces));
        let features = permitted(wanted)?;
        let smallest = volume.smallest_side();
        let values: Vec<String> = surfaces.iter().map(|s| format!("{:?}", s.isovalue as f32)).collect();
        let mut reasons = vec![format!("isovalues: {}", values.join(", "))];
        if self.isovalue.is_none() && self.surfaces.is_none() {
            reasons.push(volume.contents()?.words());
        }
        if !self.empty_space_skipping {
            reasons.push("every sample is taken: skipping is off".into());
        }
        let plan = ViewPlan {
            variant: Variant::new(TECHNIQUE.name, Some(volume.voxel_type()), features),
            cells: if self.empty_space_skipping { CellUse::Distances(self.wanted(&surfaces)) } else { CellUse::None },
            step: (self.step_voxels * smallest) as f32,
            state_words: STATE_WORDS,
            stepless: false,
            cheap: false,
            biased: false,
            extremum: false,
            opacity_threshold: if self.layered(&surfaces) { OPACITY_THRESHOLD } else { 1.0 },
            reasons,
        };
        Ok(Arc::new(Prepared { parameters: self.clone(), volume, surfaces, plan }))
    }
}

impl PreparedView for Prepared {
    fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn volume(&self) -> Option<&Arc<Volume>> {
        Some(&self.volume)
    }

    fn settings(&self, open: &Open<'_>) -> Option<Settings> {
        let ways = [Way::as_given(&self.parameters)];
        stepping(TECHNIQUE.name, open, &ways, None, |p, step| Arc::new(Parameters { step_voxels: step, ..p.clone() }))
    }

    fn parameters(&self, _camera: &Camera) -> Vec<u8> {
        let (own, volume, surfaces) = (&self.parameters, &self.volume, &self.surfaces);
        let (smallest, radius) = (volume.smallest_side(), Bounds::from(&**volume).radius());
        let occlusion = own.ambient_occlusion.as_ref();
        let mut device = Isosurface {
            sign: volume.slope().signum() as f32,
            surfaces: surfaces.len() as i32,
            transmittance_floor: (1.0 - OPACITY_THRESHOLD) as f32,
            tolerance: (TOLERANCE_VOXELS * smallest).max(TOLERANCE_OF_WAY * radius) as f32,
            analytic: i32::from(own.normals == Normals::Analytic),
            depth: i32::from(own.output == Output::Depth),
            occlusion_rays: occlusion.map_or(0, |o| o.rays as i32),
            occlusion_radius: occlusion.and_then(|o| o.radius).unwrap_or(0.1 * scene::mean_side(volume)) as f32,
            occlusion_start: (0.5 * smallest) as f32,
            ..Isosurface::default()
        };
        for (i, surface) in surfaces.iter().enumerate() {
            device.isovalue[i] = ((surface.isovalue - volume.inter()) / volume.slope()) as f32;
            device.color[3 * i..3 * i + 3].copy_from_slice(&surface.color.map(|c| c as f32));
            device.opacity[i] = if own.output == Output::Depth { 1.0 } else { surface.opacity as f32 };
        }
        bytemuck::bytes_of(&device).to_vec()
    }

    fn set_shared(&self, camera: &Camera, view: &mut DeviceView) {
        // Crossings are searched for from one end of a step to the other; the sample is not inside it.
        (view.jittered, view.place) = (0, 0.0);
        let shadowed = self.parameters.ambient_occlusion.is_some();
        let default = || if shadowed { LightRequest::diffuse_sky() } else { Default::default() };
        self.parameters.light.clone().unwrap_or_else(default).apply(camera, view);
    }

    fn warnings(&self) -> Vec<Value> {
        let [low, high] = self.volume.range();
        let outside = |s: &&Surface| !(low..=high).contains(&s.isovalue);
        let warning = |s: &Surface| {
            let message =
                format!("no voxel is on the other side of {}: the values go from {low} to {high}", s.isovalue);
            json!({"code": "isovalue_outside_range", "message": message, "measured": s.isovalue, "bound": [low, high]})
        };
        let too_long = coarse_step(self.parameters.step_voxels);
        self.surfaces.iter().filter(outside).map(warning).chain(too_long).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted(features(Interpolation::BSpline, true)).is_ok());
        let said = permitted(features(Interpolation::Nearest, true)).expect_err("not listed").to_string();
        assert!(said.contains("isosurface INTERPOLATION=0 LAYERED=1"), "{said}");
    }
}
