//! What tests of reconstructions share, and requests that are refused.

mod refused;
mod sinograms;

use cloudchamber::tomography::{Phantom, PhantomRequest};
use glam::DVec3;
use serde_json::{Value, json};

use crate::common::engine::House;

/// A reconstruction: its values, x fastest, and the reply's `result`.
pub struct Reconstructed {
    pub dims: [usize; 3],
    pub values: Vec<f64>,
    pub result: Value,
}

/// Runs a field to its end.
pub fn reconstructed(technique: &str, own: &Value) -> Reconstructed {
    let request = json!({"technique": "slice", "volume": {technique: own}, "image": {"width": 8, "height": 8}, "budget": {"samples": 1}});
    let job = House::shared().finish(&request);
    let field = job.field().expect("a field");
    let values = field.values().unwrap();
    Reconstructed {
        dims: field.dims(),
        values: (0..field.voxel_count()).map(|i| values.of(i)).collect(),
        result: job.resource()["result"].clone(),
    }
}

/// A phantom of a request.
pub fn phantom(request: &Value) -> Phantom {
    serde_json::from_value::<PhantomRequest>(request.clone()).unwrap().resolve("").unwrap()
}

impl Reconstructed {
    /// The root mean square of the difference to a phantom at the voxels' centres, within `radius` of the axis; and its mean.
    pub fn apart(&self, from: &Phantom, spacing: f64, radius: f64) -> [f64; 2] {
        let centre = |i: usize, n: usize| (i as f64 - 0.5 * (n as f64 - 1.0)) * spacing;
        let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
        for (i, value) in self.values.iter().enumerate() {
            let [nx, ny, _] = self.dims;
            let point = DVec3::new(centre(i % nx, nx), centre(i / nx % ny, ny), centre(i / nx / ny, self.dims[2]));
            if point.truncate().length() <= radius {
                let apart = value - from.at(point);
                (squares, sum, count) = (squares + apart * apart, sum + apart, count + 1.0);
            }
        }
        [(squares / count).sqrt(), sum / count]
    }

    /// The codes of its warnings.
    pub fn codes(&self) -> Vec<&str> {
        self.result["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect()
    }
}
