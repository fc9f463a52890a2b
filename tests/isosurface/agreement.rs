//! Forms that must agree: with and without skipping, any number of lanes, a falling scale, and the same request twice.

use serde_json::{Value, json};

use super::common::engine::House;
use super::common::{ct_head, mri_head};

fn film(house: &House, volume: &Value, parameters: &Value) -> Vec<f32> {
    let request = json!({
        "technique": "isosurface", "volume": volume, "image": {"width": 72, "height": 64}, "budget": {"samples": 1},
        "isosurface": parameters
    });
    house.film(&request).0.main.mean.clone()
}

fn with(a: &Value, b: Value) -> Value {
    let mut both = a.clone();
    both.as_object_mut().unwrap().extend(b.as_object().unwrap().clone());
    both
}

fn looks() -> [Value; 4] {
    [json!({}), json!({"output": "depth"}), json!({"sampling": "nearest"}), json!({"interpolation": "catmull_rom"})]
}

#[test]
fn skipping_changes_nothing() {
    let house = House::shared();
    let mut volumes = vec![house.file(mri_head()), json!({"builtin": "smoke", "resolution": 64})];
    volumes.extend(ct_head().map(|bytes| house.file(bytes)));
    let shells =
        json!({"surfaces": [{"isovalue": 0.1, "opacity": 0.4}, {"isovalue": 60, "opacity": 0.4}, {"isovalue": 90}]});
    for volume in volumes {
        for look in looks().iter().chain([&shells]) {
            let of = |skip: bool| film(house, &volume, &with(look, json!({"empty_space_skipping": skip})));
            let (quick, slow) = (of(true), of(false));
            let apart = quick.iter().zip(&slow).filter(|(a, b)| (*a - *b).abs() > 2e-5 * b.abs().max(1.0)).count();
            assert_eq!(apart, 0, "{volume}, {look}");
            if look != &shells {
                assert!(slow.chunks_exact(4).filter(|p| p[3] > 0.0).count() > 50, "{volume}, {look}: nothing to see");
            }
        }
    }
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let reference = House::shared();
    let wave = |x: f64, y: f64, z: f64| 1.0 + (5.0 * x).sin() * (4.0 * y).cos() + z;
    for lanes in [1, 4, 8] {
        let house = House::new(Some(lanes));
        let bytes = [house.file(mri_head()), reference.file(mri_head())];
        let floats = [&house, reference].map(|h| h.floats([40, 37, 43], wave));
        for look in looks() {
            for [here, there] in [&bytes, &floats] {
                let (narrow, wide) = (film(&house, here, &look), film(reference, there, &look));
                // Rounding decides whether a ray that grazes a surface meets it.
                let apart = narrow.iter().zip(&wide).filter(|(a, b)| (*a - *b).abs() > 1e-3 * b.abs().max(1.0)).count();
                assert!(apart * 500 < narrow.len(), "{lanes} lanes, {look}: {apart} of {} values", narrow.len());
            }
        }
    }
}

/// A NIfTI file of a bright middle whose scale falls: values are 200 − raw.
fn falling() -> Vec<u8> {
    let (nx, ny, nz) = (32usize, 30usize, 28usize);
    let mut header = vec![0u8; 352];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    for (i, n) in [3, nx, ny, nz, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * i, &(n as i16).to_le_bytes());
    }
    put(70, &2i16.to_le_bytes());
    put(72, &8i16.to_le_bytes());
    for i in 0..4 {
        put(76 + 4 * i, &1f32.to_le_bytes());
    }
    put(108, &352f32.to_le_bytes());
    put(112, &(-1f32).to_le_bytes());
    put(116, &200f32.to_le_bytes());
    put(344, b"n+1\0");
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
    let raw = |i: usize| {
        let p = [place(i % nx, nx), place(i / nx % ny, ny), place(i / nx / ny, nz)];
        (180.0 * (1.0 - p.iter().map(|v| v * v).sum::<f64>() / 3.0)).round() as u8
    };
    header.extend((0..nx * ny * nz).map(raw));
    header
}

#[test]
fn a_falling_scale_shows_the_same_surface() {
    let house = House::shared();
    let mut rising = falling();
    rising[112..116].copy_from_slice(&1f32.to_le_bytes());
    rising[116..120].copy_from_slice(&0f32.to_le_bytes());
    let (falls, rises) = (house.file(falling()), house.file(rising));
    for look in [json!({"output": "depth"}), json!({})] {
        let a = film(house, &falls, &with(&look, json!({"isovalue": 200.0 - 110.5})));
        let b = film(house, &rises, &with(&look, json!({"isovalue": 110.5})));
        assert!(b.chunks_exact(4).filter(|p| p[3] > 0.0).count() > 500);
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 2e-5 * b.abs().max(1.0)), "{look}");
    }
    // The plain form sees what is at or above the isovalue: outside, where this scale is high.
    let plain = film(house, &falls, &json!({"isovalue": 89.5, "sampling": "nearest", "output": "depth"}));
    let faces = film(house, &rises, &json!({"isovalue": 0, "sampling": "nearest", "output": "depth"}));
    assert!(plain.iter().zip(&faces).filter(|(a, b)| (*a - *b).abs() < 0.1).count() * 10 > 9 * plain.len());
}

#[test]
fn the_same_request_gives_the_same_bytes() {
    let house = House::shared();
    let volume = house.file(mri_head());
    let request = json!({"technique": "isosurface", "volume": volume, "image": {"width": 96, "height": 80}, "budget": {"samples": 3},
        "isosurface": {"ambient_occlusion": {}}});
    let png = || house.finish(&request).watch().borrow().frame.as_ref().unwrap().png.clone();
    assert_eq!(png(), png());
}
