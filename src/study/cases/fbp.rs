//! A head of ellipses from its exact projections: filters against the number of views, beside the means of its voxels.

use glam::DVec3;
use serde_json::json;

use crate::error::Result;
use crate::study::bench::{Bench, Reads};
use crate::study::{Case, Scale, Setting, Trial, Truth};
use crate::tomography::Phantom;

/// The case's entry in the list.
pub const CASE: Case = Case {
    name: "fbp",
    title: "A head from its projections",
    when: "projections of an object, from many directions and without noise",
    choose: "`fbp` with `ram_lak` and as many views as bins; with fewer views streaks are the error, and a window hides a part of them",
    trial,
};

/// Voxels of 1 mm a side; bins of 1 mm.
const SIDE: usize = 200;
const BINS: usize = 256;
/// Points a side of a voxel whose mean is its true value.
const POINTS: usize = 8;

fn trial(_: &Bench, scale: Scale) -> Result<std::result::Result<Trial, String>> {
    let head = Phantom::shepp_logan();
    let place = |i: usize, n: usize| i as f64 - 0.5 * (n as f64 - 1.0);
    let mean = |i: usize| {
        let point = |p: usize| {
            let within = |p: usize| place(p, POINTS) / POINTS as f64;
            let (x, y) = (place(i % SIDE, SIDE) + within(p % POINTS), place(i / SIDE, SIDE) + within(p / POINTS));
            head.at(DVec3::new(x, y, 0.0))
        };
        (0..POINTS * POINTS).map(point).sum::<f64>() / (POINTS * POINTS) as f64
    };
    let values: Vec<f64> = (0..SIDE * SIDE).map(mean).collect();
    let mut settings = Vec::new();
    for filter in ["ram_lak", "shepp_logan", "hann"] {
        for views in scale.pick(vec![30, 120], vec![15, 30, 60, 120, 240, 480]) {
            let geometry = json!({"angles_deg": {"count": views}, "detector": {"count": [BINS, 1]}});
            let own = json!({"sinogram": {"projection": {"geometry": geometry}}, "filter": filter,
                "grid": {"dims": [SIDE, SIDE, 1], "spacing_mm": [1, 1, 1]}});
            let request = json!({"technique": "slice", "volume": {"fbp": own}, "image": {"width": 8, "height": 8},
                "budget": {"samples": 1}});
            let line = format!("fbp, {filter}");
            settings.push(Setting::stepped(&line, "views", f64::from(views), None, request).reading(Reads::Field));
        }
    }
    let words = format!("the ellipses' own values, the mean of {POINTS} × {POINTS} points of each voxel");
    Ok(Ok(Trial { truth: Truth { words, values, centres: None, size: Some([SIDE; 2]), known_to: 5e-3 }, settings }))
}
