//! Forms that must agree: with and without skipping, any number of lanes, and the same request twice.

use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::{ct_head, mri_head};

fn film(house: &House, volume: &Value, parameters: &Value) -> Vec<f32> {
    film_from(house, volume, &Value::Null, parameters)
}

/// The film from a camera, or from a place that has all of the volume in the picture.
fn film_from(house: &House, volume: &Value, camera: &Value, parameters: &Value) -> Vec<f32> {
    let mut request = json!({
        "technique": "isosurface", "volume": volume, "image": {"width": 72, "height": 64}, "budget": {"samples": 1},
        "isosurface": parameters
    });
    if !camera.is_null() {
        request["camera"] = camera.clone();
    }
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

/// Cameras that see some twelve voxels of a side, from afar. Only rays that are so close together leap over cells together.
fn close(reach: f64, voxel: f64) -> [Value; 4] {
    let fov_y_deg = 2.0 * (6.0 * voxel / reach).atan().to_degrees();
    [[0.8, 0.5, 0.6], [-0.5, -0.8, 0.4], [0.1, 0.2, -1.0], [-0.9, 0.3, 0.1]].map(|eye: [f64; 3]| {
        let target = [0.1 * eye[1] * reach, 0.06 * eye[2] * reach, 0.08 * eye[0] * reach];
        json!({"eye": eye.map(|v| v * reach), "target": target, "up": [0.1, 1, 0.3], "fov_y_deg": fov_y_deg})
    })
}

#[test]
fn skipping_changes_nothing() {
    let house = House::shared();
    let wave = |x: f64, y: f64, z: f64| 0.1 + (5.0 * x).sin() * (4.0 * y).cos() + 0.3 * z;
    let mut volumes = vec![
        ("head", house.file(mri_head()), close(400.0, 1.0)),
        ("smoke", json!({"builtin": "smoke", "resolution": 64}), close(4.0, 2.0 / 64.0)),
        ("floats", house.floats([40, 37, 43], wave), close(4.0, 2.0 / 43.0)),
    ];
    volumes.extend(ct_head().map(|bytes| ("CT", house.file(bytes), close(400.0, 0.8))));
    for (name, volume, close) in volumes {
        for look in looks() {
            let mut seen = 0;
            let cameras = close.iter().map(|camera| (camera.clone(), 1.0));
            for (camera, step_voxels) in cameras.chain([(Value::Null, 1.0), (Value::Null, 3.0)]) {
                let of = |skip: bool| {
                    let own = with(&look, json!({"empty_space_skipping": skip, "step_voxels": step_voxels}));
                    film_from(house, &volume, &camera, &own)
                };
                let (quick, slow) = (of(true), of(false));
                let off = worst(&quick, &slow);
                assert!(off <= 1e-6, "{name}, {look}, {camera}, step {step_voxels}: {off:e}");
                seen += slow.chunks_exact(4).filter(|p| p[3] > 0.0).count();
            }
            assert!(seen > 1000, "{name}, {look}: {seen} pixels show something");
        }
    }
}

/// The number of pixels that are further apart than `most`.
fn apart(a: &[f32], b: &[f32], most: f32) -> usize {
    let far = |(a, b): &(&[f32], &[f32])| worst(a, b) > most;
    a.chunks_exact(4).zip(b.chunks_exact(4)).filter(far).count()
}

#[test]
fn every_number_of_lanes_gives_the_same_picture() {
    let reference = House::shared();
    let wave = |x: f64, y: f64, z: f64| 1.0 + (5.0 * x).sin() * (4.0 * y).cos() + z;
    for lanes in [1, 4, 8] {
        let house = House::of_lanes(lanes);
        let bytes = ([house.file(mri_head()), reference.file(mri_head())], 1.0);
        let floats = ([house, reference].map(|h| h.floats([40, 37, 43], wave)), 2.0 / 43.0);
        for look in looks() {
            for ([here, there], voxel) in [&bytes, &floats] {
                let (narrow, wide) = (film(house, here, &look), film(reference, there, &look));
                // The bound is a ten-thousandth of a voxel for depth, and a fraction of a grey level for colour.
                let most = if look["output"] == "depth" { 1e-4 * voxel } else { 1e-4 };
                // Rounding decides if a ray that grazes a surface meets it.
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
