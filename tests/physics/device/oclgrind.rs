//! A tiny case of each kernel under oclgrind, which watches each access to memory and all data races.

use std::path::Path;
use std::process::Command;

use cloudchamber::technique;
use serde_json::Value;

use crate::common::processes::oclgrind_environment;

/// Runs a scene on oclgrind and returns its log. oclgrind exits with 0 even if its log has errors, and without the dylib's path the run would
/// silently happen on PoCL.
fn oclgrind(scene: &Value, lanes: &str, kernels: Option<&Path>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (file, log) = (folder.path().join("scene.json"), folder.path().join("log"));
    std::fs::write(&file, scene.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
    let technique = technique::find(scene["technique"].as_str().unwrap()).unwrap();
    let what = if technique.kind_name() == "export" { "export" } else { "render" };
    command.arg(what).arg(&file).args(["--device", "oclgrind", "--lanes", lanes, "--data-dir"]).arg(folder.path());
    command.arg("-o").arg(folder.path().join("out.png"));
    if let Some(kernels) = kernels {
        command.arg("--kernels").arg(kernels);
    }
    let output = command.envs(oclgrind_environment(&log)).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(log).unwrap_or_default()
}

#[test]
fn a_tiny_case_of_each_kernel_is_clean_under_oclgrind() {
    for technique in technique::ALL {
        let scenes = (technique.cases)().tiny;
        assert!(!scenes.is_empty(), "{} has no tiny case", technique.name);
        for scene in scenes {
            for lanes in ["1", "4"] {
                assert_eq!(oclgrind(&scene, lanes, None).trim(), "", "{lanes} lanes: {scene}");
            }
        }
    }
}

#[test]
fn oclgrind_would_see_a_stray_store() {
    let folder = tempfile::tempdir().unwrap();
    let copy = |name: &str| {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels").join(name);
        std::fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
        let text = std::fs::read_to_string(from).unwrap();
        // The kernel then writes a pixel too far.
        let broken = text.replace("film[4 * pixels + pixel] = m2;", "film[9 * pixels + pixel] = m2;");
        std::fs::write(folder.path().join(name), broken).unwrap();
    };
    let kernels = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels");
    for sub in ["", "shared"] {
        for file in std::fs::read_dir(kernels.join(sub)).unwrap().map(|entry| entry.unwrap().path()) {
            if file.is_file() {
                copy(&Path::new(sub).join(file.file_name().unwrap()).to_string_lossy());
            }
        }
    }
    let log = oclgrind(&(technique::ALL[0].cases)().tiny[0], "1", Some(folder.path()));
    assert!(log.contains("Invalid write"), "the log is: {log}");
}
