//! The plan of `emission_absorption`: its kernels, parameters and tables.

use std::sync::Arc;

use serde_json::{Value, json};

use super::pieces::pieces;
use super::regions::Region;
use super::variants::{Features, STATE_WORDS, features, permitted, plain, styled};
use super::{EmissionAbsorption, Parameters, TECHNIQUE, regions};
use crate::device::program::Variant;
use crate::device::structs::View as DeviceView;
use crate::error::Result;
use crate::scene::camera::Camera;
use crate::scene::interpolation::Interpolation;
use crate::scene::presets;
use crate::scene::transfer::{TABLE_SIZE, TransferFunction, pack};
use crate::scene::transfer_table::TransferTable;
use crate::technique::stepping::{Way, stepping};
use crate::technique::steps::coarse_step;
use crate::technique::view::in_words;
use crate::technique::{CellUse, Open, PreparedView, Settings, Subject, View, ViewPlan};
use crate::volume::{Volume, VoxelType};

/// The opacity from which on what a ray leaves out is not seen.
const EARLY: f64 = 0.99;

impl Parameters {
    pub(super) fn transfer_function(&self, volume: &Volume) -> Result<(TransferFunction, String)> {
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

/// The source of a sample's colour.
pub(super) enum Colours {
    /// A transfer function of the value, with its table.
    Function(Box<TransferTable>),
    /// Regions of value and gradient.
    Regions(Vec<Region>),
}

/// The view of a volume.
pub(super) struct Prepared {
    pub parameters: Parameters,
    pub volume: Arc<Volume>,
    pub colours: Colours,
    /// The function of the volume's own values, not of words, for [`PreparedView::steepest_slope`].
    pub function_of_values: Option<TransferTable>,
    pub plan: ViewPlan,
}

impl Parameters {
    /// Half an entry of the table. The plain reference form, other orders and styles take values as they are.
    fn resolution(&self, table: &TransferTable) -> Result<Option<f64>> {
        let plain = [plain(Interpolation::Trilinear, false), plain(Interpolation::Trilinear, true)];
        Ok(plain.contains(self.features()?).then_some(table.resolution()))
    }

    /// The table of the colours of a volume, and a description of their source.
    fn transfer_table(&self, volume: &Volume) -> Result<(TransferTable, String)> {
        let (function, named) = self.transfer_function(volume)?;
        let [low, high] = volume.range();
        // The weights of Catmull-Rom splines add up to 1.25³ at most besides what they take away, so that samples may be beyond all voxels.
        let beyond = if self.interpolation() == Interpolation::CatmullRom { 0.5 * (high - low) } else { 0.0 };
        let values = [low - beyond, high + beyond];
        let table = if self.pre_integrated { TransferTable::of_integrals } else { TransferTable::new };
        Ok((table(function, values), named))
    }

    /// The plan for a volume, whose values in `opaque` have an opacity; `named` is the description of the colours.
    pub(super) fn plan(&self, volume: &Volume, opaque: Vec<[f64; 2]>, named: String) -> Result<ViewPlan> {
        let skip = self.empty_space_skipping && self.order == "front_to_back";
        let mut reasons = vec![named];
        if !skip {
            reasons.push("every sample is taken: skipping is off".into());
        }
        Ok(ViewPlan {
            variant: Variant::new(TECHNIQUE.name, Some(volume.voxel_type()), self.features()?),
            cells: if skip { CellUse::Distances(opaque) } else { CellUse::None },
            step: (self.step_voxels * volume.smallest_side()) as f32,
            state_words: STATE_WORDS,
            stepless: false,
            cheap: false,
            biased: false,
            extremum: false,
            opacity_threshold: self.threshold(),
            reasons,
        })
    }
}

impl View for Parameters {
    fn prepare(&self, subject: &Subject) -> Result<Arc<dyn PreparedView>> {
        let volume = subject.needed_volume()?;
        self.suiting(Some(volume)).prepared(volume)
    }

    fn shows_labels(&self, volume: Option<&Volume>) -> bool {
        self.suiting(volume).labels()
    }
}

impl Parameters {
    fn prepared(self, volume: &Arc<Volume>) -> Result<Arc<dyn PreparedView>> {
        if let Some(regions) = &self.regions {
            let named = format!("{} regions of value and gradient", regions.len());
            let plan = self.plan(volume, regions::opaque(regions), named)?;
            let colours = Colours::Regions(regions.clone());
            return Ok(Arc::new(Prepared {
                parameters: self,
                volume: volume.clone(),
                colours,
                function_of_values: None,
                plan,
            }));
        }
        if self.labels() && volume.range()[1] > (TABLE_SIZE - 1) as f64 {
            return self.prepared_by_places(volume);
        }
        let (of_values, mut named) = self.transfer_table(volume)?;
        let (looked_at, words) = in_words(volume, self.resolution(&of_values)?);
        let mut table = of_values.clone();
        if words.is_some() {
            (table, named) = self.transfer_table(&looked_at)?;
        }
        let mut plan = self.plan(&looked_at, table.opaque(), format!("transfer function: {named}"))?;
        plan.reasons.extend(words);
        let function_of_values = (!self.labels()).then_some(of_values);
        let colours = Colours::Function(Box::new(table));
        Ok(Arc::new(Prepared { parameters: self, volume: looked_at, colours, function_of_values, plan }))
    }
}

impl Prepared {
    /// The device's parameters; a ray ends at the opacity `threshold`.
    fn on_device(&self, threshold: f64) -> Vec<u8> {
        let (own, volume) = (&self.parameters, &self.volume);
        let mut device = EmissionAbsorption {
            transmittance_floor: if threshold >= 1.0 { 0.0 } else { (1.0 - threshold) as f32 },
            brightness: (own.brightness * own.cuda_sample.as_ref().map_or(1.0, |c| c.brightness)) as f32,
            lit: i32::from(own.shading),
            ..EmissionAbsorption::default()
        };
        let ([low, high], entries) = match &self.colours {
            Colours::Regions(regions) => {
                let (values, steep) = regions::extent(regions, volume);
                device.gradient_scale = (volume.slope().abs() * 255.0 / steep) as f32;
                (values, 256)
            }
            Colours::Function(table) => {
                device.knots = table.knots().0 as i32;
                (table.domain(), TABLE_SIZE)
            }
        };
        let per_value = (entries - 1) as f64 / (high - low);
        device.table_scale = (volume.slope() * per_value) as f32;
        // The half entry rounds a value to the nearest one.
        device.table_offset = ((volume.inter() - low) * per_value + 0.5) as f32;
        own.styles().apply(volume, &mut device);
        bytemuck::bytes_of(&device).to_vec()
    }
}

impl PreparedView for Prepared {
    fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn volume(&self) -> Option<&Arc<Volume>> {
        Some(&self.volume)
    }

    fn warnings(&self) -> Vec<Value> {
        coarse_step(self.parameters.step_voxels).into_iter().collect()
    }

    fn settings(&self, open: &Open<'_>) -> Option<Settings> {
        let given = &self.parameters;
        let mut ways = vec![Way::as_given(given)];
        if open.leaves("pre_integrated") {
            let integrated = Parameters { pre_integrated: true, ..given.clone() };
            let possible = integrated.check_together("").is_ok();
            let change = Some(("pre_integrated", json!(true)));
            ways.extend(possible.then_some(Way { words: ", pre-integrated", change, parameters: integrated }));
        }
        // A volume of one value has no gradient to shade.
        let flat = self.volume.non_finite() == 0 && self.volume.range()[0] == self.volume.range()[1];
        if flat && given.shading {
            let unshaded = Parameters { shading: false, ..given.clone() };
            ways.push(Way { words: ", unshaded", change: Some(("shading", json!(false))), parameters: unshaded });
        }
        stepping(TECHNIQUE.name, open, &ways, None, |p, step| Arc::new(Parameters { step_voxels: step, ..p.clone() }))
    }

    fn steepest_slope(&self) -> Option<f64> {
        let function = self.function_of_values.as_ref()?;
        Some(self.parameters.opacity_scale * function.steepest_slope())
    }

    fn parameters(&self, _camera: &Camera) -> Vec<u8> {
        self.on_device(self.parameters.threshold())
    }

    fn parameters_to_the_end(&self, _camera: &Camera) -> Option<Vec<u8>> {
        (self.parameters.threshold() < EARLY).then(|| self.on_device(1.0))
    }

    fn table(&self, step: f32) -> Vec<u32> {
        let (own, step) = (&self.parameters, f64::from(step));
        match &self.colours {
            Colours::Regions(regions) => regions::table(regions, &self.volume, own.opacity_scale, step),
            Colours::Function(table) if own.pre_integrated => {
                [table.integrals(own.opacity_scale), table.knots().1].concat()
            }
            Colours::Function(table) => {
                let entries = table.entries(own.opacity_scale, step);
                let packed = entries.iter().flat_map(|&(color, opacity)| pack(color, opacity));
                packed.chain(pieces(&entries)).chain(table.knots().1).collect()
            }
        }
    }

    fn set_shared(&self, camera: &Camera, view: &mut DeviceView) {
        if !self.parameters.jitter {
            (view.jittered, view.place) = (0, 0.5);
        }
        self.parameters.light.clone().unwrap_or_default().apply(camera, view);
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
