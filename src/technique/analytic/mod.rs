//! Analytic reconstruction: what backprojection and filtered backprojection share. Views are taken a block at a time: the host projects and filters
//! them, and the device adds them to the grid (`kernels/shared/backproject.h`).

mod data;
mod deconvolve;
mod process;
mod request;
mod rows;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use serde_json::{Value, json};

use super::case::{Case, Cases};
use super::{Field, Look, Process};
use crate::asset::Assets;
use crate::device::Device;
use crate::device::numbers::define;
use crate::device::program::{Source, Variant};
use crate::device::structs::DeviceStruct;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::scene::bounds::Bounds;
use crate::tomography::{Filter, Geometry};
use data::Data;
use process::Run;
use request::check_voxels;
pub use request::{GridRequest, SinogramRequest};

/// Zeros before and behind the bins of a row on the device: the widest packet and two more.
const MARGIN: usize = 18;

device_struct! {
    /// A launch: some rows of the grid, and the views of a block.
    pub struct BackprojectionPass {
        /// Voxels along x, y, z.
        pub dims: [i32; 3],
        /// The first row of voxels of the launch, of those along y and z,
        pub first_row: i32,
        /// and the one after its last.
        pub end_row: i32,
        /// Views of the block.
        pub views: i32,
        /// Bins along u and v.
        pub bins: [i32; 2],
        /// Floats from one row of bins to the next.
        pub stride: i32,
        /// The bin along v of the first plane of voxels, and bins from one plane to the next.
        pub v_first: f32,
        pub v_step: f32,
    }
}

device_struct! {
    /// A view: the bin along u of the first voxel, and bins from one voxel to the next along x and y.
    pub struct BackprojectionView {
        /// The bin of the first voxel.
        pub first: f32,
        /// Bins per voxel along x,
        pub along_x: f32,
        /// and along y.
        pub along_y: f32,
    }
}

/// The source of a technique's kernel.
pub(super) fn source(kernel: &'static str, variants: fn() -> Vec<Variant>) -> Source {
    Source {
        kernel,
        words: || define("MARGIN", MARGIN),
        structs: || vec![BackprojectionPass::LAYOUT, BackprojectionView::LAYOUT],
        variants,
        common: 0,
    }
}

/// A reconstruction: everything resolved.
#[derive(Clone)]
pub(super) struct Reconstruction {
    /// The technique's name, which is that of its kernel.
    pub technique: &'static str,
    pub data: Data,
    pub geometry: Geometry,
    pub dims: [usize; 3],
    pub spacing_mm: [f64; 3],
    pub center_mm: [f64; 3],
    pub method: Method,
}

/// What is done to the views, or to the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Method {
    /// Nothing.
    Plain,
    /// The grid is deblurred afterwards.
    Deconvolved,
    /// The views are filtered: a window, and its end as a part of the highest frequency.
    Filtered(Filter, f64),
}

/// The cases that tests run: in two dimensions, and in three with planes between rows of bins.
pub(super) fn cases(technique: &'static str) -> Cases {
    let of = |count: [usize; 2], grid: Value| {
        let geometry = json!({"angles_deg": {"count": 5}, "detector": {"count": count}});
        let phantom = json!({"name": "shepp_logan", "dimensions": 3, "radius_mm": 8});
        json!({"sinogram": {"projection": {"of": {"phantom": phantom}, "geometry": geometry}}, "grid": grid})
    };
    let tiny = |own: Value| json!({"technique": "slice", "volume": {technique: own}, "image": {"width": 5, "height": 4}, "budget": {"samples": 1}});
    let all = [of([17, 1], json!({})), of([17, 3], json!({"dims": [19, 5, 4], "spacing_mm": [1, 1, 0.7]}))];
    Cases { tiny: all.clone().map(tiny).to_vec(), all: all.map(Case::from).to_vec(), ..Cases::default() }
}

impl Reconstruction {
    /// The reconstruction of a request's parts.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a pointer under `at`; [`Error::TooLarge`] for more than a sinogram or a grid may have.
    pub fn new(
        technique: &'static str,
        sinogram: &SinogramRequest,
        grid: &GridRequest,
        method: Method,
        assets: &Assets,
        at: &str,
    ) -> Result<Self> {
        let (data, geometry) = sinogram.resolve(assets, &format!("{at}/sinogram"))?;
        let (dims, spacing_mm, center_mm) = grid.resolve(&geometry);
        let made = Self { technique, data, geometry, dims, spacing_mm, center_mm, method };
        check_voxels(made.computed(), assets.limits())?;
        if made.planes_seen() == 0 {
            let permitted = "planes within half a bin of the detector's rows";
            return Err(Error::invalid(
                format!("{at}/grid"),
                "no plane of the grid is seen by the detector",
                permitted,
            ));
        }
        Ok(made)
    }

    /// The kernel.
    fn variant(&self) -> Variant {
        Variant::new(self.technique, None, &[])
    }

    /// Voxels around the grid along x and y that are left out in the end.
    fn margin(&self) -> [usize; 2] {
        let [wide, high, _] = self.dims;
        if self.method == Method::Deconvolved { [wide.div_ceil(2), high.div_ceil(2)] } else { [0; 2] }
    }

    /// The voxels that are computed.
    fn computed(&self) -> [usize; 3] {
        let ([wide, high, deep], [x, y]) = (self.dims, self.margin());
        [wide + 2 * x, high + 2 * y, deep]
    }

    /// The centre of the first voxel that is computed, mm.
    fn first_mm(&self, axis: usize) -> f64 {
        self.center_mm[axis] - 0.5 * (self.computed()[axis] as f64 - 1.0) * self.spacing_mm[axis]
    }

    /// The bin along v of a plane of voxels.
    fn bin_of_plane(&self, plane: usize) -> f64 {
        self.geometry.bin(1, self.first_mm(2) + plane as f64 * self.spacing_mm[2])
    }

    /// The planes of voxels that the detector sees: no farther than half a bin from its outermost rows.
    pub fn planes_seen(&self) -> usize {
        let most = self.geometry.count()[1] as f64 - 0.5;
        (0..self.dims[2]).filter(|plane| (-0.5..=most).contains(&self.bin_of_plane(*plane))).count()
    }
}

impl Field for Arc<Reconstruction> {
    fn bounds(&self) -> Bounds {
        let spacing = DVec3::from(self.spacing_mm);
        // The world's origin is the grid's centre, wherever that is in the scanner.
        let translation = -0.5 * spacing * DVec3::from(self.dims.map(|n| n as f64));
        let world_from_index = DAffine3 { matrix3: DMat3::from_diagonal(spacing), translation };
        Bounds::new(world_from_index, self.dims, false)
    }

    fn kernels(&self) -> Result<Vec<Variant>> {
        Ok(vec![self.variant()])
    }

    fn reasons(&self) -> Vec<String> {
        let filter = match self.method {
            Method::Filtered(filter, cutoff) => {
                let name = serde_json::to_value(filter).unwrap_or_default();
                format!("filter {} to {cutoff} of the highest frequency", name.as_str().unwrap_or_default())
            }
            Method::Plain => "no filter".into(),
            Method::Deconvolved => "deblurred after it by |ω| on twice the grid".into(),
        };
        let ([u, v], views) = (self.geometry.count(), self.geometry.views());
        vec![format!("{}: {views} parallel views of {u} × {v} bins, {filter}", self.technique)]
    }

    fn with(&self, _: u64, _: u64) -> Arc<dyn Field> {
        Arc::new(self.clone())
    }

    fn begin(&self, device: &mut Device) -> Result<Box<dyn Process<Look = Look>>> {
        Ok(Box::new(Run::new(device, self.clone())?))
    }
}
