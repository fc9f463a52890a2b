//! Sinograms from elsewhere: an upload reconstructs as the measurement that it was made from, and wrong ones are refused at their part.

use cloudchamber::error::Error;
use cloudchamber::tomography::{GeometryRequest, Phantom, Quantity, Sinogram, SinogramMeta, SinogramParts};
use serde_json::{Value, json};

use super::{phantom, reconstructed};
use crate::common::engine::House;

const MOST: usize = 1 << 20;

fn meta(value: &Value) -> SinogramMeta {
    serde_json::from_value(value.clone()).unwrap()
}

/// The exact line integrals of a phantom.
fn integrals(phantom: &Phantom, geometry: &Value) -> Vec<f64> {
    let geometry = serde_json::from_value::<GeometryRequest>(geometry.clone()).unwrap().resolve("").unwrap();
    let [u, v] = geometry.count();
    let ray = |i: usize| geometry.ray(i / (u * v), [i % u, i / u % v]);
    (0..u * v * geometry.views()).map(|i| phantom.integral(&ray(i))).collect()
}

fn bytes(values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    values.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect()
}

/// Parts of bare floats.
fn parts(said: Value, files: [&[u8]; 3]) -> (Vec<u8>, SinogramParts) {
    let mut said = said;
    said["raw"] = json!({"type": "f32"});
    (files.concat(), SinogramParts { meta: Some(meta(&said)), lengths: files.map(<[u8]>::len) })
}

fn read(said: Value, files: [&[u8]; 3]) -> Result<Sinogram, Error> {
    let (bytes, parts) = parts(said, files);
    Sinogram::read(&bytes, "test", &parts, MOST)
}

/// The pointers of a refusal.
fn pointers(found: Result<Sinogram, Error>) -> Vec<String> {
    match found {
        Err(Error::Invalid(violations)) => violations.into_iter().map(|v| v.pointer).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_upload_reconstructs_as_what_it_was_made_from() {
    let shapes = json!({"shapes": [{"type": "ellipse", "value": 0.02, "axes_mm": [14, 9], "center_mm": [3, -2, 0]}, {"type": "gaussian", "value": 0.03, "axes_mm": [4, 4]}]});
    let geometry =
        json!({"angles_deg": {"to": 180, "count": 50}, "detector": {"count": [48, 1], "offset_mm": [0.25, 0]}});
    let exact =
        reconstructed("fbp", &json!({"sinogram": {"projection": {"of": {"phantom": shapes}, "geometry": geometry}}}));
    let line = integrals(&phantom(&shapes), &geometry);
    let (dark, flat) = (bytes((0..48).map(|u| 10.0 + u as f64)), bytes((0..48).map(|u| 5010.0 + 20.0 * u as f64)));
    let intensities = line.iter().enumerate().map(|(i, p)| {
        let u = (i % 48) as f64;
        10.0 + u + (5000.0 + 19.0 * u) * (-p).exp()
    });
    let counts = line.iter().map(|p| 1e6 * (-p).exp());
    for (said, files) in [
        (json!({"geometry": geometry}), [bytes(line.clone()), vec![], vec![]]),
        (json!({"geometry": geometry, "quantity": "counts", "photons_per_ray": 1e6}), [bytes(counts), vec![], vec![]]),
        (
            json!({"geometry": geometry, "quantity": "intensity"}),
            [bytes(intensities), [&flat[..], &flat].concat(), dark],
        ),
    ] {
        let (bytes, how) = parts(said.clone(), [&files[0], &files[1], &files[2]]);
        let (_, id, _) = House::shared().assets().sinograms().insert(bytes, "test", Some(how)).unwrap();
        let found = reconstructed("fbp", &json!({"sinogram": {"id": id}}));
        let greatest = exact.values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        for (found, exact) in found.values.iter().zip(&exact.values) {
            assert!((found - exact).abs() <= 2e-5 * greatest, "{said}: {found} for {exact}");
        }
        let axis = |of: &Value| of["data_check"]["axis_mm"].as_f64().unwrap();
        assert!((axis(&found.result) - axis(&exact.result)).abs() < 1e-4, "{said}: {}", axis(&found.result));
    }
}

/// T12: the logarithm of Poisson counts is biased, by published numbers.
#[test]
fn the_logarithm_of_counts_has_the_bias_that_is_known() {
    for (mean, bias, deviation) in [(10.0, 0.055_105_970_0, 0.346_740_997_7), (100.0, 0.005_042_438_4, 0.100_765_604_0)]
    {
        let most = 400usize;
        let counts = bytes((1..=most).map(|n| n as f64));
        let said = json!({"quantity": "counts", "photons_per_ray": mean, "geometry": {"angles_deg": [0], "detector": {"count": [most, 1]}}});
        let sinogram = read(said, [&counts, &[], &[]]).unwrap();
        let mut weights = vec![mean * f64::exp(-mean)];
        for n in 2..=most {
            weights.push(weights[n - 2] * mean / n as f64);
        }
        let all: f64 = weights.iter().sum();
        let moment =
            |k: i32| weights.iter().zip(sinogram.values()).map(|(w, p)| w * f64::from(*p).powi(k)).sum::<f64>() / all;
        let found = [moment(1), (moment(2) - moment(1).powi(2)).sqrt()];
        assert!((found[0] - bias).abs() < 1e-7 && (found[1] - deviation).abs() < 1e-7, "{mean}: {found:?}");
    }
}

#[test]
fn counts_of_nothing_are_half_a_photon_and_are_told() {
    let said = json!({"quantity": "counts", "photons_per_ray": 200, "geometry": {"angles_deg": [0], "detector": {"count": [4, 1]}}});
    let sinogram = read(said, [&bytes([200.0, 0.0, 100.0, 0.0]), &[], &[]]).unwrap();
    let truth = [0.0, 400f64.ln(), 2f64.ln(), 400f64.ln()];
    assert!(sinogram.values().iter().zip(truth).all(|(found, truth)| (f64::from(*found) - truth).abs() < 1e-6));
    assert!(sinogram.notes()[0].starts_with("2 of 4 readings (50.00 %)"), "{:?}", sinogram.notes());
}

#[test]
fn what_is_handed_out_is_read_as_the_same() {
    let geometry =
        json!({"angles_deg": {"count": 3}, "detector": {"count": [4, 2], "spacing_mm": [0.5, 2], "offset_mm": [1, 0]}});
    let counts = bytes((0..24).map(|i| 1000.0 - 7.0 * f64::from(i)));
    let sinogram =
        read(json!({"geometry": geometry, "quantity": "counts", "photons_per_ray": 2000}), [&counts, &[], &[]])
            .unwrap();
    let alone = |bytes: &[u8]| SinogramParts { meta: None, lengths: [bytes.len(), 0, 0] };
    let nrrd = sinogram.nrrd().unwrap();
    let again = Sinogram::read(&nrrd, "test", &alone(&nrrd), MOST).unwrap();
    assert_eq!((again.values(), again.geometry(), again.format()), (sinogram.values(), sinogram.geometry(), "nrrd"));
    assert_eq!(again.info("id", true).quantity, Quantity::Counts);
    // NumPy has no place for the geometry. Numbers of views and bins are the data's.
    let npy = sinogram.npy();
    assert_eq!((npy.len() - 96) % 64, 0, "the numbers are aligned");
    let said = meta(
        &json!({"quantity": "counts", "photons_per_ray": 2000, "geometry": {"detector": {"spacing_mm": [0.5, 2], "offset_mm": [1, 0]}}}),
    );
    let parts = SinogramParts { meta: Some(said), ..alone(&npy) };
    let again = Sinogram::read(&npy, "test", &parts, MOST).unwrap();
    assert_eq!((again.values(), again.geometry()), (sinogram.values(), sinogram.geometry()));
    assert!(Sinogram::read(&npy, "test", &alone(&npy), MOST).is_err(), "there is no geometry");
    let picture = sinogram.preview(Some(1)).unwrap();
    assert_eq!((picture.size, picture.bytes.len()), ([4, 2], 8));
    // Counts fall from bin to bin, so that the last of the first row is the brightest of all views' middle rows.
    let picture = sinogram.preview(None).unwrap();
    assert_eq!((picture.size, picture.bytes[0], picture.bytes[11]), ([4, 3], 0, 255));
}

#[test]
fn wrong_sinograms_are_refused_at_their_part() {
    let one = |count: [usize; 2], views: usize| json!({"angles_deg": {"count": views}, "detector": {"count": count}});
    let line = |geometry: Value| json!({"geometry": geometry});
    let twelve = bytes((0..12).map(f64::from));
    let as_counts = |more: Value| {
        let mut said = json!({"geometry": one([4, 1], 3), "quantity": "counts"});
        said.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        said
    };
    let with = |at: usize, value: f32| {
        let mut changed = twelve.clone();
        changed[4 * at..4 * at + 4].copy_from_slice(&value.to_le_bytes());
        changed
    };
    let bright = bytes([50.0, 50.0, 3.0, 50.0]);
    for (said, files, at) in [
        (line(one([5, 1], 3)), [&twelve[..], &[], &[]], "/data"),
        (line(one([0, 1], 3)), [&twelve, &[], &[]], "/meta/geometry/detector/count"),
        (line(one([4, 1], 1_000_000)), [&twelve, &[], &[]], "/meta/geometry/angles_deg/count"),
        (line(one([4, 1], 0)), [&twelve, &[], &[]], "/meta/geometry/angles_deg"),
        (
            line(json!({"angles_deg": {"count": 3}, "detector": {"count": [4, 1], "spacing_mm": [0, 1]}})),
            [&twelve, &[], &[]],
            "/meta/geometry/detector/spacing_mm",
        ),
        (line(one([4, 1], 3)), [&with(7, f32::NAN), &[], &[]], "/data"),
        (line(one([4, 1], 3)), [&twelve, &bright, &[]], "/flat"),
        (line(one([4, 1], 3)), [&twelve, &[], &bright], "/dark"),
        (as_counts(json!({})), [&twelve, &[], &[]], "/meta/photons_per_ray"),
        (as_counts(json!({"photons_per_ray": 0})), [&twelve, &[], &[]], "/meta/photons_per_ray"),
        (as_counts(json!({"photons_per_ray": 9})), [&twelve, &bright, &[]], "/meta/photons_per_ray"),
        (as_counts(json!({"photons_per_ray": 9})), [&with(2, -1.0), &[], &[]], "/data"),
        (as_counts(json!({"quantity": "intensity"})), [&twelve, &[], &[]], "/flat"),
        (as_counts(json!({"quantity": "intensity"})), [&twelve, &bright[4..], &[]], "/flat"),
        (as_counts(json!({"quantity": "intensity"})), [&twelve, &bright, &bytes([9.0; 4])], "/flat"),
    ] {
        assert_eq!(pointers(read(said.clone(), files)), [at], "{said}");
    }
    // A picture of bins × views, as scikit-image has it, is told what to do.
    let mut npy = Vec::new();
    {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 3), }";
        npy.extend_from_slice(b"\x93NUMPY\x01\x00");
        npy.extend_from_slice(&(header.len() as u16).to_le_bytes());
        npy.extend_from_slice(header.as_bytes());
        npy.extend_from_slice(&twelve);
    }
    let parts = SinogramParts { meta: Some(meta(&line(one([4, 1], 3)))), lengths: [npy.len(), 0, 0] };
    let refused = Sinogram::read(&npy, "test", &parts, MOST).unwrap_err().to_string();
    assert!(refused.contains("transpose it"), "{refused}");
    let too_large = Sinogram::read(&npy, "test", &parts, 11);
    assert!(matches!(too_large, Err(Error::TooLarge { .. })), "{too_large:?}");
}

#[test]
fn a_lost_view_of_an_upload_is_named() {
    let head = json!({"name": "shepp_logan", "radius_mm": 20});
    let geometry = json!({"angles_deg": {"count": 90}, "detector": {"count": [60, 1]}});
    let mut line = integrals(&phantom(&head), &geometry);
    line[17 * 60..18 * 60].fill(0.0);
    let info = read(json!({"geometry": geometry}), [&bytes(line), &[], &[]]).unwrap().info("id", true);
    assert!(info.warnings.iter().any(|w| w.starts_with("views_differ: view 17")), "{:?}", info.warnings);
    assert_eq!(info.data_check.map(|check| check.farthest_view), Some(17));
}
