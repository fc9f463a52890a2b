//! Volumes whose values fall as their voxels rise, beside the same values with a scale that rises.

use cloudchamber::volume::RawType;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::writers::{Nifti, encode};

const DIMS: [usize; 3] = [32, 30, 28];

/// Waves from 20 to 200 in whole numbers, as a file with value = slope · raw + inter.
fn scan(raw: RawType, slope: f64, inter: f64) -> Vec<u8> {
    let [nx, ny, nz] = DIMS;
    let mut file = Nifti::new(false, DIMS.map(|n| n as u16), raw);
    file.put_f32(112, slope as f32);
    file.put_f32(116, inter as f32);
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let value = |i: usize| {
        let (x, y, z) = (place(i % nx, nx), place(i / nx % ny, ny), place(i / nx / ny, nz));
        (110.0 + 70.0 * (1.0 - (x * x + y * y + z * z)) * (3.0 * x + 1.0).cos() * (2.0 * y - z).cos()).round()
    };
    let data: Vec<u8> = (0..nx * ny * nz).flat_map(|i| encode(raw, false, (value(i) - inter) / slope)).collect();
    file.with(&data)
}

fn film(volume: &Value, own: &Value) -> Vec<f32> {
    let request = json!({
        "technique": "isosurface", "volume": volume, "image": {"width": 48, "height": 48}, "budget": {"samples": 1},
        "camera": {"eye": [30, 45, 60], "fov_y_deg": 24}, "isosurface": own
    });
    House::shared().film(&request).0.main.mean.clone()
}

/// The isovalues are values of no voxel, since rounding would decide there.
fn forms() -> Vec<Value> {
    let inner = json!({"isovalue": 139.7, "color": [0.2, 0.9, 0.4], "opacity": 0.6});
    let outer = json!({"isovalue": 111.3, "color": [0.9, 0.3, 0.1], "opacity": 0.3});
    vec![
        json!({"isovalue": 125.3}),
        json!({"isovalue": 125.3, "output": "depth"}),
        json!({"isovalue": 125.3, "interpolation": "b_spline"}),
        json!({"isovalue": 125.3, "interpolation": "catmull_rom", "normals": "analytic"}),
        json!({"isovalue": 125.3, "sampling": "nearest"}),
        json!({"isovalue": 125.3, "sampling": "nearest", "output": "depth"}),
        json!({"surfaces": [inner, outer]}),
        json!({"isovalue": 125.3, "ambient_occlusion": {"radius": 8}}),
        json!({}),
    ]
}

#[test]
fn a_falling_scale_shows_what_a_rising_one_shows_of_the_same_values() {
    let house = House::shared();
    let rising = house.file(scan(RawType::U8, 1.0, 0.0));
    for (raw, slope, inter) in
        [(RawType::U8, -1.0, 240.0), (RawType::I16, -0.5, -100.0), (RawType::F32, -0.25, 7.0), (RawType::U16, 0.5, 4.0)]
    {
        let other = house.file(scan(raw, slope, inter));
        for own in forms() {
            let (a, b) = (film(&other, &own), film(&rising, &own));
            // The bound is a ten-thousandth of a voxel in world units, or a part of a grey level.
            let most = if own["output"] == "depth" { 1e-4 } else { 2e-5 };
            let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < most, "{raw:?}, slope {slope}, {own}: {off:e}");
            let seen = b.chunks_exact(4).filter(|p| p[3] > 0.0).count();
            assert!(seen > 300, "{own}: {seen} pixels show something");
        }
    }
}
