//! `project`: Joseph's method in double precision, closed forms, and reconstructions of what was projected.

use cloudchamber::error::Error;
use cloudchamber::job::State;
use cloudchamber::tomography::{Geometry, GeometryRequest, Sinogram, SinogramParts};
use cloudchamber::volume::Volume;
use glam::DVec3;
use serde_json::{Value, json};

use crate::common::engine::House;
use crate::common::pictures;
use crate::tomography::reconstructed;

/// The file of a projection.
fn file(house: &House, volume: &Value, own: &Value) -> (Vec<u8>, Value) {
    let job = house.export(&json!({"technique": "project", "volume": volume, "project": own}));
    assert_eq!(job.state(), State::Done, "{:?}", job.failure());
    let file = job.file().unwrap();
    assert_eq!((file.media_type, file.extension), ("application/octet-stream", "nrrd"));
    (file.bytes.to_vec(), job.resource()["result"].clone())
}

fn projected(house: &House, volume: &Value, own: &Value) -> (Sinogram, Value) {
    let (bytes, result) = file(house, volume, own);
    let parts = SinogramParts { meta: None, lengths: [bytes.len(), 0, 0] };
    (Sinogram::read(&bytes, "test", &parts, 1 << 24).unwrap(), result)
}

fn geometry(said: &Value) -> Geometry {
    serde_json::from_value::<GeometryRequest>(said.clone()).unwrap().resolve("").unwrap()
}

/// Joseph's sum along the ray of a bin.
fn joseph(volume: &Volume, geometry: &Geometry, view: usize, bin: [usize; 2]) -> f64 {
    let (ray, index) = (geometry.ray(view, bin), volume.world_from_index().inverse());
    let (from, along) = (index.transform_point3(ray.origin) - 0.5, index.transform_vector3(ray.direction));
    let axis = (0..3).max_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs())).unwrap();
    let (dims, values) = (volume.dims(), volume.values().unwrap());
    let at = |p: [i64; 3]| {
        let inside = (0..3).all(|i| (0..dims[i] as i64).contains(&p[i]));
        let value = if inside { values.at(p[0] as usize, p[1] as usize, p[2] as usize) } else { 0.0 };
        if value.is_nan() { 0.0 } else { value }
    };
    let [b, c] = [[1, 2], [0, 2], [0, 1]][axis];
    let in_plane = |plane: usize| {
        let p = from + (plane as f64 - from[axis]) / along[axis] * along;
        let (low, mut sum) = (p.floor(), 0.0);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut voxel = [plane as i64; 3];
            (voxel[b], voxel[c]) = (low[b] as i64 + i, low[c] as i64 + j);
            let weight =
                |axis: usize, upper: i64| if upper == 1 { p[axis] - low[axis] } else { 1.0 - (p[axis] - low[axis]) };
            sum += weight(b, i) * weight(c, j) * at(voxel);
        }
        sum
    };
    (0..dims[axis]).map(in_plane).sum::<f64>() / along[axis].abs()
}

/// The upload of a test volume.
fn test_volume(name: &str) -> Value {
    pictures::with_volumes(&json!({"test": name}), House::shared())
}

fn stored(reference: &Value) -> std::sync::Arc<Volume> {
    House::shared().assets().volumes().get(reference["id"].as_str().unwrap()).unwrap()
}

#[test]
fn projections_are_josephs_sums_in_double_precision_on_any_grid() {
    // Bytes, words, floats with holes, and an oblique grid whose values fall as voxels rise.
    for name in ["u8", "i16", "u16", "holes", "falling", "plate"] {
        let reference = test_volume(name);
        let volume = stored(&reference);
        let said = json!({"angles_deg": [0, 17, 44, 45, 46, 90, 133, 180, 271], "detector": {"count": [37, 11], "spacing_mm": [0.11, 0.23], "offset_mm": [0.05, 0.03]}});
        let (sinogram, result) = projected(House::shared(), &reference, &json!({"geometry": said}));
        let geometry = geometry(&said);
        assert_eq!(sinogram.geometry(), &geometry, "{name}");
        let [u, v] = geometry.count();
        let greatest = sinogram.values().iter().fold(0.0, |most: f32, p| most.max(p.abs()));
        assert!(greatest > 0.0, "{name}");
        for (i, found) in sinogram.values().iter().enumerate() {
            let truth = joseph(&volume, &geometry, i / (u * v), [i % u, i / u % v]);
            assert!((f64::from(*found) - truth).abs() < 2e-5 * f64::from(greatest), "{name}, {i}: {found} for {truth}");
        }
        let codes: Vec<&str> =
            result["warnings"].as_array().unwrap().iter().filter_map(|w| w["code"].as_str()).collect();
        assert_eq!(codes.contains(&"no_value"), name == "holes", "{name}: {codes:?}");
    }
}

#[test]
fn a_phantom_is_projected_exactly() {
    let phantom = json!({"name": "shepp_logan", "dimensions": 3, "radius_mm": 30});
    let said = json!({"angles_deg": [0, 33, 90], "detector": {"count": [40, 3], "spacing_mm": [2, 9]}});
    let job = House::shared().export(
        &json!({"technique": "project", "project": {"phantom": phantom, "geometry": said, "projector": "exact"}}),
    );
    let bytes = job.file().unwrap().bytes.to_vec();
    let sinogram =
        Sinogram::read(&bytes, "test", &SinogramParts { meta: None, lengths: [bytes.len(), 0, 0] }, 1 << 20).unwrap();
    let (phantom, geometry) = (crate::tomography::phantom(&phantom), geometry(&said));
    for (i, found) in sinogram.values().iter().enumerate() {
        let truth = phantom.integral(&geometry.ray(i / 120, [i % 40, i / 40 % 3]));
        assert_eq!(*found, truth as f32, "{i}");
    }
    assert_eq!((sinogram.geometry(), &job.resource()["result"]["projector"]), (&geometry, &json!("exact")));
}

#[test]
fn every_number_of_lanes_projects_the_same() {
    let own =
        json!({"geometry": {"angles_deg": {"count": 20}, "detector": {"count": [45, 5], "spacing_mm": [0.06, 0.5]}}});
    let of = |lanes| file(House::of_lanes(lanes), &json!({"builtin": "smoke", "resolution": 24}), &own).0;
    let values = |bytes: &[u8]| {
        Sinogram::read(bytes, "", &SinogramParts { meta: None, lengths: [bytes.len(), 0, 0] }, 1 << 20).unwrap()
    };
    let plain = values(&of(1));
    for lanes in [4, 8, 16] {
        let apart =
            plain.values().iter().zip(values(&of(lanes)).values()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-5, "{lanes}: {apart}");
    }
}

/// A Gaussian's integral along a ray is its own closed form. Angles and bins are out of step with the voxels, so that places between them are all
/// equally likely.
#[test]
fn a_smooth_object_has_an_error_of_second_order() {
    let said = json!({"angles_deg": {"from": 3.7, "to": 180, "count": 23}, "detector": {"count": [61, 1], "spacing_mm": [0.0217, 1], "offset_mm": [0.0071, 0]}});
    let geometry = geometry(&said);
    let sigma = 0.17;
    let error = |side: usize| {
        let value = |x: f64, y: f64, z: f64| (-(x * x + y * y + z * z) / (2.0 * sigma * sigma)).exp();
        let (sinogram, _) =
            projected(House::shared(), &House::shared().floats([side, side, side], value), &json!({"geometry": said}));
        let apart = |(i, found): (usize, &f32)| {
            let u = geometry.place_mm(0, (i % 61) as f64);
            let truth = (std::f64::consts::TAU).sqrt() * sigma * (-u * u / (2.0 * sigma * sigma)).exp();
            (f64::from(*found) - truth).powi(2)
        };
        (sinogram.values().iter().enumerate().map(apart).sum::<f64>() / sinogram.values().len() as f64).sqrt()
    };
    let errors = [24, 48, 96].map(error);
    for pair in errors.windows(2) {
        assert!((3.4..4.6).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn what_is_projected_is_reconstructed_at_any_size_of_voxels_and_bins() {
    for (side, bins, spacing) in [(40, 64, 0.04), (64, 90, 0.03)] {
        let disc = House::shared().floats([side, side, 1], |x, y, _| if x * x + y * y < 0.49 { 0.8 } else { 0.0 });
        let said =
            json!({"angles_deg": {"count": 180}, "detector": {"count": [bins, 1], "spacing_mm": [spacing, spacing]}});
        let (bytes, result) = file(House::shared(), &disc, &json!({"geometry": said}));
        assert!(result["data_check"]["sum_deviation"].as_f64().unwrap() < 0.01, "{result}");
        let (_, id, _) = House::shared().assets().sinograms().insert(bytes, "test", None).unwrap();
        let found = reconstructed("fbp", &json!({"sinogram": {"id": id}}));
        let inside = |i: &usize| {
            let place = |n: usize| (n as f64 - 0.5 * (bins as f64 - 1.0)) * spacing;
            DVec3::new(place(i % bins), place(i / bins), 0.0).length() < 0.55
        };
        let values: Vec<f64> = (0..bins * bins).filter(inside).map(|i| found.values[i]).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!((mean - 0.8).abs() < 0.016, "{side}: {mean}");
    }
}

#[test]
fn without_a_geometry_all_of_the_box_is_seen() {
    let (sinogram, result) = projected(House::shared(), &json!({"builtin": "sphere", "resolution": 20}), &json!({}));
    // The box of 2 × 2 × 2 has a diagonal of 2.83 across z.
    assert_eq!((sinogram.geometry().views(), sinogram.geometry().count()), (180, [29, 20]), "{result}");
    assert_eq!(result["warnings"], json!([]), "nothing is cut off");
}

/// A detector may see any part of the box, whether or not a corner or the centre falls on it.
#[test]
fn a_detector_between_the_corners_sees_the_volume() {
    let said = json!({"angles_deg": [0, 90], "detector": {"count": [96, 1], "spacing_mm": [0.03, 0.03], "offset_mm": [0, 0.3]}});
    let (sinogram, _) =
        projected(House::shared(), &json!({"builtin": "sphere", "resolution": 32}), &json!({"geometry": said}));
    assert!(sinogram.values().iter().any(|p| *p > 0.1));
    // Where the detector is moved and its bins are not said, all of the box is seen all the same.
    let aside = json!({"geometry": {"angles_deg": [0, 60], "detector": {"offset_mm": [0.9, 0]}}});
    let (_, result) = projected(House::shared(), &json!({"builtin": "sphere", "resolution": 16}), &aside);
    assert!(result["data_check"]["at_edges"].as_f64().unwrap() < 0.01, "{result}");
    // What is not said of a large detector are 180 views, not 360.
    let large = json!({"technique": "project", "volume": {"builtin": "sphere", "resolution": 8}, "project": {"geometry": {"detector": {"count": [1024, 1024]}}}});
    let house = House::shared();
    assert!(cloudchamber::render::ExportTask::from_json(&large, house.assets(), house.service.limits()).is_ok());
}

#[test]
fn wrong_projections_are_refused_at_their_field() {
    let house = House::shared();
    let of =
        |own: Value| json!({"technique": "project", "volume": {"builtin": "sphere", "resolution": 8}, "project": own});
    let parsed = |request: &Value| {
        cloudchamber::render::ExportTask::from_json(request, house.assets(), house.service.limits()).map(drop)
    };
    for (own, at) in [
        (json!({"geometry": {"detector": {"count": [0, 1]}}}), "/project/geometry/detector/count/0"),
        (json!({"geometry": {"angles_deg": []}}), "/project/geometry/angles_deg"),
        (json!({"geometry": {"angles_deg": {"count": 0}}}), "/project/geometry/angles_deg"),
        (json!({"geometry": {"type": "spiral"}}), "/project/geometry/type"),
        (json!({"projector": "siddon"}), "/project/projector"),
        (json!({"projector": "exact"}), "/project/projector"),
        (json!({"views": 3}), "/project/views"),
    ] {
        match parsed(&of(own.clone())) {
            Err(Error::Invalid(violations)) => {
                assert!(violations.iter().any(|v| v.pointer.starts_with(at)), "{own}: {violations:?}")
            }
            other => panic!("{own}: {other:?}"),
        }
    }
    let head = json!({"name": "shepp_logan"});
    for (request, at) in [
        (json!({"technique": "project", "project": {"phantom": head, "projector": "joseph"}}), "/project/projector"),
        (json!({"technique": "project", "project": {"phantom": {}}}), "/project/phantom"),
        (
            json!({"technique": "project", "project": {"phantom": {"name": "shepp_logan", "greys": "pink"}}}),
            "/project/phantom/greys",
        ),
        (json!({"technique": "project", "volume": {"builtin": "sphere"}, "project": {"phantom": head}}), "/volume"),
    ] {
        match parsed(&request) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].pointer, at, "{request}"),
            other => panic!("{request}: {other:?}"),
        }
    }
    let large = of(json!({"geometry": {"angles_deg": {"count": 60_000}, "detector": {"count": [8000, 8000]}}}));
    assert!(matches!(parsed(&large), Err(Error::TooLarge { .. })));
    // A field is refused before it is computed, too.
    let beside = json!({"geometry": {"detector": {"count": [9, 1], "offset_mm": [500, 0]}}});
    for volume in [json!({"builtin": "sphere", "resolution": 8}), json!({"photon_transport": {"grid": [4, 4, 4]}})] {
        match parsed(&json!({"technique": "project", "volume": volume, "project": beside})) {
            Err(Error::Invalid(violations)) => assert_eq!(violations[0].detail, "no ray of it meets the volume"),
            other => panic!("{volume}: {other:?}"),
        }
    }
}
