//! One set of samples of a view on the device, and the choice of the pixels that a pass samples.

use std::rc::Rc;

use super::context::DeviceContext;
use super::tiling::Tiling;
use crate::device::encode::PADDING;
use crate::device::{Buffer, Device};
use crate::error::Result;
use crate::film::Samples;
use crate::render::Scene;
use crate::technique::TILE;

/// The samples of a pass that lie side by side in the film of a probe: 2^`across` by 2^`down` of each pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Batch {
    pub across: u32,
    pub down: u32,
    /// Its pixels lie in clusters of 2^`cluster` by 2^`cluster`.
    pub cluster: u32,
}

/// One set of samples on the device.
pub(super) struct Layer {
    pub buffer: Buffer,
    pub width: usize,
    pub height: usize,
    pub stride: usize,
    /// The stride in the requested picture. It is longer than `stride` if the film is a pilot's.
    pub picture_stride: usize,
    pub samples: u32,
    /// The kernel's table for its step.
    pub table: Rc<Buffer>,
    /// Its step, world units.
    pub step: f32,
    /// The number of its random stream.
    pub stream: u32,
    /// The pixel of the picture at which the grid of a probe begins.
    pub origin: [usize; 2],
    /// The samples of a pass, if it is a probe's.
    pub batch: Option<Batch>,
    /// The tiles that its passes sample, if the view renders tiles.
    tiling: Option<(Tiling, Buffer)>,
}

impl Layer {
    /// Room for every `stride`-th pixel of a scene's picture, or of a pilot's pixels, with as many `films` side by side. It is `room` itself if that
    /// has the same size.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] when the device has no room.
    pub fn new(
        device: &Device,
        scene: &Scene,
        table: Rc<Buffer>,
        stride: usize,
        step: f32,
        films: usize,
        room: Option<Buffer>,
    ) -> Result<Self> {
        let region = scene.region();
        let picture_stride = stride * region.stride as usize;
        let [width, height] = region.size.map(|n| (n as usize).div_ceil(picture_stride));
        let tiled = |_| -> Result<_> {
            let tiling = Tiling::new(width, height);
            let buffer = device.upload(&vec![0; tiling.room()], 0)?;
            Ok((tiling, buffer))
        };
        let tiling = scene.view().random().map(tiled).transpose()?;
        let buffer = device.allocate_in(room, 20 * films * width * height + PADDING)?;
        let (samples, stream, origin, batch) = (0, 0, [0; 2], None);
        Ok(Self { buffer, width, height, stride, picture_stride, samples, table, step, stream, origin, batch, tiling })
    }

    /// Forgets the samples.
    pub fn restart(&mut self, device: &Device) -> Result<()> {
        self.samples = 0;
        if let Some((tiling, buffer)) = &mut self.tiling {
            tiling.restart();
            device.write(buffer, 0, &vec![0; buffer.len()])?;
        }
        Ok(())
    }

    /// Notes that a pass is over.
    pub fn passed(&mut self) {
        self.samples += 1;
        if let Some((tiling, _)) = &mut self.tiling {
            tiling.passed();
        }
    }

    /// The list of tiles for a kernel.
    pub fn tiles(&self) -> Option<&Buffer> {
        self.tiling.as_ref().map(|(_, buffer)| buffer)
    }

    /// Tells the device the tiles of the next pass. An adaptive pass samples tiles with more noise more often.
    pub fn choose_tiles(&mut self, context: &DeviceContext, adaptive: bool) -> Result<()> {
        let samples = self.samples;
        if adaptive && self.tiling.as_ref().is_some_and(|(t, _)| t.is_due(samples)) {
            let read = self.read(context, true)?;
            if let Some((tiling, buffer)) = &mut self.tiling {
                if tiling.wants_costs() {
                    let mut costs = vec![0u32; tiling.tiles()];
                    context.device.read(buffer, tiling.costs_at(), &mut costs)?;
                    tiling.learn_costs(&costs);
                }
                tiling.plan(samples, &read.deviations(TILE));
            }
        }
        if let Some((tiling, buffer)) = &mut self.tiling {
            context.device.write(buffer, 0, bytemuck::cast_slice(&tiling.pass(samples)))?;
        }
        Ok(())
    }

    /// The size of the film of a pass.
    pub fn film_size(&self) -> [usize; 2] {
        let [across, down] = self.batch.map_or([0; 2], |batch| [batch.across, batch.down]);
        [self.width << across, self.height << down]
    }

    /// The work-items of a pass, and the approximate number of rays of each.
    pub fn items(&self, lanes: usize) -> (usize, usize) {
        if let Some((tiling, _)) = &self.tiling {
            return tiling.items(lanes);
        }
        let [beam_w, beam_h] = beam_pixels(lanes);
        let [width, height] = self.film_size();
        (width.div_ceil(beam_w) * height.div_ceil(beam_h), beam_w * beam_h)
    }

    /// The description of the samples, without their values.
    pub fn unread(&self) -> Samples {
        Samples {
            width: self.width,
            height: self.height,
            stride: self.stride,
            count: self.samples,
            tiles: self.tiling.as_ref().and_then(|(tiling, _)| tiling.counts()),
            ..Samples::default()
        }
    }

    /// The samples, with or without their squared deviations.
    pub fn read(&self, context: &DeviceContext, deviations: bool) -> Result<Samples> {
        let pixels = self.width * self.height;
        let mut samples = self.unread();
        samples.mean = vec![0.0; 4 * pixels];
        context.device.read(&self.buffer, 0, &mut samples.mean)?;
        if deviations {
            samples.m2 = vec![0.0; pixels];
            context.device.read(&self.buffer, 16 * pixels, &mut samples.m2)?;
        }
        Ok(samples)
    }
}

/// The pixels across and down of a work-item: `BEAM_W` × `TILE_W` and `BEAM_H` × `TILE_H` of `kernels/shared/beam.h`.
fn beam_pixels(lanes: usize) -> [usize; 2] {
    match lanes {
        16 => [8, 8],
        8 => [8, 4],
        4 => [4, 4],
        _ => [1, 1],
    }
}

/// The packets of a work-item: `PACKETS` of `kernels/shared/beam.h`.
pub(super) fn packets_of_beam(lanes: usize) -> usize {
    let [width, height] = beam_pixels(lanes);
    width * height / lanes
}
