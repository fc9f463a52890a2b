//! Projections of a smooth body by Joseph's method, by the size of voxels, against the body's own integrals.

use glam::DVec3;
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::study::bench::{Bench, Reads};
use crate::study::{Case, Scale, Setting, Trial, Truth};
use crate::tomography::{GeometryRequest, PhantomRequest};

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "project",
    title: "Projections of a smooth body",
    when: "a volume, and want its sinogram",
    choose: "`joseph` on voxels of the bins' size: half the side of a voxel is a quarter of the error, for twice the planes along each ray",
    trial,
};

/// The side of the volume, mm.
const SIZE_MM: f64 = 64.0;

fn read<T: serde::de::DeserializeOwned>(value: &Value) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(Error::internal)
}

fn trial(bench: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    // Angles and bins are out of step with the voxels, so that all places between them are as likely.
    let said = json!({"angles_deg": {"from": 2.3, "to": 182.3, "count": 60}, "detector": {"count": [81, 5], "spacing_mm": [0.73, 6.1], "offset_mm": [0.17, 0.3]}});
    let body = json!({"shapes": [{"type": "gaussian", "axes_mm": [6, 4, 7], "center_mm": [2, -3, 1], "angle_deg": 25},
        {"type": "gaussian", "value": 0.6, "axes_mm": [3.5, 5, 4], "center_mm": [-8, 4, -3]}]});
    let geometry = read::<GeometryRequest>(&said)?.resolve("")?;
    let body = read::<PhantomRequest>(&body)?.resolve("")?;
    let [u, v] = geometry.count();
    let integral = |i: usize| body.integral(&geometry.ray(i / (u * v), [i % u, i / u % v]));
    let values: Vec<f64> = (0..u * v * geometry.views()).map(integral).collect();
    let mut settings = Vec::new();
    for side in scale.pick(vec![32, 64], vec![24, 32, 48, 64, 96, 128, 192]) {
        let volume = bench.floats([side; 3], [SIZE_MM; 3], |p| body.at(DVec3::from(p)))?;
        let request = json!({"technique": "project", "volume": volume, "project": {"geometry": said}});
        let setting = Setting::stepped("joseph", "mm / voxel", SIZE_MM / f64::from(side as u32), Some(2.0), request);
        settings.push(setting.reading(Reads::Sinogram));
    }
    let words = "the Gaussians' own integrals, in closed form".to_owned();
    Ok(Ok(Trial { truth: Truth { words, values, centres: None, size: None, known_to: 1e-6 }, settings }))
}
