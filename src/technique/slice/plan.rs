//! The plan of `slice`: its kernels, parameters and tables.

use std::sync::Arc;

use glam::DVec3;

use super::{Mode, Parameters, Plane, Slice, TECHNIQUE};
use crate::device::numbers::define;
use crate::device::program::{Source, Variant, each_voxel_type, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::window::{Output, WINDOW_SIZE, Window};
use crate::technique::{CellUse, PreparedView, Subject, View, ViewPlan, view_words};
use crate::volume::{Volume, VoxelType};

type Features = [(&'static str, i32); 1];

/// Every interpolation may be built; the first is built before the service is ready.
static FEATURES: [Features; 4] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        [("INTERPOLATION", Trilinear.code())],
        [("INTERPOLATION", Nearest.code())],
        [("INTERPOLATION", BSpline.code())],
        [("INTERPOLATION", CatmullRom.code())],
    ]
};

fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

pub(super) fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: || view_words() + &define("WINDOW_SIZE", WINDOW_SIZE),
        structs: || vec![DeviceView::LAYOUT, Slice::LAYOUT],
        variants: || each_voxel_type(TECHNIQUE.name, &FEATURES),
        common: VoxelType::ALL.len(),
    }
}

impl Plane {
    /// A point of the plane and its unit normal, in the world.
    fn resolve(&self, volume: &Volume, camera: &Camera) -> (DVec3, DVec3) {
        let axis = match self.axis.as_deref() {
            Some("x") => DVec3::X,
            Some("y") => DVec3::Y,
            Some(_) => DVec3::Z,
            None => {
                let normal = self.normal.map(DVec3::from).and_then(DVec3::try_normalize);
                return (self.point.map_or(DVec3::ZERO, DVec3::from), normal.unwrap_or(camera.towards_eye()));
            }
        };
        let extent = volume.world_half_size().dot(axis);
        let place = self.fraction.map_or(self.position.unwrap_or(0.0), |f| (2.0 * f - 1.0) * extent);
        (axis * place, axis)
    }
}

impl Parameters {
    fn window(&self, volume: &Volume) -> Result<Window> {
        self.window.as_ref().map_or_else(|| Window::suitable(volume), |w| w.check("/slice/window"))
    }
}

/// A slice of a volume.
struct Prepared {
    parameters: Parameters,
    volume: Arc<Volume>,
    window: Window,
    plan: ViewPlan,
}

impl View for Parameters {
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>> {
        let volume = subject.needed_volume()?.clone();
        let window = self.window(&volume)?;
        let wanted = [("INTERPOLATION", self.interpolation.unwrap_or(Interpolation::Trilinear).code())];
        let features = permitted(wanted)?;
        let mut reasons = vec![format!("window: {window}")];
        if self.window.is_none() && self.output == Output::Color {
            reasons.push(volume.contents()?.words());
        }
        let plan = ViewPlan {
            variant: Variant::new(TECHNIQUE.name, Some(volume.voxel_type()), features),
            cells: CellUse::None,
            step: volume.smallest_side() as f32,
            state_words: 0,
            stepless: true,
            cheap: true,
            biased: false,
            extremum: self.mode != Mode::Mean,
            opacity_threshold: 1.0,
            reasons,
        };
        Ok(Arc::new(Prepared { parameters: self.clone(), volume, window, plan }))
    }
}

impl PreparedView for Prepared {
    fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn volume(&self) -> Option<&Arc<Volume>> {
        Some(&self.volume)
    }

    fn parameters(&self, camera: &Camera) -> Vec<u8> {
        let (own, volume) = (&self.parameters, &self.volume);
        let (point, normal) = own.plane.resolve(volume, camera);
        let world_from_index = volume.world_from_index();
        let [a, b, c] = (world_from_index.matrix3.transpose() * normal).to_array();
        let d = normal.dot(world_from_index.translation - point);
        let [window_scale, window_offset] = self.window.scale_and_offset();
        let wanted = if own.mode == Mode::Minimum { -1.0 } else { 1.0 };
        let device = Slice {
            plane_index: [a, b, c, d].map(|v| v as f32),
            normal_index: volume.index_from_world().transform_vector3(normal).as_vec3().to_array(),
            half_thickness: (0.5 * own.thickness) as f32,
            peaks: i32::from(own.mode != Mode::Mean),
            sign: (wanted * volume.slope().signum()) as f32,
            slope: volume.slope() as f32,
            inter: volume.inter() as f32,
            window_scale,
            window_offset,
            raw_values: i32::from(own.output == Output::Value),
        };
        bytemuck::bytes_of(&device).to_vec()
    }

    fn table(&self, _step: f32) -> Vec<u32> {
        self.parameters.color_map.table(self.parameters.invert)
    }

    fn set_shared(&self, _camera: &Camera, view: &mut DeviceView) {
        view.jittered = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted([("INTERPOLATION", Interpolation::BSpline.code())]).is_ok());
        let said = permitted([("INTERPOLATION", 7)]).expect_err("not listed").to_string();
        assert!(said.contains("slice INTERPOLATION=7"), "{said}");
    }
}
