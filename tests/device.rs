//! The device: structs lie as on the host, every variant builds without a warning, and a tiny case of each kernel runs clean
//! under oclgrind.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

#[path = "device/cells.rs"]
mod cells;
mod common;
#[path = "device/encode.rs"]
mod encode;
#[path = "device/names.rs"]
mod names;

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

use cloudchamber::device::cells::CellsPass;
use cloudchamber::device::encode::Encode;
use cloudchamber::device::program::{Source, Variant};
use cloudchamber::device::structs::{DeviceStruct, View};
use cloudchamber::device::{self, Device, DeviceConfig, Range};
use cloudchamber::technique::emission_absorption::EmissionAbsorption;
use cloudchamber::technique::isosurface::Isosurface;
use cloudchamber::technique::photon_transport::{FieldPass, PhotonTransport};
use cloudchamber::technique::projection::Projection;
use cloudchamber::technique::scattering::Scattering;
use cloudchamber::technique::slice::Slice;
use cloudchamber::technique::{self};
use common::processes::in_processes;

fn open(lanes: Option<u32>, kernels: Option<&Path>) -> Device {
    static ONCE: Mutex<()> = Mutex::new(());
    let _one_at_a_time = ONCE.lock();
    device::keep_compiled_kernels_in(&common::kernel_cache()).unwrap();
    Device::open(&DeviceConfig { lanes, kernels: kernels.map(Path::to_owned), strict: true, ..DeviceConfig::pocl() })
        .unwrap()
}

/// The offsets of every field and the size, as the device's compiler sees them.
fn offsets_on_the_device<T: DeviceStruct>() -> Vec<usize> {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "kernel void offsets(global int *out) {\n    if (get_global_id(0) > 0) return;\n".to_owned();
    for (i, (field, _)) in T::offsets().iter().enumerate() {
        text += &format!("    out[{i}] = (int)__builtin_offsetof({}, {field});\n", T::NAME);
    }
    text += &format!("    out[{}] = (int)sizeof({});\n}}\n", T::offsets().len(), T::NAME);
    std::fs::write(folder.path().join("offsets.cl"), text).unwrap();
    let mut device = open(None, Some(folder.path()));
    let source = Source { kernel: "offsets", structs: T::opencl_text, variants: Vec::new, common: 0 };
    let variant = Variant::new("offsets", None, &[]);
    device.build(&source, &variant).unwrap();
    let mut out = vec![-1i32; T::offsets().len() + 1];
    let buffer = device.upload(bytemuck::cast_slice(&out), 0).unwrap();
    device.run(&variant, &[("out", &buffer)], 1).unwrap();
    device.read(&buffer, 0, &mut out).unwrap();
    out.into_iter().map(|v| usize::try_from(v).unwrap()).collect()
}

fn same_on_both_sides<T: DeviceStruct>() {
    let mut host: Vec<usize> = T::offsets().iter().map(|(_, offset)| *offset).collect();
    host.push(size_of::<T>());
    assert_eq!(offsets_on_the_device::<T>(), host, "{}", T::NAME);
}

#[test]
fn structs_lie_the_same_on_host_and_device() {
    same_on_both_sides::<View>();
    same_on_both_sides::<CellsPass>();
    same_on_both_sides::<Encode>();
    same_on_both_sides::<EmissionAbsorption>();
    same_on_both_sides::<FieldPass>();
    same_on_both_sides::<Isosurface>();
    same_on_both_sides::<PhotonTransport>();
    same_on_both_sides::<Projection>();
    same_on_both_sides::<Scattering>();
    same_on_both_sides::<Slice>();
}

#[test]
fn every_variant_builds_with_warnings_as_errors() {
    in_processes("every_variant_builds_with_warnings_as_errors", &["1 16", "4 8"], |some| {
        for lanes in some.split(' ').map(|n| n.parse().unwrap()) {
            let mut device = open(Some(lanes), None);
            for t in technique::ALL {
                let source = (t.source)();
                for variant in (source.variants)() {
                    assert!(variant.options(lanes, false, true).contains("-Werror"));
                    let built = device.build(&source, &variant);
                    built.unwrap_or_else(|e| panic!("{} with {lanes} lanes: {e}", variant.label()));
                }
            }
        }
    });
}

/// The program of a variant as its compiler sees it, after the preprocessor.
fn preprocessed(source: &Source, variant: &Variant) -> String {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.c");
    std::fs::write(&file, source.text(None).unwrap()).unwrap();
    let options = variant.options(16, false, true);
    let defines = options.split_whitespace().filter(|o| o.starts_with("-D"));
    let output = Command::new("gcc").args(["-E", "-P"]).args(defines).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn what_a_variant_does_without_is_not_in_its_program() {
    let source = (technique::find("emission_absorption").unwrap().source)();
    for variant in (source.variants)() {
        let text = preprocessed(&source, &variant);
        for (feature, code) in
            [("SHADED", "o.colour = shade("), ("STYLED", "styled_step("), ("PREINTEGRATED", "integral(")]
        {
            let wanted = variant.features.contains(&(feature, 1));
            assert_eq!(text.contains(code), wanted, "{}: {code}", variant.label());
        }
    }
}

#[test]
fn no_two_variants_are_the_same_program() {
    for t in technique::ALL {
        let source = (t.source)();
        let mut seen: Vec<(String, String)> = Vec::new();
        for variant in (source.variants)() {
            let text = preprocessed(&source, &variant);
            if let Some((other, _)) = seen.iter().find(|(_, known)| *known == text) {
                panic!("{} is the same program as {other}", variant.label());
            }
            seen.push((variant.label(), text));
        }
    }
}

#[test]
fn a_warning_fails_the_build() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("sloppy.cl"),
        "kernel void sloppy(global int *out) { int *p = 1.5f > 1 ? out : 0; }",
    )
    .unwrap();
    let mut device = open(None, Some(folder.path()));
    let source = Source { kernel: "sloppy", structs: String::new, variants: Vec::new, common: 0 };
    let variant = Variant::new("sloppy", None, &[]);
    assert!(device.build(&source, &variant).is_err());
}

/// Runs a scene on oclgrind and returns what it logged. It exits 0 with errors in its log, and without the dylib's path the
/// run would silently happen on PoCL.
fn oclgrind(scene: &str, lanes: &str, kernels: Option<&Path>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (file, log) = (folder.path().join("scene.json"), folder.path().join("log"));
    std::fs::write(&file, scene).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
    command.arg("render").arg(&file).args(["--device", "oclgrind", "--lanes", lanes, "--data-dir"]).arg(folder.path());
    command.arg("-o").arg(folder.path().join("out.png"));
    if let Some(kernels) = kernels {
        command.arg("--kernels").arg(kernels);
    }
    let output = command
        .env("OPENCL_DYLIB_PATH", "/usr/lib/oclgrind/liboclgrind-rt.so")
        .env("OCLGRIND_LOG", &log)
        .env("OCLGRIND_DATA_RACES", "1")
        // Inlining leaves an intrinsic in the code that oclgrind 21.10 does not know.
        .env("OCLGRIND_BUILD_OPTIONS", "-cl-opt-disable")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(log).unwrap_or_default()
}

const VIEW: &str = r#"{"technique": "emission_absorption", "volume": {"builtin": "sphere", "resolution": 12},
    "image": {"width": 9, "height": 7}, "budget": {"samples": 2}, "emission_absorption": {"shading": true}}"#;
const FIELD: &str = r#"{"technique": "emission_absorption", "volume": {"photon_transport": {"photons": 70, "grid": [6, 5, 4]}},
    "image": {"width": 5, "height": 4}, "budget": {"samples": 1}}"#;

/// Layers that refract, with a table, a histogram and the gather; delta tracking of a density by track length; gammas.
const REFRACTION: &str = r#"{"technique": "emission_absorption", "volume": {"photon_transport": {"photons": 40, "grid": [3, 3, 4], "size_mm": [2, 2, 2],
    "layers": [{"thickness_mm": 0.5, "index": 1.2, "phase": {"type": "tabulated", "cosines": [-1, 0, 1], "densities": [1, 0, 2]}},
    {"thickness_mm": "infinite", "mu_a_per_mm": 1, "index": 1.5, "phase": {"type": "rayleigh"}}], "boundary": {"fresnel": true},
    "exit_histogram": {"radius_edges_mm": [0, 1, 5], "angle_edges_deg": [0, 45, 90]}, "tally": "radiance_gather"}},
    "image": {"width": 5, "height": 4}, "budget": {"samples": 1}}"#;
const DELTA: &str = r#"{"technique": "emission_absorption", "volume": {"photon_transport": {"photons": 30, "density": {"builtin": "gaussian", "resolution": 9},
    "medium": {"mu_a_per_mm": 1, "mu_s_per_mm": 2}, "tracking": "delta", "estimator": "track_length", "boundary": {"x": "cyclic", "y": "mirror"}}},
    "image": {"width": 5, "height": 4}, "budget": {"samples": 1}}"#;
const GAMMAS: &str = r#"{"technique": "emission_absorption", "volume": {"photon_transport": {"photons": 30, "grid": [3, 2, 4], "size_mm": [50, 50, 50],
    "medium": {"phase": {"type": "klein_nishina"}, "attenuation": {"material": "water"}}, "source": {"type": "disk"}}},
    "image": {"width": 5, "height": 4}, "budget": {"samples": 1}}"#;

/// Each kind of light, emission and colours; a surface that refracts; a homogeneous box by two lights in turn.
const PATHS: &str = r#"{"technique": "volume_path", "volume": {"builtin": "sphere", "resolution": 10}, "image": {"width": 9, "height": 7},
    "budget": {"samples": 2}, "medium": {"sigma_t_per_unit": [2, 3, 4], "emission": 0.1, "phase": {"type": "tabulated", "cosines": [-1, 0, 1], "densities": [1, 0, 2]}},
    "lights": [{"type": "sun"}, {"type": "sky"}, {"type": "point", "position": [0, 0, 0]}, {"type": "sphere", "position": [1, 1, 0], "radius": 0.5},
    {"type": "quad", "corner": [0, 1, 0], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1]}], "volume_path": {"adaptive": true}}"#;
const GLASS: &str = r#"{"technique": "volume_path", "volume": {"builtin": "constant", "resolution": 8}, "image": {"width": 9, "height": 7},
    "budget": {"samples": 2}, "medium": {"sigma_t_per_unit": 2, "index": 1.5}, "lights": [{"type": "sky"}]}"#;
const SINGLE: &str = r#"{"technique": "single_scatter", "volume": {"builtin": "sphere", "resolution": 10}, "image": {"width": 17, "height": 7},
    "budget": {"samples": 2}, "medium": {"sigma_t_per_unit": 2}, "lights": [{"type": "sun"}, {"type": "point", "position": [0, 0.5, 0]}, {"type": "sky"}],
    "single_scatter": {"tracking": "exact"}}"#;

const PROJECTION: &str = r#"{"technique": "projection", "volume": {"builtin": "sphere", "resolution": 12},
    "image": {"width": 9, "height": 7}, "budget": {"samples": 2}, "projection": {}}"#;
const WALK: &str = r#"{"technique": "projection", "volume": {"builtin": "sphere", "resolution": 8},
    "image": {"width": 9, "height": 7}, "budget": {"samples": 1}, "projection": {"mode": "xray"}}"#;
const SLICE: &str = r#"{"technique": "slice", "volume": {"builtin": "sphere", "resolution": 8},
    "image": {"width": 9, "height": 7}, "budget": {"samples": 2}, "slice": {"thickness": 0.3, "mode": "maximum"}}"#;
const ISOSURFACE: &str = r#"{"technique": "isosurface", "volume": {"builtin": "sphere", "resolution": 12},
    "image": {"width": 9, "height": 7}, "budget": {"samples": 2}, "isosurface": {"ambient_occlusion": {"rays": 2}}}"#;
const LAYERS: &str = r#"{"technique": "isosurface", "volume": {"builtin": "gaussian", "resolution": 8}, "image": {"width": 9, "height": 7},
    "budget": {"samples": 1}, "isosurface": {"surfaces": [{"isovalue": 0.3, "opacity": 0.5}, {"isovalue": 0.6}], "normals": "analytic"}}"#;

#[test]
fn a_tiny_case_of_each_kernel_is_clean_under_oclgrind() {
    for lanes in ["1", "4"] {
        for scene in
            [VIEW, FIELD, REFRACTION, DELTA, GAMMAS, PATHS, GLASS, SINGLE, PROJECTION, WALK, SLICE, ISOSURFACE, LAYERS]
        {
            assert_eq!(oclgrind(scene, lanes, None).trim(), "", "{lanes} lanes: {scene}");
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
        // A pixel too far.
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
    let log = oclgrind(VIEW, "1", Some(folder.path()));
    assert!(log.contains("Invalid write"), "the log is: {log}");
}

#[test]
fn a_volume_read_as_an_image_looks_the_same() {
    let scene = |voxel: &str| {
        format!(
            r#"{{"technique": "emission_absorption", "volume": {{"builtin": "{voxel}", "resolution": 40}},
            "image": {{"width": 48, "height": 40}}, "budget": {{"samples": 2}}, "emission_absorption": {{"shading": true}}}}"#
        )
    };
    for builtin in ["marschner_lobb", "shepp_logan", "smoke"] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.json");
        std::fs::write(&file, scene(builtin)).unwrap();
        let render = |images: &str| {
            let out = folder.path().join(format!("{images}.exr"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_cloudchamber"));
            command.arg("render").arg(&file).args(["--lanes", "1", "--volume-images", images, "--data-dir"]);
            let output = command.arg(folder.path()).arg("-o").arg(&out).output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let picture = exr::prelude::read_first_rgba_layer_from_file(
                out,
                |size, _| vec![[0.0f32; 3]; size.width() * size.height()],
                |pixels: &mut Vec<[f32; 3]>, at, (r, g, b, _): (f32, f32, f32, f32)| {
                    pixels[at.y() * 48 + at.x()] = [r, g, b]
                },
            );
            picture.unwrap().layer_data.channel_data.pixels
        };
        let (buffer, image) = (render("false"), render("true"));
        let worst = buffer.iter().flatten().zip(image.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{builtin}: {worst:e}");
        assert!(buffer.iter().flatten().any(|v| *v > 0.05), "{builtin} is there");
    }
}

/// A file of two kernel functions, and how they are asked for.
fn two_functions() -> (tempfile::TempDir, Source) {
    let folder = tempfile::tempdir().unwrap();
    let text = "kernel void fill(global int *out, constant int *size) {\n\
        int x = (int)get_global_id(0), y = (int)get_global_id(1), z = (int)get_global_id(2);\n\
        if (x >= size[0] || y >= size[1] || z >= size[2]) return;\n\
        out[(z * size[1] + y) * size[0] + x] = x + 10 * y + 100 * z;\n}\n\
        kernel void twice(global const int *from, global int *to) {\n    to[get_global_id(0)] = 2 * from[get_global_id(0)];\n}\n";
    std::fs::write(folder.path().join("two.cl"), text).unwrap();
    (folder, Source { kernel: "two", structs: String::new, variants: Vec::new, common: 0 })
}

#[test]
fn functions_of_a_file_run_over_ranges_of_one_to_three_dimensions() {
    let (folder, source) = two_functions();
    let mut device = open(None, Some(folder.path()));
    let [fill, twice] = ["fill", "twice"].map(|name| Variant::new("two", None, &[]).of_function(name));
    device.build(&source, &fill).unwrap();
    device.build(&source, &twice).unwrap();
    for size in [[5i32, 1, 1], [5, 3, 1], [5, 3, 2]] {
        let count = size.iter().product::<i32>() as usize;
        let dims = size.map(|n| n as usize);
        let range = match dims {
            [x, 1, 1] => Range::from(x),
            [x, y, 1] => Range::from([x, y]),
            all => Range::from(all),
        };
        // Whole work-groups write past their count.
        let (out, to) = (device.allocate(4 * (count + 64)).unwrap(), device.allocate(4 * (count + 64)).unwrap());
        let size_buffer = device.upload(bytemuck::cast_slice(&size), 0).unwrap();
        // In any order.
        device.run(&fill, &[("size", &size_buffer), ("out", &out)], range).unwrap();
        device.run(&twice, &[("to", &to), ("from", &out)], count).unwrap();
        let mut found = vec![0i32; count];
        device.read(&to, 0, &mut found).unwrap();
        let place = |i: usize| (i % dims[0] + 10 * (i / dims[0] % dims[1]) + 100 * (i / dims[0] / dims[1])) as i32;
        assert_eq!(found, (0..count).map(|i| 2 * place(i)).collect::<Vec<_>>(), "{size:?}");
    }
}

#[test]
fn a_wrong_argument_is_named_with_its_kernel() {
    let (folder, source) = two_functions();
    let mut device = open(None, Some(folder.path()));
    let twice = Variant::new("two", None, &[]).of_function("twice");
    device.build(&source, &twice).unwrap();
    let buffer = device.allocate(64).unwrap();
    for (names, said) in [
        (&["from"][..], "two.twice: the argument to is missing"),
        (&["from", "film"], "two.twice: there is no parameter film"),
        (&["from", "to", "from"], "two.twice: the argument from is given twice"),
    ] {
        let arguments: Vec<_> = names.iter().map(|name| (*name, &buffer)).collect();
        let error = device.run(&twice, &arguments, 1).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let unknown = Variant::new("two", None, &[]).of_function("thrice");
    assert!(device.build(&source, &unknown).is_err());
}
