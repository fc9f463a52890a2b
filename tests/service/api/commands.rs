//! The command line: `render` with and without a server, `device`, `healthcheck`.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::common::{Server, kernel_cache, mri_head};
use crate::support::*;

pub fn cloudchamber(data: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
    command.args(arguments).env("POCL_CACHE_DIR", kernel_cache()).env("CLOUDCHAMBER_DATA_DIR", data);
    command.output().unwrap()
}

pub fn succeeds(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub fn fails(output: &Output, words: &str) {
    assert!(!output.status.success());
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains(words), "'{words}' is not in: {told}");
}

#[tokio::test]
async fn render_gives_the_same_bytes_with_and_without_the_server() {
    let server = shared();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("scene.json"), small().to_string()).unwrap();
    let here = cloudchamber(folder.path(), &["render", &path("scene.json"), "-o", &path("here.png")]);
    let words = succeeds(&here);
    assert!(words.contains("4 samples") && words.contains("error") && words.contains("stopped by samples"), "{words}");
    let there = ["render", &path("scene.json"), "-o", &path("there.png"), "--server", &server.url()];
    succeeds(&cloudchamber(folder.path(), &there));
    let png = Api::new(&server).png(&small()).await;
    assert_eq!(std::fs::read(path("here.png")).unwrap(), png);
    assert_eq!(std::fs::read(path("there.png")).unwrap(), png);
    succeeds(&cloudchamber(folder.path(), &["render", &path("scene.json"), "-o", &path("here.exr")]));
    assert_eq!(exr_samples(&std::fs::read(path("here.exr")).unwrap()).0, [64, 48]);
}

#[tokio::test]
async fn render_takes_a_volume_file() {
    let server = shared();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("head.nii.gz"), mri_head()).unwrap();
    let scene =
        json!({"technique": "emission_absorption", "image": {"width": 96, "height": 96}, "budget": {"samples": 1}});
    std::fs::write(path("scene.json"), scene.to_string()).unwrap();
    let common = ["render", &path("scene.json"), "--volume", &path("head.nii.gz"), "-o"];
    succeeds(&cloudchamber(folder.path(), &[&common[..], &[&path("here.png")]].concat()));
    succeeds(&cloudchamber(folder.path(), &[&common[..], &[&path("there.png"), "--server", &server.url()]].concat()));
    let png = std::fs::read(path("here.png")).unwrap();
    assert!(colours(&png) > 100);
    assert_eq!(std::fs::read(path("there.png")).unwrap(), png);
}

#[test]
fn render_says_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.json");
    let render = |text: &str, more: &[&str]| {
        std::fs::write(&scene, text).unwrap();
        cloudchamber(folder.path(), &[&["render", scene.to_str().unwrap(), "-o", "/nowhere/out.png"], more].concat())
    };
    fails(&render("{\"technique\": \"emission_absorption\", \"image\": {\"width\": 0}}", &[]), "/image/width");
    fails(&render("{", &[]), "scene.json");
    fails(&render("{}", &["--server", "http://127.0.0.1:1"]), "127.0.0.1:1");
    fails(&cloudchamber(folder.path(), &["render", "/nowhere/scene.json"]), "/nowhere/scene.json");
}

#[tokio::test]
async fn render_over_a_server_says_what_the_server_says() {
    let server = shared();
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.json");
    std::fs::write(&scene, "{\"technique\": \"emission_absorption\", \"sed\": 1}").unwrap();
    let arguments = ["render", scene.to_str().unwrap(), "-o", "/nowhere/out.png", "--server", &server.url()];
    fails(&cloudchamber(folder.path(), &arguments), "/sed");
}

#[test]
fn device_shows_what_there_is_and_what_would_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let told: Value = serde_json::from_str(&succeeds(&cloudchamber(folder.path(), &["device"]))).unwrap();
    let devices = told["devices"].as_array().unwrap();
    assert!(!devices.is_empty());
    assert!(devices.iter().any(|d| d["device"] == told["would_use"]["device"]), "{told}");
    fails(&cloudchamber(folder.path(), &["device", "--device", "no such thing"]), "no such thing");
}

#[tokio::test]
async fn healthcheck_exits_by_the_servers_health() {
    let folder = tempfile::tempdir().unwrap();
    let mut server = Server::start();
    let address = server.address();
    let check = || cloudchamber(folder.path(), &["healthcheck", "--listen", &address]);
    succeeds(&check());
    server.terminate();
    assert_eq!(server.wait(), Some(0));
    fails(&check(), &address);
}

#[test]
fn device_lists_the_variants_of_every_kernel() {
    let folder = tempfile::tempdir().unwrap();
    let told: Value = serde_json::from_str(&succeeds(&cloudchamber(folder.path(), &["device", "--variants"]))).unwrap();
    let variants = told["variants"].as_array().unwrap();
    assert_eq!(told["count"].as_u64(), Some(variants.len() as u64));
    for kernel in ["emission_absorption", "volume_path", "photon_transport", "isosurface"] {
        let of: Vec<&Value> = variants.iter().filter(|v| v["kernel"] == kernel).collect();
        let options = of[0]["options"].as_str().unwrap();
        // In service, a compiler's warning disables nothing.
        assert!(options.contains("-DLANES=") && !options.contains("-Werror"), "{kernel}: {options}");
        assert!(of.iter().any(|v| v["at_start"] == true), "{kernel}");
    }
    assert!(
        variants.iter().any(|v| v["features"]["SHADED"] == 1) && variants.iter().any(|v| v["features"]["SHADED"] == 0)
    );
}
