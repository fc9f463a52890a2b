//! The plan of `projection`: its kernels, parameters and tables.

use std::sync::Arc;

use serde_json::{Value, json};

use super::{DeviceMode, Mode, Parameters, Projection, TECHNIQUE};
use crate::device::Resume;
use crate::device::enums::DeviceEnum;
use crate::device::numbers::define;
use crate::device::program::{Source, Variant, each_voxel_type, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::window::{Output, WINDOW_SIZE, Window};
use crate::technique::stepping::{Way, stepping};
use crate::technique::steps::coarse_step;
use crate::technique::view::in_words;
use crate::technique::{CellUse, Open, PreparedView, Settings, Subject, View, ViewPlan, view_words};
use crate::volume::{DataKind, Volume, VoxelType};

/// Words of a lane that a launch leaves to the next: a packet's best value.
const STATE_WORDS: usize = 1;

/// The optical depth of a bright ray in an X-ray by default. Its transmittance is about an eighth.
const XRAY_OPTICAL_DEPTH: f64 = 2.0;

type Features = [(&'static str, i32); 2];

const fn features(interpolation: Interpolation, walked: bool) -> Features {
    [("INTERPOLATION", interpolation.code()), ("WALKED", walked as i32)]
}

/// Every set of features that may be built; the first two are built before the service is ready.
static FEATURES: [Features; 8] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        features(Trilinear, false),
        features(Trilinear, true),
        features(Nearest, false),
        features(Nearest, true),
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
        words: || {
            view_words()
                + &define("WINDOW_SIZE", WINDOW_SIZE)
                + &DeviceMode::opencl_text()
                + &Resume::opencl_text_of_beams("PROJECTION_BEAM", STATE_WORDS)
        },
        structs: || vec![DeviceView::LAYOUT, Projection::LAYOUT],
        variants: || each_voxel_type(TECHNIQUE.name, &FEATURES),
        common: 2 * VoxelType::ALL.len(),
    }
}

impl Parameters {
    pub(super) fn peaks(&self) -> bool {
        matches!(self.mode, Mode::Maximum | Mode::Minimum)
    }

    fn interpolation(&self) -> Interpolation {
        self.interpolation.unwrap_or(Interpolation::Trilinear)
    }

    pub(super) fn is_spline(&self) -> bool {
        matches!(self.interpolation(), Interpolation::BSpline | Interpolation::CatmullRom)
    }

    fn walked(&self) -> bool {
        !self.peaks() || self.exact.unwrap_or(self.interpolation() == Interpolation::Nearest)
    }

    fn zero_value(&self, volume: &Volume) -> Result<f64> {
        let contents = volume.contents()?;
        let suits = if contents.kind == DataKind::Hounsfield { -1000.0 } else { contents.data[0].min(0.0) };
        Ok(self.zero_value.unwrap_or(suits))
    }

    /// The extinction per unit and value of an X-ray image; 0 for other projections, which have none.
    fn sigma_per_value(&self, volume: &Volume) -> Result<f64> {
        if self.mode != Mode::Xray {
            return Ok(0.0);
        }
        if let Some(given) = self.sigma_per_value {
            return Ok(given);
        }
        let mean = (volume.bright_mean()? - self.zero_value(volume)?).abs();
        let mean = if mean > 0.0 { mean } else { 1.0 };
        Ok(XRAY_OPTICAL_DEPTH / (mean * scene::mean_side(volume)))
    }

    fn window(&self, volume: &Volume) -> Result<Window> {
        if let Some(window) = &self.window {
            return window.check("/projection/window");
        }
        let (low, side) = (volume.contents()?.data[0], scene::mean_side(volume));
        Ok(match self.mode {
            Mode::Maximum | Mode::Minimum => Window::suitable(volume)?,
            Mode::Mean => Window::of(low, volume.bright_mean()?),
            Mode::Sum => Window::of(low.min(0.0) * side, volume.bright_mean()?.max(0.0) * side),
            Mode::Xray => Window::of(0.0, 1.0),
        })
    }
}

/// A projection of a volume.
struct Prepared {
    parameters: Parameters,
    volume: Arc<Volume>,
    window: Window,
    /// The extinction per unit and value of an X-ray image, and the value without extinction.
    absorption: [f64; 2],
    plan: ViewPlan,
}

impl Parameters {
    /// Half an entry of the table of colours, if samples are taken and become colours.
    fn resolution(&self, window: &Window) -> Option<f64> {
        let plain = !self.walked() && self.interpolation() == Interpolation::Trilinear && self.output != Output::Value;
        let [per_value, _] = window.scale_and_offset();
        plain.then(|| 0.5 / f64::from(per_value).abs())
    }

    fn plan(&self, volume: &Volume, window: &Window, sigma: f64) -> Result<ViewPlan> {
        let wanted = features(self.interpolation(), self.walked());
        let features = permitted(wanted)?;
        let smallest = volume.smallest_side();
        let mut reasons = vec![format!("window: {window}")];
        if self.window.is_none() && self.output == Output::Color {
            reasons.push(volume.contents()?.words());
        }
        reasons.push(match (self.walked(), self.empty_space_skipping) {
            (true, _) => "exact for the interpolant: the step plays no part".into(),
            (_, true) => "what cannot show more than was seen is left out".into(),
            (_, false) => "every sample is taken: skipping is off".into(),
        });
        if self.mode == Mode::Xray {
            let zero = self.zero_value(volume)?;
            reasons.push(format!("extinction {sigma:.4e} per unit and value above {zero}"));
        }
        Ok(ViewPlan {
            variant: Variant::new(TECHNIQUE.name, Some(volume.voxel_type()), features),
            cells: CellUse::Ranges,
            step: (if self.walked() { 1.0 } else { self.step_voxels } * smallest) as f32,
            state_words: STATE_WORDS,
            stepless: self.walked(),
            cheap: false,
            biased: false,
            extremum: self.peaks(),
            opacity_threshold: 1.0,
            reasons,
        })
    }

    /// The device's parameters for a volume.
    fn on_device(&self, volume: &Volume, window: &Window, [sigma_per_value, zero_value]: [f64; 2]) -> Projection {
        let [window_scale, window_offset] = window.scale_and_offset();
        let wanted = if self.mode == Mode::Minimum { -1.0 } else { 1.0 };
        Projection {
            mode: self.mode.on_device().code(),
            sign: (wanted * volume.slope().signum()) as f32,
            slope: volume.slope() as f32,
            inter: volume.inter() as f32,
            sigma_per_value: sigma_per_value as f32,
            zero_value: zero_value as f32,
            window_scale,
            window_offset,
            raw_values: i32::from(self.output == Output::Value),
            skipping: i32::from(self.empty_space_skipping),
        }
    }
}

impl View for Parameters {
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>> {
        let volume = subject.needed_volume()?;
        let (volume, words) = in_words(volume, self.resolution(&self.window(volume)?));
        let window = self.window(&volume)?;
        let absorption = [self.sigma_per_value(&volume)?, self.zero_value(&volume)?];
        let mut plan = self.plan(&volume, &window, absorption[0])?;
        plan.reasons.extend(words);
        Ok(Arc::new(Prepared { parameters: self.clone(), volume, window, absorption, plan }))
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
        let given = &self.parameters;
        let exact = Parameters { exact: Some(true), ..given.clone() };
        let is_open = !given.walked() && !given.is_spline() && open.leaves("exact");
        let change = Some(("exact", json!(true)));
        let exact = is_open.then_some(Way { words: ", exact", change, parameters: exact });
        stepping(TECHNIQUE.name, open, &[Way::as_given(given)], exact, |p, step| {
            Arc::new(Parameters { step_voxels: step, ..p.clone() })
        })
    }

    fn warnings(&self) -> Vec<Value> {
        let walked = self.parameters.walked();
        coarse_step(self.parameters.step_voxels).filter(|_| !walked).into_iter().collect()
    }

    fn parameters(&self, _camera: &Camera) -> Vec<u8> {
        bytemuck::bytes_of(&self.parameters.on_device(&self.volume, &self.window, self.absorption)).to_vec()
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
        assert!(permitted(features(Interpolation::BSpline, true)).is_ok());
        let said = permitted([("INTERPOLATION", 7), ("WALKED", 0)]).expect_err("not listed").to_string();
        assert!(said.contains("projection INTERPOLATION=7 WALKED=0"), "{said}");
    }
}
