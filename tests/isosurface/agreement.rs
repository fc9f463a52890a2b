//! Forms that must agree: with and without skipping, any number of lanes, and the same request twice.

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

fn looks() -> [Value; 6] {
    [
        json!({}),
        json!({"output": "depth"}),
        json!({"sampling": "nearest"}),
        json!({"interpolation": "catmull_rom"}),
        json!({"ambient_occlusion": {}}),
        json!({"surfaces": [{"isovalue": 0.1, "opacity": 0.4}, {"isovalue": 60, "opacity": 0.4}, {"isovalue": 90}]}),
    ]
}

fn worst(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn skipping_changes_nothing() {
    let house = House::shared();
    let wave = |x: f64, y: f64, z: f64| 0.1 + (5.0 * x).sin() * (4.0 * y).cos() + 0.3 * z;
    let mut volumes = vec![
        (house.file(mri_head()), "head"),
        (json!({"builtin": "smoke", "resolution": 64}), "smoke"),
        (house.floats([40, 37, 43], wave), "floats"),
    ];
    volumes.extend(ct_head().map(|bytes| (house.file(bytes), "CT")));
    for (volume, name) in volumes {
        for look in looks() {
            for step_voxels in [1.0, 3.0] {
                let of = |skip: bool| {
                    film(
                        house,
                        &volume,
                        &with(&look, json!({"empty_space_skipping": skip, "step_voxels": step_voxels})),
                    )
                };
                let (quick, slow) = (of(true), of(false));
                let off = worst(&quick, &slow);
                assert!(off <= 1e-6, "{name}, {look}, step {step_voxels}: {off:e}");
                let seen = slow.chunks_exact(4).filter(|p| p[3] > 0.0).count();
                assert!(seen > 50, "{name}, {look}: {seen} pixels show something");
            }
        }
    }
}

/// How many of the pixels are further apart than that.
fn apart(a: &[f32], b: &[f32], most: f32) -> usize {
    let far = |(a, b): &(&[f32], &[f32])| worst(a, b) > most;
    a.chunks_exact(4).zip(b.chunks_exact(4)).filter(far).count()
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let reference = House::shared();
    let wave = |x: f64, y: f64, z: f64| 1.0 + (5.0 * x).sin() * (4.0 * y).cos() + z;
    for lanes in [1, 4, 8] {
        let house = House::new(Some(lanes));
        let bytes = ([house.file(mri_head()), reference.file(mri_head())], 1.0);
        let floats = ([&house, reference].map(|h| h.floats([40, 37, 43], wave)), 2.0 / 43.0);
        for look in looks() {
            for ([here, there], voxel) in [&bytes, &floats] {
                let (narrow, wide) = (film(&house, here, &look), film(reference, there, &look));
                // A ten-thousandth of a voxel; of a colour a fraction of a grey level.
                let most = if look["output"] == "depth" { 1e-4 * voxel } else { 1e-4 };
                // Rounding decides whether a ray that grazes a surface meets it.
                let apart = apart(&narrow, &wide, most);
                assert!(
                    apart * 1000 < narrow.len() / 4,
                    "{lanes} lanes, {look}: {apart} pixels, {:e}",
                    worst(&narrow, &wide)
                );
            }
        }
    }
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
