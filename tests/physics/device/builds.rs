//! Each variant is a program of its own, and a warning fails its build.

use std::process::Command;

use cloudchamber::device::program::{Source, Variant};
use cloudchamber::technique;

use super::open;

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
