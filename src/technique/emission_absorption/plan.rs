//! The plan of `emission_absorption`: its kernels, parameters and tables.

use std::sync::Arc;

use serde_json::{Value, json};

use super::pieces::pieces;
use super::{EmissionAbsorption, Parameters, TECHNIQUE, regions};
use crate::device::Resume;
use crate::device::program::{Source, Variant, each_voxel_type, listed};
use crate::device::structs::{DeviceStruct, View as DeviceView};
use crate::error::Result;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::presets;
use crate::scene::transfer::{TABLE_SIZE, TransferFunction, pack};
use crate::technique::stepping::{Way, stepping};
use crate::technique::steps::coarse_step;
use crate::technique::{CellUse, Open, Settings, View, ViewPlan, view_words};
use crate::volume::{Volume, VoxelType};

/// Words of a lane that a launch leaves to the next: a packet's radiance and transmittance.
const STATE_WORDS: usize = 4;

type Features = [(&'static str, i32); 5];

const fn features(interpolation: Interpolation, shaded: bool, reversed: bool, styled: bool, pre: bool) -> Features {
    [
        ("INTERPOLATION", interpolation.code()),
        ("SHADED", shaded as i32),
        ("BACK_TO_FRONT", reversed as i32),
        ("STYLED", styled as i32),
        ("PREINTEGRATED", pre as i32),
    ]
}

const fn plain(interpolation: Interpolation, shaded: bool) -> Features {
    features(interpolation, shaded, false, false, false)
}

const fn styled(interpolation: Interpolation) -> Features {
    features(interpolation, false, false, true, false)
}

/// Every set of features that may be built; the first two are built before the service is ready.
static FEATURES: [Features; 16] = {
    use Interpolation::{BSpline, CatmullRom, Nearest, Trilinear};
    [
        plain(Trilinear, false),
        plain(Trilinear, true),
        features(Trilinear, false, true, false, false),
        features(Trilinear, true, true, false, false),
        features(Trilinear, false, false, false, true),
        features(Trilinear, true, false, false, true),
        plain(Nearest, false),
        plain(Nearest, true),
        plain(BSpline, false),
        plain(BSpline, true),
        plain(CatmullRom, false),
        plain(CatmullRom, true),
        styled(Trilinear),
        styled(Nearest),
        styled(BSpline),
        styled(CatmullRom),
    ]
};
const COMMON: usize = 2;

/// `check_together` lets nothing through that is not listed.
fn permitted(wanted: Features) -> Result<&'static Features> {
    listed(TECHNIQUE.name, &FEATURES, wanted)
}

pub(super) fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: || view_words() + &Resume::opencl_text_of_beams("RADIANCE", STATE_WORDS),
        structs: || vec![DeviceView::LAYOUT, EmissionAbsorption::LAYOUT],
        variants: || each_voxel_type(TECHNIQUE.name, &FEATURES),
        common: COMMON * VoxelType::ALL.len(),
    }
}

impl Parameters {
    fn transfer_function(&self, volume: &Volume) -> Result<(TransferFunction, String)> {
        if let Some(sample) = &self.cuda_sample {
            let range = if volume.voxel_type() == VoxelType::U8 {
                [volume.inter(), 255.0 * volume.slope() + volume.inter()]
            } else {
                volume.range()
            };
            let half = (0..3).map(|a| volume.dims()[a] as f64 * volume.spacing()[a]).fold(0.0, f64::max) / 2.0;
            let transfer = [sample.transfer_offset, sample.transfer_scale];
            let points =
                presets::cuda_sample(sample.density, transfer, [range[0].min(range[1]), range[0].max(range[1])], half);
            return Ok((TransferFunction::Points(points), "the CUDA sample's nine colours".into()));
        }
        let request = self.transfer_function.clone().unwrap_or_default();
        TransferFunction::from_request(&request, volume, "/emission_absorption/transfer_function")
    }

    fn features(&self) -> Result<&'static Features> {
        let wanted = if self.styled() {
            styled(self.interpolation())
        } else {
            let reversed = self.order == "back_to_front";
            features(self.interpolation(), self.shading, reversed, false, self.pre_integrated)
        };
        permitted(wanted)
    }

    fn threshold(&self) -> f64 {
        self.cuda_sample.as_ref().map_or(self.opacity_threshold, |c| c.opacity_threshold)
    }
}

impl View for Parameters {
    fn warnings(&self, _: &Volume) -> Vec<Value> {
        coarse_step(self.step_voxels).into_iter().collect()
    }

    fn settings(&self, volume: &Volume, open: &Open<'_>) -> Option<Settings> {
        let mut ways = vec![Way::as_given(self)];
        if open.leaves("pre_integrated") {
            let integrated = Self { pre_integrated: true, ..self.clone() };
            let possible = integrated.check_together("").is_ok();
            let change = Some(("pre_integrated", json!(true)));
            ways.extend(possible.then_some(Way { words: ", pre-integrated", change, parameters: integrated }));
        }
        // There is no gradient for shading to show.
        let flat = volume.non_finite() == 0 && volume.range()[0] == volume.range()[1];
        if flat && self.shading {
            let unshaded = Self { shading: false, ..self.clone() };
            ways.push(Way { words: ", unshaded", change: Some(("shading", json!(false))), parameters: unshaded });
        }
        stepping(TECHNIQUE.name, open, &ways, |p, step| Arc::new(Self { step_voxels: step, ..p.clone() }))
    }

    fn steepest_slope(&self, volume: &Volume) -> Option<f64> {
        let plain = self.regions.is_none() && !self.labels();
        let function = plain.then(|| self.transfer_function(volume).ok()).flatten();
        function.map(|(function, _)| self.opacity_scale * function.steepest_slope())
    }

    fn shows_labels(&self) -> bool {
        self.labels()
    }

    /// Half an entry of the table. The plain reference form, and what is of another order or style, take values as they are.
    fn resolution(&self, volume: &Volume) -> Result<Option<f64>> {
        let plain = [plain(Interpolation::Trilinear, false), plain(Interpolation::Trilinear, true)];
        if !plain.contains(self.features()?) {
            return Ok(None);
        }
        let [low, high] = self.transfer_function(volume)?.0.domain();
        Ok(Some(0.5 * (high - low) / TABLE_SIZE as f64))
    }

    fn plan(&self, volume: &Volume) -> Result<ViewPlan> {
        let skip = self.empty_space_skipping && self.order == "front_to_back";
        let (opaque, named) = match &self.regions {
            Some(regions) => (regions::opaque(regions), format!("{} regions of value and gradient", regions.len())),
            None => {
                let (function, named) = self.transfer_function(volume)?;
                (function.opaque(), format!("transfer function: {named}"))
            }
        };
        let mut reasons = vec![named];
        if !skip {
            reasons.push("every sample is taken: skipping is off".into());
        }
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        Ok(ViewPlan {
            variant: Variant::new(TECHNIQUE.name, Some(volume.voxel_type()), self.features()?),
            cells: if skip { CellUse::Distances(opaque) } else { CellUse::None },
            step: (self.step_voxels * smallest) as f32,
            state_words: STATE_WORDS,
            stepless: false,
            opacity_threshold: self.threshold(),
            reasons,
        })
    }

    fn parameters(&self, volume: &Volume, _camera: &Camera) -> Result<Vec<u8>> {
        let threshold = self.threshold();
        let mut device = EmissionAbsorption {
            transmittance_floor: if threshold >= 1.0 { 0.0 } else { (1.0 - threshold) as f32 },
            brightness: (self.brightness * self.cuda_sample.as_ref().map_or(1.0, |c| c.brightness)) as f32,
            lit: i32::from(self.shading),
            ..EmissionAbsorption::default()
        };
        let ([low, high], entries) = match &self.regions {
            Some(regions) => {
                let (values, steep) = regions::extent(regions, volume);
                device.gradient_scale = (volume.slope().abs() * 255.0 / steep) as f32;
                (values, 256)
            }
            None => (self.transfer_function(volume)?.0.domain(), TABLE_SIZE),
        };
        let per_value = (entries - 1) as f64 / (high - low);
        device.table_scale = (volume.slope() * per_value) as f32;
        // Half an entry, so that a value goes to the nearest.
        device.table_offset = ((volume.inter() - low) * per_value + 0.5) as f32;
        self.styles().apply(volume, &mut device);
        Ok(bytemuck::bytes_of(&device).to_vec())
    }

    fn table(&self, volume: &Volume, step: f32) -> Result<Vec<u32>> {
        let step = f64::from(step);
        if let Some(regions) = &self.regions {
            return Ok(regions::table(regions, volume, self.opacity_scale, step));
        }
        let (function, _) = self.transfer_function(volume)?;
        Ok(if self.pre_integrated {
            function.integrals(self.opacity_scale)
        } else {
            let entries = function.entries(self.opacity_scale, step);
            entries.iter().flat_map(|&(color, opacity)| pack(color, opacity)).chain(pieces(&entries)).collect()
        })
    }

    fn set_shared(&self, camera: &Camera, view: &mut DeviceView) {
        if !self.jitter {
            (view.jittered, view.place) = (0, 0.5);
        }
        self.light.clone().unwrap_or_default().apply(camera, view);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_that_are_not_listed_are_an_error_that_names_them() {
        assert!(permitted(styled(Interpolation::BSpline)).is_ok());
        let said =
            permitted(features(Interpolation::BSpline, false, true, true, true)).expect_err("not listed").to_string();
        assert!(
            said.contains("emission_absorption INTERPOLATION=2 SHADED=0 BACK_TO_FRONT=1 STYLED=1 PREINTEGRATED=1"),
            "{said}"
        );
    }
}
