//! `fbp`: order, scale, windows, views from anywhere, three dimensions, and what it says of bad data.

use serde_json::{Value, json};

use crate::tomography::{phantom, reconstructed};

/// Both Gaussians of the table of truths.
fn gaussians() -> Value {
    json!({"shapes": [{"type": "gaussian", "axes_mm": [0.15, 0.15]},
        {"type": "gaussian", "value": 2, "axes_mm": [0.2, 0.08], "center_mm": [0.1, -0.2, 0], "angle_deg": 25}]})
}

fn projection(phantom: &Value, angles: Value, count: [usize; 2], spacing: f64) -> Value {
    json!({"projection": {"of": {"phantom": phantom}, "geometry": {"type": "parallel", "angles_deg": angles,
        "detector": {"count": count, "spacing_mm": [spacing, spacing]}}}})
}

fn grid(side: usize, spacing: f64) -> Value {
    json!({"dims": [side, side, 1], "spacing_mm": [spacing, spacing, spacing]})
}

#[test]
fn a_smooth_object_has_an_error_of_second_order() {
    // The table's numbers are those of the same method in double precision.
    for (side, truth) in [(64usize, 2.914e-3), (128, 7.350e-4), (256, 1.832e-4)] {
        let spacing = 2.0 / side as f64;
        let bins = (side as f64 * 2f64.sqrt()).ceil() as usize;
        let sinogram = projection(&gaussians(), json!({"count": 180}), [bins, 1], spacing);
        let found = reconstructed("fbp", &json!({"sinogram": sinogram, "grid": grid(side, spacing)}));
        let [rmse, mean] = found.apart(&phantom(&gaussians()), spacing, 1.0);
        assert!((rmse / truth - 1.0).abs() < 0.02, "{side}: {rmse:.4e}, mean {mean:.2e}");
        assert!(found.codes().is_empty() || found.codes() == ["few_views"], "{:?}", found.codes());
    }
}

#[test]
fn values_have_their_unit_at_any_size_of_bins_and_voxels() {
    // A disc of 1 per mm and 40 mm: the mean inside of 30 mm.
    let disc = json!({"shapes": [{"type": "ellipse", "axes_mm": [40, 40], "center_mm": [3, -2, 0]}]});
    for (bins, bin_mm, side, voxel_mm) in
        [(128, 1.0, 64, 1.5), (300, 0.4, 90, 1.0), (64, 2.0, 200, 0.5), (129, 1.0, 33, 2.7)]
    {
        let sinogram = projection(&disc, json!({"count": 200}), [bins, 1], bin_mm);
        let found = reconstructed("fbp", &json!({"sinogram": sinogram, "grid": grid(side, voxel_mm)}));
        let [_, mean] = found.apart(&phantom(&disc), voxel_mm, 30.0);
        assert!(mean.abs() < 0.005, "{bins} bins of {bin_mm} mm, {side} voxels of {voxel_mm} mm: 1 {mean:+.4}");
    }
}

#[test]
fn zernike_polynomials_come_back() {
    for (n, m) in [(2, 0), (4, 2), (3, 1), (5, 3)] {
        let one = json!({"shapes": [{"type": "zernike", "n": n, "m": m, "radius_mm": 50}]});
        let found = reconstructed(
            "fbp",
            &json!({"sinogram": projection(&one, json!({"count": 240}), [150, 1], 1.0), "grid": grid(100, 1.0)}),
        );
        let [rmse, _] = found.apart(&phantom(&one), 1.0, 40.0);
        assert!(rmse < 0.02, "{n} {m}: {rmse:.4}");
    }
}

#[test]
fn views_may_lie_anywhere() {
    let head = json!({"name": "shepp_logan", "radius_mm": 50});
    let values = |angles: Value| {
        reconstructed("fbp", &json!({"sinogram": projection(&head, angles, [128, 1], 1.0), "grid": grid(100, 1.0)}))
    };
    let apart = |angles| values(angles).apart(&phantom(&head), 1.0, 45.0)[0];
    let half = apart(json!({"count": 180}));
    // From both sides, backwards, shuffled, and with every third view twice.
    let shuffled: Vec<f64> = (0..180).map(|i| f64::from(i * 77 % 180)).collect();
    let twice: Vec<f64> = (0..240).map(|i| f64::from(i % 4 / 3 + i / 4 * 3 + i % 4 - i % 4 / 3 * 3)).collect();
    for angles in
        [json!({"to": 360, "count": 360}), json!({"from": 180, "to": 0, "count": 180}), json!(shuffled), json!(twice)]
    {
        let found = apart(angles.clone());
        assert!((found / half - 1.0).abs() < 0.02, "{angles}: {found}, {half}");
    }
    let wedge = values(json!({"from": 0, "to": 120, "count": 120}));
    assert!(wedge.codes().contains(&"missing_wedge"), "{:?}", wedge.codes());
    assert!(wedge.apart(&phantom(&head), 1.0, 45.0)[0] > 2.0 * half);
}

#[test]
fn windows_trade_sharpness_for_calm() {
    let head = json!({"name": "shepp_logan", "radius_mm": 50});
    let sinogram = projection(&head, json!({"count": 180}), [128, 1], 1.0);
    let apart = |filter: &str, cutoff: f64| {
        let own = json!({"sinogram": sinogram, "grid": grid(100, 1.0), "filter": filter, "cutoff": cutoff});
        reconstructed("fbp", &own).apart(&phantom(&head), 1.0, 45.0)[0]
    };
    let all: Vec<f64> = ["ram_lak", "shepp_logan", "cosine", "hamming", "hann"].iter().map(|f| apart(f, 1.0)).collect();
    assert!(
        all.windows(2).all(|pair| pair[0] < pair[1]),
        "without noise each window blurs more than the one before: {all:?}"
    );
    assert!(apart("ram_lak", 0.5) > all[0]);
}

#[test]
fn three_dimensions_are_planes_between_rows() {
    // A Gaussian that is three-dimensional: linear between rows of bins as between bins.
    let one = json!({"shapes": [{"type": "gaussian", "axes_mm": [8, 6, 7], "center_mm": [2, -1, 1.5]}]});
    let sinogram = projection(&one, json!({"count": 120}), [72, 48], 1.0);
    let own = json!({"sinogram": sinogram, "grid": {"dims": [53, 47, 41], "spacing_mm": [1, 1, 1]}});
    let found = reconstructed("fbp", &own);
    let [rmse, mean] = found.apart(&phantom(&one), 1.0, 22.0);
    assert!(rmse < 3e-3 && mean.abs() < 1e-3, "{rmse:.2e} {mean:.2e}");
    assert_eq!(found.dims, [53, 47, 41]);
}

#[test]
fn bad_data_is_told_in_words() {
    let head = json!({"name": "shepp_logan", "radius_mm": 50});
    let with = |detector: Value, angles: Value| {
        let geometry = json!({"angles_deg": angles, "detector": detector});
        let sinogram = json!({"projection": {"of": {"phantom": head}, "geometry": geometry}});
        reconstructed("fbp", &json!({"sinogram": sinogram, "grid": grid(32, 3.0)}))
    };
    let right = with(json!({"count": [128, 1]}), json!({"count": 120}));
    assert!(right.codes().is_empty(), "{:?}", right.result);
    let check = &right.result["data_check"];
    let centroid = |i: usize| check["centroid_mm"][i].as_f64().unwrap();
    assert!(
        (centroid(0) - 50.0 * 0.0087783374).abs() < 0.02 && (centroid(1) - 50.0 * 0.0646977035).abs() < 0.02,
        "{check}"
    );
    assert_eq!(with(json!({"count": [70, 1]}), json!({"count": 120})).codes(), ["truncation"]);
    assert_eq!(with(json!({"count": [128, 1]}), json!({"count": 30})).codes(), ["few_views"]);
    let deep = json!({"sinogram": projection(&head, json!({"count": 120}), [128, 1], 1.0), "grid": {"dims": [16, 16, 5], "spacing_mm": [5, 5, 1]}});
    let deep = reconstructed("fbp", &deep);
    assert_eq!(deep.codes(), ["planes_unseen"]);
    let plane = |z: usize| deep.values[z * 256..(z + 1) * 256].iter().any(|v| *v != 0.0);
    assert_eq!([0, 1, 2, 3, 4].map(plane), [false, false, true, false, false]);
}
