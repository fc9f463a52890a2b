//! Every variant builds, with warnings as errors, and each is a program of its own.

use std::process::Command;

use cloudchamber::device::program::{Source, Variant};
use cloudchamber::run;
use cloudchamber::technique;

use super::open;
use crate::common::processes::in_processes;
use crate::levels::is_full;

/// All numbers of lanes.
const LANES: [u32; 4] = [1, 4, 8, 16];

/// The variants that are built for a number of lanes: each combination of features with one type of voxels, and another type for each number of
/// lanes, so that every variant is built once. `--full` builds all for all.
fn built(variants: &[Variant], lanes: u32) -> Vec<Variant> {
    if is_full() {
        return variants.to_vec();
    }
    let mut combinations: Vec<(&Variant, Vec<&Variant>)> = Vec::new();
    for variant in variants {
        let same = |other: &Variant| (other.features, other.function) == (variant.features, variant.function);
        match combinations.iter_mut().find(|(first, _)| same(first)) {
            Some((_, of_types)) => of_types.push(variant),
            None => combinations.push((variant, vec![variant])),
        }
    }
    let turn = LANES.iter().position(|n| *n == lanes).unwrap();
    combinations.iter().enumerate().map(|(at, (_, of_types))| *of_types[(at + turn) % of_types.len()]).collect()
}

#[test]
fn every_variant_builds_with_warnings_as_errors() {
    in_processes("device::builds::every_variant_builds_with_warnings_as_errors", &["1 16", "4 8"], |some| {
        for lanes in some.split(' ').map(|n| n.parse().unwrap()) {
            let mut device = open(Some(lanes), None);
            for source in run::sources() {
                for variant in built(&(source.variants)(), lanes) {
                    assert!(variant.options(lanes, false, true).contains("-Werror"));
                    let built = device.build(&source, &variant);
                    built.unwrap_or_else(|e| panic!("{} with {lanes} lanes: {e}", variant.label()));
                }
            }
        }
    });
}

#[test]
fn each_combination_of_features_and_each_type_of_voxels_is_built() {
    for t in technique::ALL {
        let variants = ((t.source)().variants)();
        for lanes in LANES {
            let chosen = built(&variants, lanes);
            for variant in &variants {
                assert!(chosen.iter().any(|c| c.features == variant.features), "{}", variant.label());
            }
        }
        let all: Vec<Variant> = LANES.iter().flat_map(|lanes| built(&variants, *lanes)).collect();
        for variant in &variants {
            assert!(all.contains(variant), "{} is built for no number of lanes", variant.label());
        }
    }
}

/// The program of a variant as its compiler sees it, after the preprocessor.
pub fn preprocessed(source: &Source, variant: &Variant) -> String {
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
    let source = Source { kernel: "sloppy", words: String::new, structs: Vec::new, variants: Vec::new, common: 0 };
    let variant = Variant::new("sloppy", None, &[]);
    assert!(device.build(&source, &variant).is_err());
}
