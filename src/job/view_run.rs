//! A view on the device: its buffers and the order of its passes.
//!
//! First a preview of every fourth pixel, then the control: every second pixel at twice the step. The passes proper follow,
//! and the control gets another sample each time their number has doubled, so that it always costs little and knows enough.

use std::rc::Rc;
use std::time::Duration;

use glam::Vec2;

use super::live::DeviceContext;
use super::pace::Pace;
use crate::device::structs::View as DeviceView;
use crate::device::{Buffer, DeviceInfo};
use crate::error::Result;
use crate::film::{Film, Samples};
use crate::scene::{self, Scene};
use crate::technique::ViewPlan;
use crate::volume::Volume;

/// A pass is skipped as a preview when the picture itself is likely to take less than this.
const QUICK_MS: f64 = 40.0;
/// The shortest step that `max_error` leads to, in voxels: the shortest that a request may ask for.
const LEAST_STEP_VOXELS: f64 = 0.05;
/// Strides of preview, control and the passes proper.
const PREVIEW: usize = 4;
const CONTROL: usize = 2;

/// One set of samples on the device.
struct Layer {
    buffer: Buffer,
    width: usize,
    height: usize,
    stride: usize,
    samples: u32,
    /// Tells its random numbers from the others'.
    stream: u32,
}

/// Which layer a pass goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pass {
    Preview,
    Control,
    Main,
}

/// A view at work.
pub(super) struct ViewRun {
    plan: ViewPlan,
    voxels: Rc<Buffer>,
    distances: Buffer,
    table: Buffer,
    parameters: Buffer,
    view_buffer: Buffer,
    counts: Buffer,
    /// The camera and image, and the same with the pass under way.
    view: DeviceView,
    pass_view: DeviceView,
    size: [usize; 2],
    layers: [Layer; 3],
    pass: Option<Pass>,
    cursor: usize,
    wants_preview: bool,
    pace: Pace,
    /// The longest way through the volume, world units.
    longest: f64,
    least_step: f32,
    /// Device time since the start, and of the pass under way.
    pub device_time: Duration,
    pass_time: Duration,
}

fn index(pass: Pass) -> usize {
    pass as usize
}

impl ViewRun {
    pub fn new(context: &mut DeviceContext, scene: &Scene, volume: &std::sync::Arc<Volume>) -> Result<Self> {
        let plan = scene.view().plan(volume)?;
        let size = scene.image().map(|n| n as usize);
        let device = &context.device;
        let layer = |stride: usize, stream: u32| -> Result<Layer> {
            let (width, height) = (size[0].div_ceil(stride), size[1].div_ceil(stride));
            Ok(Layer { buffer: device.allocate(20 * width * height)?, width, height, stride, samples: 0, stream })
        };
        let layers = [layer(PREVIEW, 2)?, layer(CONTROL, 1)?, layer(1, 0)?];
        let parameters = device.upload(&scene.view().parameters(volume, scene.camera())?, 0)?;
        let mut view = scene.camera().device_view(scene.image(), volume);
        view.full_width = size[0] as i32;
        view.seed = [scene.seed() as u32, (scene.seed() >> 32) as u32];
        let distances = device.upload(&plan.distances, 8)?;
        let table = device.upload(bytemuck::cast_slice(&plan.table), 0)?;
        let view_buffer = device.allocate(size_of::<DeviceView>())?;
        let counts = device.upload(&[0; 32], 0)?;
        let wants_preview = context.expected_ms(&plan.variant, size[0] * size[1]).is_none_or(|ms| ms > QUICK_MS);
        let voxels = context.volume(volume)?;
        let (pass, cursor, device_time, pass_time) = (None, 0, Duration::ZERO, Duration::ZERO);
        let longest = 2.0 * scene::radius(volume);
        let smallest = volume.spacing().into_iter().fold(f64::INFINITY, f64::min);
        Ok(Self {
            pace: Pace::new(context.device.info(), longest / f64::from(plan.step)),
            longest,
            least_step: (LEAST_STEP_VOXELS * smallest) as f32,
            plan,
            voxels,
            distances,
            table,
            parameters,
            view_buffer,
            counts,
            view,
            pass_view: view,
            size,
            layers,
            pass,
            cursor,
            wants_preview,
            device_time,
            pass_time,
        })
    }

    /// Another camera: everything gathered so far is of the old one.
    pub fn restart(&mut self, context: &mut DeviceContext, scene: &Scene, volume: &Volume) -> Result<()> {
        let keep = self.view;
        self.view = DeviceView {
            full_width: keep.full_width,
            seed: keep.seed,
            ..scene.camera().device_view(scene.image(), volume)
        };
        context.device.write(&mut self.parameters, 0, &scene.view().parameters(volume, scene.camera())?)?;
        context.device.write(&mut self.counts, 0, &[0; 32])?;
        self.pace = Pace::new(context.device.info(), self.longest / f64::from(self.plan.step));
        for layer in &mut self.layers {
            layer.samples = 0;
        }
        self.wants_preview =
            context.expected_ms(&self.plan.variant, self.size[0] * self.size[1]).is_none_or(|ms| ms > QUICK_MS);
        (self.pass, self.cursor, self.device_time) = (None, 0, Duration::ZERO);
        Ok(())
    }

    /// Samples per pixel of the passes proper.
    pub fn samples(&self) -> u32 {
        self.layers[index(Pass::Main)].samples
    }

    /// Whether the step is still longer than what a request may ask for.
    pub fn can_halve_step(&self) -> bool {
        self.plan.step >= 2.0 * self.least_step
    }

    /// Starts over with half the step: what was gathered has the error of the longer one. The passes proper of the longer step
    /// would make a good control, but for their number; a fresh one costs an eighth of a pass.
    pub fn halve_step(&mut self, info: &DeviceInfo) {
        self.plan.step *= 0.5;
        self.pace = Pace::new(info, self.longest / f64::from(self.plan.step));
        self.layers.iter_mut().for_each(|layer| layer.samples = 0);
        self.wants_preview = false;
        (self.pass, self.cursor) = (None, 0);
    }

    pub fn plan(&self) -> &ViewPlan {
        &self.plan
    }

    fn next_pass(&self) -> Pass {
        let [preview, control, main] = &self.layers;
        let owed = if main.samples < 2 { 1 } else { 1 + main.samples.ilog2() };
        if self.wants_preview && preview.samples == 0 && control.samples == 0 {
            Pass::Preview
        } else if control.samples < owed {
            Pass::Control
        } else {
            Pass::Main
        }
    }

    /// Works for about `slice` and says which pass it finished, if one.
    pub fn slice(&mut self, context: &mut DeviceContext, slice: Duration) -> Result<Option<Pass>> {
        let pass = match self.pass {
            Some(pass) => pass,
            None => self.begin(),
        };
        let layer = &self.layers[index(pass)];
        let lanes = context.device.info().lanes as usize;
        let (tile_w, tile_h) = match lanes {
            16 => (4, 4),
            8 => (4, 2),
            4 => (2, 2),
            _ => (1, 1),
        };
        let tiles = layer.width.div_ceil(tile_w) * layer.height.div_ceil(tile_h);
        let items = self.pace.items(context.device.info(), slice, lanes).min(tiles - self.cursor);
        self.pass_view.first_tile = self.cursor as i32;
        context.device.write(&mut self.view_buffer, 0, bytemuck::bytes_of(&self.pass_view))?;
        let layer = &self.layers[index(pass)];
        let arguments = [
            &self.view_buffer,
            &self.parameters,
            &*self.voxels,
            &self.distances,
            &self.table,
            &layer.buffer,
            &self.counts,
        ];
        let took = context.device.run(&self.plan.variant, &arguments, items)?;
        self.pace.learn(items, lanes, took);
        self.device_time += took;
        self.pass_time += took;
        self.cursor += items;
        if self.cursor < tiles {
            return Ok(None);
        }
        if pass == Pass::Main {
            context.measured(&self.plan.variant, self.size[0] * self.size[1], self.pass_time);
        }
        self.layers[index(pass)].samples += 1;
        (self.pass, self.cursor) = (None, 0);
        Ok(Some(pass))
    }

    /// Chooses the next pass.
    fn begin(&mut self) -> Pass {
        let pass = self.next_pass();
        let layer = &self.layers[index(pass)];
        let offset = pixel_offset(layer.samples);
        let view = DeviceView {
            width: layer.width as i32,
            height: layer.height as i32,
            stride: layer.stride as i32,
            sample: layer.samples as i32,
            stream: layer.stream,
            offset: offset.to_array(),
            step: if pass == Pass::Main { self.plan.step } else { 2.0 * self.plan.step },
            ..self.view
        };
        self.pass_view = view;
        self.pass = Some(pass);
        self.pass_time = Duration::ZERO;
        pass
    }

    /// Reads what there is to see: the passes proper, or before the first of them the finer of control and preview.
    pub fn film(&self, context: &DeviceContext) -> Result<Film> {
        let [preview, control, main] = &self.layers;
        let read = |layer: &Layer| -> Result<Samples> {
            let pixels = layer.width * layer.height;
            let (mut mean, mut m2) = (vec![0.0f32; 4 * pixels], vec![0.0f32; pixels]);
            context.device.read(&layer.buffer, 0, &mut mean)?;
            context.device.read(&layer.buffer, 16 * pixels, &mut m2)?;
            Ok(Samples {
                width: layer.width,
                height: layer.height,
                stride: layer.stride,
                count: layer.samples,
                mean,
                m2,
            })
        };
        let shown = [main, control, preview].into_iter().find(|l| l.samples > 0).unwrap_or(preview);
        let control = (shown.stride == 1 && control.samples > 0).then(|| read(control)).transpose()?;
        let opacity_threshold = self.plan.opacity_threshold;
        Ok(Film { size: self.size, main: read(shown)?, control, opacity_threshold, field_error: None })
    }

    /// Samples that were not finite.
    pub fn non_finite(&self, context: &DeviceContext) -> Result<u64> {
        let mut counts = [0u32; 1];
        context.device.read(&self.counts, 0, &mut counts)?;
        Ok(u64::from(counts[0]))
    }
}

/// Where in the pixels sample `n` goes through: the R2 sequence (Roberts, "The Unreasonable Effectiveness of Quasirandom
/// Sequences", 2018), whose first point is here the pixel's centre.
fn pixel_offset(n: u32) -> Vec2 {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let at = |power: i32| (0.5 + f64::from(n) / PLASTIC.powi(power)).fract() as f32;
    Vec2::new(at(1), at(2))
}
