//! The program at a level below the host's. The features that the level lacks are hidden from PoCL (`hide_features.c`).

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use super::compiler::{LEVELS, Level};
use crate::common::picture::Picture;

/// A level at which a host of a higher one can be made to work.
pub struct Lower {
    pub level: &'static Level,
    /// The features that the level above has and this one lacks.
    hidden: &'static str,
    /// The processors for which PoCL may then take the host's.
    cpus: &'static [&'static str],
}

const LOWER: [Lower; 3] = [
    Lower { level: &LEVELS[1], hidden: "avx512", cpus: &["haswell"] },
    Lower { level: &LEVELS[2], hidden: "avx512,avx2", cpus: &["sandybridge", "ivybridge", "bdver1"] },
    Lower { level: &LEVELS[3], hidden: "avx512,avx", cpus: &["penryn", "core2", "x86-64"] },
];

/// The program, and the library that hides features from it.
pub struct Program {
    folder: tempfile::TempDir,
    shim: PathBuf,
}

fn succeeded(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(output.status.success(), "{command:?}:\n{}", String::from_utf8_lossy(&output.stderr));
    output
}

impl Program {
    /// Builds the library that hides features.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let shim = folder.path().join("hide_features.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/physics/levels/hide_features.c");
        succeeded(
            Command::new("gcc")
                .args(["-O1", "-Wall", "-Werror", "-shared", "-fPIC", "-o"])
                .arg(&shim)
                .arg(source)
                .arg("-ldl"),
        );
        Self { folder, shim }
    }

    /// A command of the program at the host's level or a lower one. Compiled kernels are kept for each level, and from run to run.
    fn command(&self, name: &str, lower: Option<&Lower>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
        command.arg(name).arg("--data-dir").arg(self.folder.path());
        let mut cache = crate::common::kernel_cache();
        if let Some(lower) = lower {
            cache = cache.join("levels").join(lower.level.name);
            command.env("LD_PRELOAD", &self.shim).env("HIDE", lower.hidden);
        }
        std::fs::create_dir_all(&cache).unwrap();
        command.env("POCL_CACHE_DIR", cache);
        command
    }

    /// The device that would be used.
    fn device(&self, lower: Option<&Lower>) -> Value {
        let output = succeeded(&mut self.command("device", lower));
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["would_use"].take()
    }

    /// The levels at which this host can be made to work, the next lower one first. Fails unless PoCL then takes the processor for one of the
    /// level.
    pub fn levels_below(&self) -> Vec<&'static Lower> {
        let host = self.device(None);
        let (version, width) = (host["version"].as_str().unwrap(), host["native_vector_width_float"].as_u64());
        let has_avx2 = std::fs::read_to_string("/proc/cpuinfo").unwrap().contains(" avx2 ");
        let below = match (version.contains("x86_64"), width) {
            (true, Some(16)) => &LOWER[..],
            (true, Some(8)) if has_avx2 => &LOWER[1..],
            (true, Some(8)) => &LOWER[2..],
            _ => &[],
        };
        for lower in below {
            let device = self.device(Some(lower));
            let taken_for = device["version"].as_str().unwrap();
            let is_it = lower.cpus.iter().any(|cpu| taken_for.ends_with(&format!("-{cpu}")));
            assert!(is_it && device["lanes"] == lower.level.lanes, "for {}, PoCL took: {device:#}", lower.level.name);
        }
        println!(
            "the host is {version}; levels below it: {:?}",
            below.iter().map(|l| l.level.name).collect::<Vec<_>>()
        );
        below.iter().collect()
    }

    /// The picture of a request.
    pub fn render(&self, lower: Option<&Lower>, request: &Value) -> Picture {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("scene.json"), request.to_string()).unwrap();
        for name in ["out.exr", "out.png"] {
            succeeded(self.command("render", lower).arg(path("scene.json")).arg("-o").arg(path(name)));
        }
        let [exr, png] = ["out.exr", "out.png"].map(|name| std::fs::read(path(name)).unwrap());
        Picture::read(&exr, &png)
    }
}
