//! `/v1/sinograms`: upload, list, show, numbers, picture, delete; and reconstructions of them, over HTTP and on the command line.

use reqwest::Method;
use reqwest::multipart::{Form, Part};
use serde_json::{Value, json};

use super::commands::{cloudchamber, fails, succeeds};
use crate::common::{Server, pictures};
use crate::support::*;

/// Counts behind a disc: 30 views of 24 bins, as NumPy's `.npy`.
fn counts() -> Vec<u8> {
    let row = (0..24).map(|u| {
        let chord = 2.0 * (64.0 - (f64::from(u) - 11.5).powi(2)).max(0.0).sqrt();
        (5000.0 * (-0.05 * chord).exp()).round() as u16
    });
    let row: Vec<u8> = row.flat_map(u16::to_le_bytes).collect();
    let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (30, 24), }";
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), &row.repeat(30)].concat()
}

fn form(meta: &Value, data: Vec<u8>) -> Form {
    Form::new().text("meta", meta.to_string()).part("data", Part::bytes(data).file_name("disc.npy"))
}

async fn post(api: &Api, form: Form) -> reqwest::Response {
    api.request(Method::POST, "/v1/sinograms").multipart(form).send().await.unwrap()
}

#[tokio::test]
async fn a_sinogram_is_uploaded_once_shown_reconstructed_and_deleted() {
    let server = Server::start();
    let api = Api::new(&server);
    let meta = json!({"quantity": "counts", "photons_per_ray": 5000});
    let first = post(&api, form(&meta, counts())).await;
    assert_eq!(first.status(), 201);
    let location = first.headers()["location"].to_str().unwrap().to_owned();
    let info: Value = first.json().await.unwrap();
    let id = info["id"].as_str().unwrap();
    assert_eq!(location, format!("/v1/sinograms/{id}"));
    assert_eq!(
        (&info["name"], &info["format"], &info["views"], &info["bins"], &info["quantity"]),
        (&json!("disc.npy"), &json!("npy"), &json!(30), &json!([24, 1]), &json!("counts"))
    );
    assert!((info["range"][1].as_f64().unwrap() - 0.8).abs() < 0.01, "{}", info["range"]);
    assert_eq!(info["warnings"], Value::Null, "its data check says nothing");
    assert_eq!(post(&api, form(&meta, counts())).await.status(), 200, "the same bytes are the same sinogram");

    let listed = api.get_json("/v1/sinograms").await;
    assert_eq!(listed["sinograms"].as_array().unwrap().len(), 1);
    assert_eq!(api.get_json(&location).await["data_check"]["farthest"], json!(0.0));

    let nrrd = api.get(&format!("{location}/data")).await.bytes().await.unwrap();
    assert!(nrrd.starts_with(b"NRRD0005") && nrrd.len() > 4 * 30 * 24, "{}", nrrd.len());
    let npy = api
        .request(Method::GET, &format!("{location}/data"))
        .header("Accept", "application/x-npy")
        .send()
        .await
        .unwrap();
    assert_eq!(npy.headers()["content-type"], "application/x-npy");
    assert!(npy.bytes().await.unwrap().starts_with(b"\x93NUMPY"));
    // What is handed out is taken again, without a form.
    let again =
        api.request(Method::POST, "/v1/sinograms").header("Content-Type", "application/octet-stream").body(nrrd);
    let again: Value = again.send().await.unwrap().json().await.unwrap();
    assert_eq!((&again["range"], &again["geometry"]), (&info["range"], &info["geometry"]));

    for (query, size) in [("", [24, 30]), ("?view=29", [24, 1])] {
        let picture = api.get(&format!("{location}/preview.png{query}")).await;
        assert_eq!(picture.headers()["content-type"], "image/png", "{query}");
        let bytes = picture.bytes().await.unwrap();
        let read = image::load_from_memory(&bytes).unwrap().to_luma8();
        assert_eq!([read.width(), read.height()], size, "{query}");
        assert!(read.get_pixel(12, 0)[0] == 255 && read.get_pixel(0, 0)[0] == 0, "{query}");
    }
    names(
        &problem(api.get(&format!("{location}/preview.png?view=30")).await, 422, "a view").await,
        "query:view",
        "a view",
    );
    problem(api.get(&format!("{location}/preview.png?view=x")).await, 422, "no view").await;

    let body = json!({"technique": "slice", "volume": {"fbp": {"sinogram": {"id": id}}}, "image": {"width": 48, "height": 48}, "budget": {"samples": 1}});
    let render = api.start(&body).await;
    let done = api.until_state(&render, "done").await;
    assert_eq!(done["result"]["views"], json!(30), "{done}");
    let field = api.get(&format!("{render}/field")).await.bytes().await.unwrap();
    let middle = &field[field.len() - 4 * 24 * 24..][4 * (12 * 24 + 12)..][..4];
    let value = f32::from_le_bytes(middle.try_into().unwrap());
    assert!((value - 0.05).abs() < 0.002, "the middle of the disc is {value}");

    assert_eq!(api.delete(&location).await.status(), 204);
    problem(api.get(&location).await, 404, "a deleted sinogram").await;
    problem(api.get(&format!("{location}/data")).await, 404, "its numbers").await;
    problem(api.delete(&location).await, 404, "deleted twice").await;
    let refused = problem(api.post(&body, "image/png").await, 422, "a reconstruction of it").await;
    names(&refused, "/volume/fbp/sinogram/id", "a reconstruction of it");
}

#[tokio::test]
async fn wrong_forms_are_refused_at_their_part() {
    let server = shared();
    let api = Api::new(&server);
    let meta = json!({"quantity": "counts", "photons_per_ray": 5000});
    for (what, form, at) in [
        ("no data", Form::new().text("meta", meta.to_string()), "/data"),
        ("a field of meta", form(&json!({"geometri": {}}), counts()), "/meta/geometri"),
        ("no open beam", form(&json!({"quantity": "counts"}), counts()), "/meta/photons_per_ray"),
        ("a kind of geometry", form(&json!({"geometry": {"type": "spiral"}}), counts()), "/meta/geometry/type"),
        ("no JSON", Form::new().text("meta", "{").part("data", Part::bytes(counts())), "/meta"),
        ("another part", form(&meta, counts()).text("meat", "x"), "/meat"),
        ("a part twice", form(&meta, counts()).text("meta", meta.to_string()), "/meta"),
        ("no geometry", Form::new().part("data", Part::bytes(counts())), "/meta"),
        ("cut off", form(&meta, counts()[..500].to_vec()), "/data/header:sizes"),
        ("a flat frame of line integrals", form(&json!({}), counts()).part("flat", Part::bytes(counts())), "/flat"),
    ] {
        names(&problem(post(&api, form).await, 422, what).await, at, what);
    }
    problem(post(&api, form(&meta, b"PK\x03\x04".to_vec())).await, 415, "a zip").await;
    // What a parser of nested literals would never end with, and JSON beyond the limit of JSON.
    let nested = [b"\x93NUMPY\x01\x00\x28\x00".to_vec(), vec![b'['; 40]].concat();
    names(&problem(post(&api, form(&meta, nested)).await, 422, "nested").await, "/data/header:descr", "nested");
    let long = Form::new().text("meta", "[1,".repeat(1 << 20)).part("data", Part::bytes(counts()));
    problem(post(&api, long).await, 413, "a long meta").await;
    let named = Part::bytes(counts()).file_name("n".repeat(5000));
    let taken = post(&api, Form::new().text("meta", meta.to_string()).part("data", named)).await;
    let taken: Value = taken.json().await.unwrap();
    assert!(taken["name"].as_str().is_some_and(|name| name.len() <= 200), "{taken}");
    let send = |kind: &'static str, body: Vec<u8>| {
        api.request(Method::POST, "/v1/sinograms").header("Content-Type", kind).body(body).send()
    };
    problem(send("application/json", b"{}".to_vec()).await.unwrap(), 415, "JSON").await;
    problem(send("multipart/form-data; boundary=x", b"no form".to_vec()).await.unwrap(), 400, "no form").await;
    names(&problem(send("application/octet-stream", Vec::new()).await.unwrap(), 422, "nothing").await, "", "nothing");
}

#[tokio::test]
async fn a_measurement_is_kept_and_reconstructed() {
    let server = Server::start();
    let api = Api::new(&server);
    let geometry = json!({"angles_deg": {"count": 50}, "detector": {"count": [64, 1], "spacing_mm": [0.7, 1]}});
    let disc = json!({"phantom": {"shapes": [{"type": "ellipse", "value": 0.03, "axes_mm": [12, 12]}]}});
    for (body, views) in [
        (json!({"of": disc, "geometry": geometry}), 50),
        (
            json!({"of": {"builtin": "gaussian", "resolution": 16}, "geometry": {"angles_deg": {"count": 30}}, "projector": "joseph"}),
            30,
        ),
    ] {
        let response = api.post_to("/v1/projections", &body).await;
        assert_eq!(response.status(), 202, "{body}");
        let location = response.headers()["location"].to_str().unwrap().to_owned();
        let done = api.until_state(&location, "done").await;
        let id = done["result"]["sinogram"]["id"].as_str().unwrap().to_owned();
        let kept = api.get_json(&format!("/v1/sinograms/{id}")).await;
        assert_eq!((&kept["views"], &kept["bins"]), (&json!(views), &done["result"]["bins"]), "{kept}");
        // The same measurement is the same sinogram.
        let again = api.post_to("/v1/projections", &body).await.headers()["location"].to_str().unwrap().to_owned();
        assert_eq!(api.until_state(&again, "done").await["result"]["sinogram"]["id"], json!(id));
        let render = json!({"technique": "slice", "volume": {"fbp": {"sinogram": {"id": id}}}, "image": {"width": 32, "height": 32}, "budget": {"samples": 1}});
        assert_eq!(api.finish(&render).await["result"]["views"], json!(views));
    }
    // A cancelled measurement keeps nothing.
    let before = api.get_json("/v1/sinograms").await["sinograms"].as_array().unwrap().len();
    let long = json!({"of": {"phantom": {"name": "shepp_logan"}}, "geometry": {"angles_deg": {"count": 4000}, "detector": {"count": [2000, 1]}}});
    let response = api.post_to("/v1/projections", &long).await;
    let location = response.headers()["location"].to_str().unwrap().to_owned();
    assert_eq!(api.delete(&location).await.status(), 200);
    api.until_state(&location, "cancelled").await;
    assert_eq!(api.get_json("/v1/sinograms").await["sinograms"].as_array().unwrap().len(), before);
    for (body, at) in [
        (json!({"of": {"phantom": {"name": "shepp_logan", "radius_mm": 0}}}), "/of/phantom/radius_mm"),
        (json!({"of": {"builtin": "teapot"}}), "/of/builtin"),
        (json!({"of": {"id": "none"}}), "/of/id"),
        (json!({"of": {"builtin": "sphere", "phantom": {"name": "shepp_logan"}}}), "/of"),
        (json!({"of": disc, "projector": "joseph"}), "/projector"),
        (json!({"of": disc, "geometry": {"detector": {"count": [0, 1]}}}), "/geometry/detector/count/0"),
        (json!({"views": 3}), "/views"),
    ] {
        names(
            &problem(api.post_to("/v1/projections", &body).await, 422, &body.to_string()).await,
            at,
            &body.to_string(),
        );
    }
}

#[tokio::test]
async fn the_command_line_reconstructs_a_sinogram() {
    let server = shared();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("disc.npy"), counts()).unwrap();
    std::fs::write(path("test.nrrd"), pictures::sinogram()).unwrap();
    std::fs::write(path("meta.json"), json!({"quantity": "counts", "photons_per_ray": 5000}).to_string()).unwrap();
    let scene = json!({"technique": "slice", "image": {"width": 32, "height": 32}, "budget": {"samples": 1}});
    std::fs::write(path("scene.json"), scene.to_string()).unwrap();
    let npy = ["render", &path("scene.json"), "--sinogram", &path("disc.npy"), "--meta", &path("meta.json"), "-o"];
    succeeds(&cloudchamber(folder.path(), &[&npy[..], &[&path("here.png")]].concat()));
    succeeds(&cloudchamber(folder.path(), &[&npy[..], &[&path("there.png"), "--server", &server.url()]].concat()));
    let picture = std::fs::read(path("here.png")).unwrap();
    assert_eq!(std::fs::read(path("there.png")).unwrap(), picture);
    assert!(colours(&picture) > 10);
    // A NRRD says its geometry itself, and the request says the method.
    let blurred = with(scene, "/volume", json!({"backprojection": {}}));
    std::fs::write(path("blurred.json"), blurred.to_string()).unwrap();
    let nrrd = ["render", &path("blurred.json"), "--sinogram", &path("test.nrrd"), "-o", &path("blurred.png")];
    succeeds(&cloudchamber(folder.path(), &nrrd));
    fails(&cloudchamber(folder.path(), &["render", &path("scene.json"), "--sinogram", &path("disc.npy")]), "/meta");
    // What `project` makes is taken back.
    let disc = json!({"of": {"phantom": {"shapes": [{"type": "ellipse", "axes_mm": [9, 9]}]}}, "geometry": {"angles_deg": {"count": 20}, "detector": {"count": [30, 1]}}});
    std::fs::write(path("disc.json"), disc.to_string()).unwrap();
    succeeds(&cloudchamber(folder.path(), &["project", &path("disc.json"), "-o", &path("here.nrrd")]));
    let there = ["project", &path("disc.json"), "-o", &path("there.nrrd"), "--server", &server.url()];
    succeeds(&cloudchamber(folder.path(), &there));
    assert_eq!(std::fs::read(path("here.nrrd")).unwrap(), std::fs::read(path("there.nrrd")).unwrap());
    let nrrd = ["render", &path("scene.json"), "--sinogram", &path("here.nrrd"), "-o", &path("again.png")];
    succeeds(&cloudchamber(folder.path(), &nrrd));
    std::fs::write(path("wrong.json"), json!({"of": {"builtin": "teapot"}}).to_string()).unwrap();
    fails(&cloudchamber(folder.path(), &["project", &path("wrong.json")]), "/of/builtin");
}
