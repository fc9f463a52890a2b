//! # `project`
//!
//! Projections along parallel rays, as a sinogram: p(u, v, θ) = ∫ f dl, value · mm. Those of a phantom are exact, shape by shape in closed form and double
//! precision. Those of a volume or a field are by Joseph's method (IEEE Transactions on Medical
//! Imaging 1, 1982): in each plane of voxel centres across the ray's steepest axis f is interpolated linearly, and the sum over the planes is multiplied
//! by the ray's length between two of them. Outside the grid f is 0, within a voxel of it f falls to that. Of a smooth object the error is of second
//! order in the voxel's side.
//!
//! The rays are in the world of the volume, whose origin is its centre. A grid may lie in it in any way.
//!
//! | parameter | unit | range | default |
//! |---|---|---|---|
//! | `phantom` | mm | `shapes`, or `name`; then there is no `volume` | the volume |
//! | `geometry` | mm, degrees | as that of an upload | what it does not say: 180 views over half a turn; bins as wide as voxels, enough to see all of the box. Of a phantom 360 views of 256 bins of 1 mm |
//! | `projector` | | `joseph` of volumes, `exact` of phantoms | that |
//!
//! The file is NRRD, which says its geometry: it may be posted to `/v1/sinograms` as it is. Voxels without a value count as 0, with a warning. Places are
//! in single precision, which is good to 10⁻⁴ voxels of 1,000.
//!
//! Example: see [`example`], which a test runs.

mod exact;
mod file;
mod process;

use std::sync::Arc;

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};

use super::case::{Case, Cases};
use super::{Export, File, Kind, OnDevice, Process, Subject, Technique};
use crate::asset::Assets;
use crate::device::Device;
use crate::device::program::{Source, Variant};
use crate::device::structs::DeviceStruct;
use crate::device_struct;
use crate::error::{Error, Result};
use crate::request;
use crate::scene::bounds::Bounds;
use crate::tomography::{Geometry, GeometryRequest, Phantom, PhantomRequest};
use crate::volume::VoxelType;
use exact::Exact;
use process::Run;

/// The technique's line in the list.
pub const TECHNIQUE: Technique = Technique {
    name: "project",
    summary: "A sinogram of a volume or a field: its integrals along parallel rays, for reconstruction",
    schema: request::schema_of::<Parameters>,
    example,
    source,
    shares: &[],
    cases,
    kind: Kind::Export { parse },
};

/// The views of a geometry that says nothing of them.
const VIEWS: usize = 180;

device_struct! {
    /// A launch: some rows of the sinogram.
    pub struct ProjectPass {
        /// Voxels along x, y, z.
        pub dims: [i32; 3],
        /// Bins along u and v.
        pub bins: [i32; 2],
        /// The first row of the launch, of those along v and of the views,
        pub first_row: i32,
        /// and the one after its last.
        pub end_row: i32,
        /// value = raw · slope + inter.
        pub slope: f32,
        /// value = raw · slope + inter.
        pub inter: f32,
        /// The raw value that is 0.
        pub nothing: f32,
    }
}

device_struct! {
    /// A view. A ray's place in a plane of voxel centres, along each of the other two axes in their order: its place in plane 0 for bin 0, 0, and what a bin
    /// along u, a bin along v, and a plane add to it.
    pub struct ProjectView {
        /// The axis across the planes.
        pub axis: i32,
        /// The ray's length from plane to plane, mm.
        pub length: f32,
        /// Along the first of the other axes.
        pub across: [f32; 4],
        /// Along the second.
        pub down: [f32; 4],
    }
}

/// The parameters in a request.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// A phantom, in place of a volume.
    phantom: Option<PhantomRequest>,
    /// Where each bin of each view looks. What it does not say is made for the volume.
    #[serde(default)]
    geometry: GeometryRequest,
    /// How rays are integrated.
    projector: Option<Projector>,
}

/// Ways to integrate along a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Projector {
    /// Of a volume, interpolated linearly in planes across the ray's steepest axis.
    Joseph,
    /// Of a phantom, in closed form.
    Exact,
}

/// A request that works as it is.
pub fn example() -> Value {
    json!({"technique": "project", "volume": {"builtin": "shepp_logan", "resolution": 64}, "project": {
        "geometry": {"angles_deg": {"to": 180, "count": 90}, "detector": {"count": [96, 64], "spacing_mm": [0.03, 0.03]}}}})
}

fn cases() -> Cases {
    let tiny = |own: Value| json!({"technique": TECHNIQUE.name, "volume": {"builtin": "sphere", "resolution": 8}, TECHNIQUE.name: own});
    let few = |count: [usize; 2]| json!({"geometry": {"angles_deg": [0, 40, 90, 130], "detector": {"count": count, "spacing_mm": [0.3, 0.4]}}});
    Cases { all: vec![Case::from(few([9, 3]))], tiny: vec![tiny(few([9, 3])), tiny(few([5, 1]))], ..Cases::default() }
}

fn source() -> Source {
    Source {
        kernel: TECHNIQUE.name,
        words: String::new,
        structs: || vec![ProjectPass::LAYOUT, ProjectView::LAYOUT],
        variants: || VoxelType::ALL.map(variant).to_vec(),
        common: 0,
    }
}

fn variant(voxel: VoxelType) -> Variant {
    Variant::new(TECHNIQUE.name, Some(voxel), &[])
}

/// A valid projection.
#[derive(Debug, Clone)]
struct Projection {
    /// What is projected, if that is not a volume.
    phantom: Option<Phantom>,
    asked: GeometryRequest,
    /// The most bytes of a sinogram, which are those of a volume.
    most_bytes: u64,
}

fn parse(parameters: &Value, at: &str, assets: &Assets) -> Result<Arc<dyn Export>> {
    let Parameters { phantom, geometry: asked, projector } = request::read(parameters, at)?;
    let phantom = phantom.map(|phantom| phantom.resolve(&format!("{at}/phantom"))).transpose()?;
    let possible = if phantom.is_some() { Projector::Exact } else { Projector::Joseph };
    if projector.is_some_and(|asked| asked != possible) {
        let permitted = "exact for a phantom, joseph for a volume";
        return Err(Error::invalid(format!("{at}/projector"), "does not go with what is projected", permitted));
    }
    let most_bytes = assets.limits().volume.max_volume_bytes;
    let made = Projection { phantom, asked, most_bytes };
    let said = if made.phantom.is_some() { made.asked.clone() } else { made.asked.clone().of_data(VIEWS, [1; 2]) };
    made.checked(said.resolve(&format!("{at}/geometry"))?)?;
    Ok(Arc::new(made))
}

impl Projection {
    /// The geometry for a subject, and how it is said.
    fn geometry(&self, bounds: &Bounds) -> Result<(GeometryRequest, Geometry)> {
        // All of the box is seen from all sides.
        let half = |along: fn(DVec3) -> f64| bounds.corners().into_iter().map(along).fold(0.0, f64::max);
        let size = [half(|p| p.truncate().length()), half(|p| p.z.abs())].map(|half| 2.0 * half);
        let asked = self.asked.clone().seeing(size, bounds.smallest_side(), VIEWS);
        let geometry = self.checked(asked.resolve("/project/geometry")?)?;
        Ok((asked, geometry))
    }

    /// The geometry, if its sinogram is not too large.
    fn checked(&self, geometry: Geometry) -> Result<Geometry> {
        let bytes = (size_of::<f32>() * geometry.count().iter().product::<usize>() * geometry.views()) as u64;
        if bytes > self.most_bytes {
            let limit = format!("{} bytes", self.most_bytes);
            return Err(Error::TooLarge { what: format!("a sinogram of {bytes} bytes"), limit });
        }
        Ok(geometry)
    }
}

/// A view of a grid.
fn view(bounds: &Bounds, geometry: &Geometry, view: usize) -> ProjectView {
    let index_from_world = bounds.world_from_index().inverse();
    // Planes have their numbers at voxel centres.
    let place = |bin: [usize; 2]| index_from_world.transform_point3(geometry.ray(view, bin).origin) - 0.5;
    let direction = index_from_world.transform_vector3(geometry.ray(view, [0, 0]).direction);
    let axis = (0..3).max_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs())).unwrap_or(0);
    let first = place([0, 0]);
    let [along_u, along_v] = geometry.bin_steps(view).map(|step| index_from_world.transform_vector3(step));
    let of = |other: usize| {
        let slope = direction[other] / direction[axis];
        let at_plane_0 = |p: DVec3| (p[other] - p[axis] * slope) as f32;
        [at_plane_0(first), at_plane_0(along_u), at_plane_0(along_v), slope as f32]
    };
    let [across, down] = [[1, 2], [0, 2], [0, 1]][axis].map(of);
    ProjectView { axis: axis as i32, length: (1.0 / direction[axis].abs()) as f32, across, down }
}

impl Export for Projection {
    fn needs_volume(&self) -> bool {
        self.phantom.is_none()
    }

    fn check(&self, bounds: &Bounds) -> Result<()> {
        if self.phantom.is_some() {
            return Ok(());
        }
        let (_, geometry) = self.geometry(bounds)?;
        let corners = bounds.corners();
        if (0..geometry.views()).any(|view| geometry.sees(view, &corners)) {
            return Ok(());
        }
        let permitted = "a detector that a part of the volume is projected to";
        Err(Error::invalid("/project/geometry", "no ray of it meets the volume", permitted))
    }

    fn kernels(&self, subject: &Subject) -> Result<Vec<Variant>> {
        Ok(if self.phantom.is_some() { Vec::new() } else { vec![variant(subject.needed_volume()?.voxel_type())] })
    }

    fn begin(&self, device: &mut Device, seen: OnDevice) -> Result<Box<dyn Process<Look = File>>> {
        if let Some(phantom) = &self.phantom {
            let geometry = self.asked.resolve("/project/geometry")?;
            let asked = self.asked.clone().of_data(geometry.views(), geometry.count());
            return Ok(Box::new(Exact::new(phantom.clone(), asked, geometry)));
        }
        let volume = seen.subject.needed_volume()?.clone();
        let voxels = seen.voxels.ok_or_else(|| Error::internal("a volume that is not on the device"))?;
        let bounds = seen.subject.bounds();
        let (asked, geometry) = self.geometry(bounds)?;
        let views: Vec<ProjectView> = (0..geometry.views()).map(|number| view(bounds, &geometry, number)).collect();
        Ok(Box::new(Run::new(device, volume, voxels, asked, geometry, &views)?))
    }
}
