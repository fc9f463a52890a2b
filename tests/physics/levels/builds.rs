//! Every kernel compiles for every level without a warning.

use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

use cloudchamber::device;
use cloudchamber::device::program::{Source, Variant};
use cloudchamber::run;
use cloudchamber::volume::VoxelType;
use rayon::prelude::*;

use super::compiler::{Compiler, LEVELS, Level};
use crate::common::{kernels, opening, say};

fn compiler() -> &'static Compiler {
    static COMPILER: OnceLock<Compiler> = OnceLock::new();
    COMPILER.get_or_init(|| {
        let _opening = opening();
        Compiler::of(&device::select("pocl", None).unwrap().1.platform_version)
    })
}

fn sources() -> Vec<Source> {
    run::sources().collect()
}

/// One of a kernel's variants for a level. The types of voxels take turns, and so do the variants of a type.
fn one_of(variants: &[Variant], kernel: usize, level: usize) -> Variant {
    let voxel = VoxelType::ALL[(kernel + level) % VoxelType::ALL.len()];
    let of_type: Vec<_> = variants.iter().filter(|v| v.voxel.is_none_or(|own| own == voxel)).collect();
    *of_type[level * of_type.len() / LEVELS.len()]
}

fn compile(compiler: &Compiler, level: &Level, source: &Source, variant: &Variant) -> Result<bool, String> {
    let text = source.text(kernels().as_deref()).unwrap();
    let built = compiler.compile_once(level, &variant.options(level.lanes, false, true), &text);
    built.map_err(|said| format!("{} ({}, {} lanes): {}:\n{said}", level.name, level.cpu, level.lanes, variant.label()))
}

/// Compiles the jobs on all cores, and fails with the compiler's messages about those that do not build.
fn all_build(jobs: &[(&Level, &Source, Variant)]) {
    let (compiler, started) = (compiler(), Instant::now());
    let done: Vec<_> =
        jobs.par_iter().map(|(level, source, variant)| compile(compiler, level, source, variant)).collect();
    let anew = done.iter().filter(|d| matches!(d, Ok(true))).count();
    let seconds = started.elapsed().as_secs_f64();
    say(&format!(
        "{} kernels for {} levels, {anew} of them compiled anew, in {seconds:.1} s",
        jobs.len(),
        LEVELS.len()
    ));
    let faults: Vec<_> = done.into_iter().filter_map(Result::err).collect();
    assert!(faults.is_empty(), "{} of {} do not build:\n{}", faults.len(), jobs.len(), faults.join("\n"));
}

#[test]
fn every_kernel_builds_at_every_level() {
    let sources = sources();
    let mut jobs = Vec::new();
    for (n, source) in sources.iter().enumerate() {
        let variants = (source.variants)();
        jobs.extend(LEVELS.iter().enumerate().map(|(l, level)| (level, source, one_of(&variants, n, l))));
    }
    all_build(&jobs);
}

#[test]
fn every_variant_builds_at_every_level() {
    if !super::is_full() {
        return say("not run: every variant at every level (./dev test --full compiles them)");
    }
    let sources = sources();
    let mut jobs = Vec::new();
    for level in &LEVELS {
        for source in &sources {
            jobs.extend((source.variants)().into_iter().map(|variant| (level, source, variant)));
        }
    }
    all_build(&jobs);
}

/// Compiles a program of one header, with the structs and a variant of a kernel that includes it.
fn build_alone(header: &str) -> Result<bool, String> {
    let includes = |s: &Source| s.text(None).unwrap().contains(&format!("#line 1 \"kernels/shared/{header}\""));
    let source = sources().into_iter().find(includes).unwrap_or_else(|| panic!("no kernel includes {header}"));
    let folder = tempfile::tempdir().unwrap();
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels/shared");
    std::os::unix::fs::symlink(shared, folder.path().join("shared")).unwrap();
    let program = format!("#include \"shared/{header}\"\nkernel void alone(global int *out) {{ out[0] = 1; }}\n");
    std::fs::write(folder.path().join(format!("{}.cl", source.kernel)), program).unwrap();
    let text = source.text(Some(folder.path())).unwrap();
    let options = (source.variants)()[0].options(LEVELS[0].lanes, false, true);
    compiler().compile_once(&LEVELS[0], &options, &text).map_err(|said| format!("{header} alone:\n{said}"))
}

#[test]
fn every_header_builds_alone() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("kernels/shared");
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let headers: Vec<String> = names.collect();
    let faults: Vec<String> = headers.par_iter().filter_map(|header| build_alone(header).err()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(headers.len() > 20, "{} headers", headers.len());
}

/// A kernel that hands `ulong`s a lane from one function to another.
fn wide(lanes: u32) -> String {
    format!(
        "static ulong{lanes} more(uint{lanes} v) {{ return convert_ulong{lanes}(v) + 1; }}\n\
         kernel void wide(global ulong{lanes} *out, global uint{lanes} *in) {{ out[0] = more(in[0]); }}\n"
    )
}

#[test]
fn a_vector_wider_than_the_registers_fails_where_it_is_wider() {
    let compiler = compiler();
    let build = |level: &str, lanes: u32| {
        let level = LEVELS.iter().find(|l| l.name == level).unwrap();
        compiler.compile(level, "-cl-std=CL1.2 -Werror", &wide(lanes))
    };
    for (level, fits, too_wide) in
        [("AVX-512", 8, None), ("AVX2", 4, Some(8)), ("AVX", 4, Some(8)), ("SSE4", 2, Some(4))]
    {
        build(level, fits).unwrap_or_else(|said| panic!("{level}: {said}"));
        if let Some(lanes) = too_wide {
            let said = build(level, lanes).expect_err("a vector that is passed in memory");
            assert!(said.contains("changes the ABI"), "{level}: {said}");
        }
    }
}

#[test]
fn a_warning_fails_the_build_and_names_the_level() {
    let source = Source {
        kernel: "cells",
        words: || "kernel void sloppy(global int *out) { if (out = out) *out = 1; }\n".into(),
        structs: Vec::new,
        variants: Vec::new,
        common: 0,
    };
    let variant = Variant::new("cells", Some(VoxelType::U8), &[]);
    for level in &LEVELS {
        let said = compile(compiler(), level, &source, &variant).expect_err("an assignment for a comparison");
        assert!(said.starts_with(level.name) && said.contains("-Werror"), "{said}");
    }
}
