//! Uploads that lie, end early or explode, over HTTP; and volumes with voxels that are NaN or infinite.

use cloudchamber::volume::RawType;
use serde_json::{Value, json};

use crate::common::Server;
use crate::common::writers::{Nifti, gzip, nrrd, small_nifti, small_nrrd};
use crate::support::*;

/// `(about, query, body, permitted statuses)`.
fn cases() -> Vec<(&'static str, &'static str, Vec<u8>, &'static [u16])> {
    let (file, data) = small_nifti();
    let good = file.with(&data);
    let zeros = gzip(&vec![0; 16 << 20]).repeat(40);
    let bomb = |dims| [gzip(&Nifti::new(false, dims, RawType::U8).bytes), zeros.clone()].concat();
    let changed = |change: &dyn Fn(&mut Nifti)| {
        let (mut file, data) = small_nifti();
        change(&mut file);
        file.with(&data)
    };
    let truncated = |bytes: Vec<u8>, by: usize| bytes[..bytes.len() - by].to_vec();
    vec![
        ("empty", "", Vec::new(), &[422]),
        ("garbage", "", (0..5000u32).map(|i| (i * 7919 % 251) as u8).collect(), &[415]),
        ("text", "", b"Hello, I am a volume.".to_vec(), &[415]),
        ("a picture", "", b"\x89PNG\r\n\x1a\n0000000000".to_vec(), &[415]),
        ("truncated gzip", "", truncated(gzip(&good), 9), &[422]),
        ("truncated at its header", "", good[..200].to_vec(), &[415, 422]),
        ("truncated data", "", truncated(good.clone(), 1), &[422]),
        ("surplus data", "", [good.clone(), vec![0; 1000]].concat(), &[422]),
        ("a gzip bomb without a header", "", zeros.clone(), &[415]),
        ("a gzip bomb behind a small header", "", bomb([8, 8, 8]), &[422]),
        ("a gzip bomb behind a large header", "", bomb([2048, 2048, 2048]), &[413, 422]),
        ("a gzip bomb in NRRD", "", nrrd("type: uint8\ndimension: 3\nencoding: gzip\nsizes: 8 8 8", &zeros), &[422]),
        (
            "1 GiB announced, 100 bytes sent",
            "",
            Nifti::new(false, [1024, 1024, 1024], RawType::U8).with(&[0; 100]),
            &[422],
        ),
        (
            "5 GB announced by the header",
            "",
            Nifti::new(false, [2048, 2048, 1280], RawType::U8).with(&[0; 100]),
            &[413, 422],
        ),
        (
            "dimensions that overflow",
            "",
            Nifti::new(false, [32767, 32767, 32767], RawType::F64).with(&[0; 100]),
            &[413, 422],
        ),
        (
            "dimensions that overflow 64 bits",
            "",
            nrrd(
                "type: double\nendian: big\ndimension: 3\nencoding: raw\nsizes: 4294967296 4294967296 4294967296",
                &[0; 64],
            ),
            &[413, 422],
        ),
        (
            "dimensions past any integer",
            "",
            nrrd("type: uint8\ndimension: 3\nencoding: raw\nsizes: 99999999999999999999999 1 1", &[0; 64]),
            &[413, 422],
        ),
        ("negative dimension", "", changed(&|f| f.put_i16(42, -4)), &[422]),
        ("negative spacing", "", changed(&|f| f.put_f32(84, -1.0)), &[422]),
        ("spacing that is no number", "", changed(&|f| f.put_f32(84, f32::NAN)), &[422]),
        ("negative spacing in NRRD", "", small_nrrd("spacings: 1 -1 1"), &[422]),
        ("a type that there is not", "", changed(&|f| f.put_i16(70, 128)), &[422]),
        ("a file beside it", "", small_nrrd("data file: /etc/passwd"), &[422]),
        ("raw, too short", "?dims=100,100,100&type=f32", vec![0; 100], &[422]),
        ("raw, overflowing", "?dims=18446744073709551615,2,1&type=f64", vec![0; 100], &[413, 422]),
        ("raw, 5 GB announced", "?dims=2048,2048,1280&type=u8", vec![0; 100], &[413, 422]),
        ("raw, no voxels", "?dims=0,4,4&type=u8", Vec::new(), &[422]),
        ("raw, negative", "?dims=-4,4,4&type=u8", vec![0; 64], &[422]),
        ("raw, spacing that is no number", "?dims=4,4,4&type=u8&spacing=nan,1,1", vec![0; 64], &[422]),
        ("raw, spacing without end", "?dims=4,4,4&type=u8&spacing=inf,1,1", vec![0; 64], &[422]),
        ("raw, spacing twice as a query", "?dims=4,4,4&dims=5,5,5&type=u8", vec![0; 64], &[400, 422]),
    ]
}

/// Uploads every case to a server, which must refuse it.
pub async fn refused(server: &Server) {
    let api = Api::new(server);
    for (about, query, body, permitted) in cases() {
        let response = api.upload(query, body).await;
        let status = response.status().as_u16();
        assert!(permitted.contains(&status), "{about}: {status} {}", response.text().await.unwrap());
        let told = problem(response, status, about).await;
        if status == 422 {
            assert!(
                told["errors"][0]["pointer"].is_string() && told["errors"][0]["detail"].is_string(),
                "{about}: {told}"
            );
        }
    }
    let listed = api.get_json("/v1/volumes").await;
    let uploads = listed["volumes"].as_array().unwrap().iter().filter(|v| v.get("id").is_some());
    assert_eq!(uploads.count(), 0, "nothing of it was kept");
}

#[tokio::test]
async fn uploads_that_are_no_volumes_are_refused_and_not_kept() {
    refused(&Server::start()).await;
}

#[tokio::test]
async fn voxels_that_are_no_numbers_are_counted_and_rendered_as_empty() {
    let server = shared();
    let api = Api::new(&server);
    const SIDE: usize = 16;
    let mut voxels = vec![0.5f32; SIDE * SIDE * SIDE];
    for (at, value) in
        [(100, f32::NAN), (1000, f32::INFINITY), (1001, f32::NEG_INFINITY), (2000, -f32::NAN), (4095, f32::NAN)]
    {
        voxels[at] = value;
    }
    voxels[3000] = 1.0;
    let bytes: Vec<u8> = voxels.iter().flat_map(|v| v.to_le_bytes()).collect();
    let fields = format!("type: float\nendian: little\ndimension: 3\nencoding: raw\nsizes: {SIDE} {SIDE} {SIDE}");
    let response = api.upload("", nrrd(&fields, &bytes)).await;
    assert_eq!(response.status(), 201);
    let info: Value = response.json().await.unwrap();
    assert_eq!((&info["non_finite"], &info["range"]), (&json!(5), &json!([0.5, 1.0])));
    for parameters in
        [json!({}), json!({"shading": true}), json!({"order": "back_to_front"}), json!({"empty_space_skipping": false})]
    {
        let opaque = json!({"points": [{"value": 0, "color": [1, 1, 1], "opacity_per_unit": 0.3}]});
        let body = json!({
            "technique": "emission_absorption", "volume": {"id": info["id"]}, "image": {"width": 64, "height": 64}, "budget": {"samples": 2},
            "emission_absorption": with(parameters.clone(), "/transfer_function", opaque),
        });
        let response = api.post(&body, "image/x-exr").await;
        assert_eq!(response.status(), 200, "{parameters}");
        let path = response.headers()["content-location"].to_str().unwrap().to_owned();
        let (_, channels) = exr_samples(&response.bytes().await.unwrap());
        assert!(channels.values().flatten().all(|v| v.is_finite()), "{parameters}");
        assert!(channels["R"].iter().any(|v| *v > 0.1), "the rest of it is seen: {parameters}");
        let resource = api.get_json(&path).await;
        assert_eq!(resource["counts"]["non_finite_voxels"], 5);
        assert_eq!(resource["counts"]["non_finite_samples"], 0, "{parameters}");
        let warned = resource["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "non_finite_voxels");
        assert!(warned, "{}", resource["warnings"]);
    }
    // A volume of such voxels alone shows nothing, which is no fault.
    let nothing: Vec<u8> = [f32::NAN; 64].iter().flat_map(|v| v.to_le_bytes()).collect();
    let response = api.upload("?dims=4,4,4&type=f32", nothing).await;
    if response.status() == 201 {
        let body = with(small(), "/volume", response.json::<Value>().await.unwrap()["reference"].clone());
        assert!(pixels(&api.png(&body).await).2.iter().all(|v| *v == 0), "nothing is black");
    } else {
        problem(response, 422, "nothing but NaN").await;
    }
}
