//! # `potential`
//!
//! The electric potential between two plates: Laplace's equation ∇²u = 0 by Jacobi's iteration, until the change of an iteration is small. It is a
//! field with named kernel functions, a range of three dimensions, a reduction, and a decision of the host between iterations.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `grid` | voxels | 2–256 | 16, 16, 16 |
//! | `iterations` | | 1–limit | 1,000 |
//! | `stop` | root mean square of a change | 0–1 | 0 |

use std::sync::Arc;
use std::time::Duration;

use cloudchamber::asset::Assets;
use cloudchamber::device::program::{Source, Variant};
use cloudchamber::device::reduce::{self, Reduction};
use cloudchamber::device::structs::DeviceStruct;
use cloudchamber::device::{Buffer, Device, SliceLength, grid};
use cloudchamber::device_struct;
use cloudchamber::error::Result;
use cloudchamber::request;
use cloudchamber::scene::bounds::Bounds;
use cloudchamber::technique::{Cases, Field, Kind, Look, Process, Progress, Step, Technique, Work};
use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "potential",
    summary: "The electric potential between two plates, by Jacobi's iteration",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    shares: &[],
    cases: || Cases {
        all: vec![json!({"iterations": 3, "grid": [4, 5, 6]}).into()],
        tiny: vec![example()],
        ..Cases::default()
    },
    kind: Kind::Field { parse, work: Some(Work { of: "iterations", most: |_| 100_000, first: 10, looks: 0 }) },
};

device_struct! {
    /// The kernel's own parameters.
    pub struct PotentialPass {
        /// Voxels along x, y, z.
        pub dims: [i32; 3],
        /// The first plane of the launch,
        pub first_plane: i32,
        /// and the one after its last.
        pub end_plane: i32,
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Voxels along x, y, z.
    #[serde(default = "default_grid")]
    #[schemars(inner(range(min = 2, max = 256)))]
    grid: [usize; 3],
    /// Iterations, at most.
    #[serde(default = "default_iterations")]
    #[schemars(range(min = 1))]
    iterations: u64,
    /// It stops when the root mean square of an iteration's change is at most this.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    stop: f64,
}

fn default_grid() -> [usize; 3] {
    [16; 3]
}

fn default_iterations() -> u64 {
    1000
}

fn example() -> Value {
    json!({"technique": "slice", "volume": {"potential": {"grid": [4, 4, 4], "iterations": 5}}, "image": {"width": 9, "height": 7}})
}

fn relax() -> Variant {
    Variant::new("potential", None, &[]).of_function("relax")
}

fn source() -> Source {
    Source {
        kernel: "potential",
        words: String::new,
        structs: || vec![PotentialPass::LAYOUT],
        variants: || vec![relax()],
        common: 0,
    }
}

fn parse(parameters: &Value, at: &str, _: &Assets) -> Result<Arc<dyn Field>> {
    Ok(Arc::new(request::read::<Parameters>(parameters, at)?))
}

impl Field for Parameters {
    fn bounds(&self) -> Bounds {
        let half = 0.5 * DVec3::from_array(self.grid.map(|n| n as f64));
        Bounds::new(glam::DAffine3::from_translation(-half), self.grid, false)
    }

    fn kernels(&self) -> Result<Vec<Variant>> {
        Ok([relax()].into_iter().chain(reduce::variants()).collect())
    }

    fn reasons(&self) -> Vec<String> {
        vec!["potential: Jacobi's iteration from 0".into()]
    }

    fn with(&self, work: u64, _: u64) -> Arc<dyn Field> {
        Arc::new(Self { iterations: work, ..self.clone() })
    }

    fn begin(&self, device: &mut Device) -> Result<Box<dyn Process<Look = Look>>> {
        Ok(Box::new(Run::new(device, self.clone())?))
    }
}

/// The iteration at work.
struct Run {
    parameters: Parameters,
    voxels: usize,
    pass: PotentialPass,
    pass_buffer: Buffer,
    /// The potential, and the potential of the iteration under way.
    now: Buffer,
    next: Buffer,
    change: Buffer,
    reduction: Reduction,
    /// The number of planes in a slice.
    slice_length: SliceLength,
    done: u64,
    total: u64,
    rms_change: f64,
}

impl Run {
    fn new(device: &Device, parameters: Parameters) -> Result<Self> {
        let voxels = parameters.grid.iter().product::<usize>();
        let zeros = || device.upload(&vec![0; voxels * size_of::<f32>()], 0);
        let dims = parameters.grid.map(|n| n as i32);
        Ok(Self {
            voxels,
            pass: PotentialPass { dims, first_plane: 0, end_plane: 0 },
            pass_buffer: device.allocate(size_of::<PotentialPass>())?,
            now: zeros()?,
            next: zeros()?,
            change: zeros()?,
            reduction: Reduction::new(device, voxels)?,
            slice_length: SliceLength::new(device.info(), 1.0, None),
            done: 0,
            total: parameters.iterations,
            rms_change: f64::INFINITY,
            parameters,
        })
    }

    /// Computes planes of the iteration under way, as many as fit in `slice`. A launch is bounded, and the next one continues from its end.
    fn planes(&mut self, device: &mut Device, slice: Duration) -> Result<Duration> {
        let [wide, high, deep] = self.parameters.grid;
        let fit =
            self.slice_length.items(device.info(), slice, wide * high).clamp(1, deep - self.pass.first_plane as usize);
        self.pass.end_plane = self.pass.first_plane + fit as i32;
        device.write(&mut self.pass_buffer, 0, bytemuck::bytes_of(&self.pass))?;
        let arguments = [("pass", &self.pass_buffer), ("u", &self.now), ("next", &self.next), ("change", &self.change)];
        let took = device.run(&relax(), &arguments, [wide, high, fit])?;
        self.slice_length.learn(fit, wide * high, took);
        self.pass.first_plane = self.pass.end_plane;
        Ok(took)
    }

    /// Ends an iteration: the host reads its change, and decides.
    fn end_iteration(&mut self, device: &Device) -> Result<()> {
        std::mem::swap(&mut self.now, &mut self.next);
        (self.pass.first_plane, self.done) = (0, self.done + 1);
        let squared = self.reduction.dot_product(device, &self.change, &self.change, self.voxels)?;
        self.rms_change = (squared / self.voxels as f64).sqrt();
        if self.rms_change <= self.parameters.stop {
            self.total = self.done;
        }
        Ok(())
    }
}

impl Process for Run {
    type Look = Look;

    fn step(&mut self, device: &mut Device, slice: Duration) -> Result<Step> {
        let mut took = Duration::ZERO;
        while took < slice && self.done < self.total {
            took += self.planes(device, slice)?;
            if self.pass.end_plane == self.pass.dims[2] {
                self.end_iteration(device)?;
            }
        }
        Ok(Step {
            progress: Progress { of: "iterations", done: self.done, total: self.total },
            device_time: took,
            is_whole: self.pass.first_plane == 0,
            is_look_due: false,
        })
    }

    fn stop(&mut self, _: &mut Device) -> Result<()> {
        Ok(())
    }

    fn look(&mut self, device: &mut Device) -> Result<Look> {
        let voxels = grid::copy(device, &self.now, self.voxels)?;
        Ok(Look { voxels, result: json!({"iterations": self.done, "rms_change": self.rms_change}) })
    }
}
