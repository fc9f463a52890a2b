//! `/v1/volumes`: upload, list, show, delete.

use reqwest::Method;
use serde_json::{Value, json};

use crate::common::{Server, mri_head};
use crate::support::*;

#[tokio::test]
async fn the_mri_head_is_uploaded_once_shown_rendered_and_deleted() {
    // The test has a server of its own, which must not know the scan yet.
    let server = Server::start();
    let api = Api::new(&server);
    let post = || {
        let request = api.request(Method::POST, "/v1/volumes").header("Content-Type", "application/octet-stream");
        request.header("X-Filename", "caf%C3%A9%20head.nii.gz").body(mri_head()).send()
    };
    let first = post().await.unwrap();
    assert_eq!(first.status(), 201);
    let location = first.headers()["location"].to_str().unwrap().to_owned();
    let info: Value = first.json().await.unwrap();
    let id = info["id"].as_str().unwrap();
    assert_eq!(location, format!("/v1/volumes/{id}"));
    assert_eq!(
        (&info["dims"], &info["spacing"], &info["unit"]),
        (&json!([181, 217, 181]), &json!([1.0, 1.0, 1.0]), &json!("mm"))
    );
    assert_eq!((&info["format"], &info["name"]), (&json!("nifti"), &json!("café head.nii.gz")));
    let second = post().await.unwrap();
    assert_eq!(second.status(), 200, "the same bytes are the same volume");
    assert_eq!(second.json::<Value>().await.unwrap()["id"], id);

    let shown = api.get_json(&location).await;
    let counts: f64 = shown["histogram"]["counts"].as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).sum();
    assert_eq!(counts, 181.0 * 217.0 * 181.0, "every voxel is in the histogram");
    let listed = api.get_json("/v1/volumes").await;
    assert_eq!(listed["volumes"].as_array().unwrap().iter().filter(|v| v["id"] == id).count(), 1);

    let body = json!({"technique": "emission_absorption", "volume": {"id": id}, "image": {"width": 128, "height": 128}, "budget": {"samples": 2}});
    let png = api.png(&body).await;
    assert!(colours(&png) > 200, "a head has more than {} colours", colours(&png));

    assert_eq!(api.delete(&location).await.status(), 204);
    problem(api.get(&location).await, 404, "a deleted volume").await;
    problem(api.delete(&location).await, 404, "deleted twice").await;
    names(&problem(api.post(&body, "image/png").await, 422, "a render of it").await, "/volume/id", "a render of it");
}

#[tokio::test]
async fn built_in_volumes_are_listed_and_shown_and_stay() {
    let server = shared();
    let api = Api::new(&server);
    let list = api.get_json("/v1/volumes").await;
    for name in ["chamber", "marschner_lobb", "shepp_logan", "gaussian", "sphere", "smoke", "constant"] {
        let listed = list["volumes"].as_array().unwrap().iter().find(|v| v["builtin"] == name).unwrap();
        // The reference works in a request as it is.
        let body = with(with(small(), "/volume", listed["reference"].clone()), "/volume/resolution", json!(16));
        assert_eq!(api.post(&body, "image/png").await.status(), 200, "{name}");
        let shown = api.get_json(&format!("/v1/volumes/{name}")).await;
        assert!(shown["histogram"]["counts"].is_array(), "{name}");
        problem(api.delete(&format!("/v1/volumes/{name}")).await, 409, name).await;
    }
}

#[tokio::test]
async fn raw_voxels_are_described_by_the_query() {
    let server = shared();
    let api = Api::new(&server);
    let voxels: Vec<u8> = (0..4u16 * 3 * 2).flat_map(|i| (i * 100).to_be_bytes()).collect();
    let response = api.upload("?dims=4,3,2&type=u16&spacing=1,2,0.5&endian=big", voxels.clone()).await;
    assert_eq!(response.status(), 201);
    let info: Value = response.json().await.unwrap();
    assert_eq!((&info["dims"], &info["spacing"]), (&json!([4, 3, 2]), &json!([1.0, 2.0, 0.5])));
    assert_eq!(info["range"], json!([0.0, 2300.0]), "big endian is read as such");
    let body = with(small(), "/volume", info["reference"].clone());
    assert_eq!(api.post(&body, "image/png").await.status(), 200);
    for (query, pointer) in [
        ("?dims=4,3,2", "query:type"),
        ("?dims=4,3&type=u16", "query:dims"),
        ("?dims=4,3,3&type=u16", "query:dims"),
        ("?dims=4,3,2&type=u17", "query:type"),
        ("?dims=4,3,2&type=u16&spacing=1,-1,1", "query:spacing"),
    ] {
        names(&problem(api.upload(query, voxels.clone()).await, 422, query).await, pointer, query);
    }
    problem(api.upload("?dims=4,3,2&type=u16&colour=red", voxels).await, 400, "an unknown query parameter").await;
}

#[tokio::test]
async fn a_render_goes_on_when_its_volume_is_deleted() {
    let server = shared();
    let api = Api::new(&server);
    let info: Value =
        api.upload("?dims=8,8,8&type=u8", (0..512u16).map(|i| i as u8).collect()).await.json().await.unwrap();
    let body = with(endless(), "/volume", info["reference"].clone());
    let path = api.start(&body).await;
    assert_eq!(api.delete(&format!("/v1/volumes/{}", info["id"].as_str().unwrap())).await.status(), 204);
    let samples = api.get_json(&path).await["samples"].as_u64();
    api.until(&path, "further on", |r| r["samples"].as_u64() > samples).await;
    api.delete(&path).await;
}
