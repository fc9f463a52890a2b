//! The state that all jobs on the device thread share: the device, the volumes on it, and the compiled kernels.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::compile::Compiler;
use super::device_volume::DeviceVolume;
use super::first::first_kernels;
use super::kernels::Kernels;
use super::sources;
use super::volumes::Volumes;
use super::warm::{is_cached, warm};
use crate::device::program::Variant;
use crate::device::{Buffer, Device, DeviceConfig, encode};
use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::volume::Volume;

/// Everything on the device that outlives a job.
pub(super) struct DeviceContext {
    pub device: Device,
    /// The curve of sRGB by which films are encoded.
    pub curve: Rc<Buffer>,
    volumes: Volumes,
    /// The rays per millisecond of the last pass, by kernel variant.
    speed: HashMap<Variant, f64>,
    kernels: Kernels,
    /// True if processes compile the kernels.
    compiles_ahead: bool,
}

impl Drop for DeviceContext {
    fn drop(&mut self) {
        self.kernels.close();
    }
}

impl DeviceContext {
    /// Opens the device with its preferred number of lanes, or with fewer if the first kernels do not build for that many. From then on, `kernels`
    /// records the compiled variants, and processes compile ahead; they call `wake` after each variant.
    ///
    /// # Errors
    /// [`Error::Internal`] when there is no device, or when the first kernels build for no number of lanes.
    pub fn open(config: &DeviceConfig, kernels: Kernels, wake: impl Fn() + Send + Clone + 'static) -> Result<Self> {
        let mut gave_up: Vec<String> = Vec::new();
        let mut lanes = config.lanes;
        loop {
            let mut device = Device::open(&DeviceConfig { lanes, ..config.clone() })?;
            let used = device.info().lanes;
            let started = Instant::now();
            match first_kernels(&mut device, Compiler::of(config, used).as_ref()) {
                Ok(()) => {
                    let (level, ms) = (device.info().level, started.elapsed().as_millis() as u64);
                    tracing::info!(ms, lanes = used, level, "the first kernels are there");
                    device.note_given_up(gave_up);
                    let (volumes, speed) = Default::default();
                    let curve = encode::curve(&device)?;
                    let mut context = Self { device, curve, volumes, speed, kernels, compiles_ahead: false };
                    context.compile_ahead(config, wake)?;
                    return Ok(context);
                }
                Err(cause) => {
                    let narrower = [8, 4, 1].into_iter().find(|n| *n < used && config.lanes.is_none());
                    tracing::error!(lanes = used, %cause, ?narrower, "the first kernels do not build");
                    gave_up.push(format!("{used} lanes: the first kernels do not build"));
                    lanes = Some(narrower.ok_or(cause)?);
                }
            }
        }
    }

    /// Starts processes that compile the variants that are likely to be asked for, if PoCL keeps compiled kernels. Without PoCL, the device thread
    /// compiles them while it is idle.
    fn compile_ahead(&mut self, config: &DeviceConfig, wake: impl Fn() + Send + Clone + 'static) -> Result<()> {
        for variant in sources::first() {
            self.kernels.set(&variant, true);
        }
        let Some(compiler) = Compiler::of(config, self.device.info().lanes) else { return Ok(()) };
        for variant in sources::common() {
            self.kernels.ask(&variant, false);
            if is_cached(&self.device, &variant) {
                self.kernels.set(&variant, true);
            }
        }
        self.compiles_ahead = self.device.info().is_pocl();
        if self.compiles_ahead { self.kernels.start(&compiler, wake) } else { Ok(()) }
    }

    /// True if a variant can be run now. A variant is built if it is compiled, or if no processes compile ahead. A variant that cannot be run yet
    /// is asked for.
    ///
    /// # Errors
    /// [`Error::Kernel`] for a variant that does not build on this device.
    pub fn is_ready(&mut self, variant: &Variant) -> Result<bool> {
        if self.device.is_built(variant) {
            return Ok(true);
        }
        match self.kernels.is_compiled(variant) {
            None if self.compiles_ahead => {
                self.kernels.ask(variant, true);
                return Ok(false);
            }
            Some(false) => {}
            _ => self.build(variant),
        }
        let lanes = self.device.info().lanes;
        let built = self.device.is_built(variant);
        if built { Ok(true) } else { Err(Error::Kernel { variant: variant.label(), lanes }) }
    }

    fn build(&mut self, variant: &Variant) {
        let built = warm(&mut self.device, variant);
        if let Err(cause) = &built {
            tracing::error!(kernel = variant.label(), %cause, "a kernel does not build");
        }
        self.kernels.set(variant, built.is_ok());
    }

    /// Builds one variant that is likely to be asked for, if no processes do so. True if there was one.
    pub fn build_ahead(&mut self) -> bool {
        let next = if self.compiles_ahead { None } else { self.kernels.take() };
        next.inspect(|variant| self.build(variant)).is_some()
    }

    /// A volume on the device: [`Volumes::get`].
    pub fn volume(&mut self, volume: &Arc<Volume>) -> Result<Rc<DeviceVolume>> {
        self.volumes.get(&mut self.device, volume)
    }

    /// The volume of a field's grid: [`Volumes::of_field`].
    pub fn grid(&mut self, voxels: Buffer, bounds: &Bounds, technique: &str) -> Result<Arc<Volume>> {
        self.volumes.of_field(&self.device, voxels, bounds, technique)
    }

    /// Notes the speed of a variant, from the rays of a pass and their time.
    pub fn measured(&mut self, variant: &Variant, rays: usize, took: Duration) {
        self.speed.insert(*variant, rays as f64 / (took.as_secs_f64() * 1e3).max(1e-3));
    }

    /// The rays per millisecond of a variant's last pass; `None` if it has not run.
    pub fn speed(&self, variant: &Variant) -> Option<f64> {
        self.speed.get(variant).copied()
    }

    /// Drops volumes that nobody needs: [`Volumes::tidy`].
    pub fn tidy(&mut self) {
        self.volumes.tidy();
    }
}
