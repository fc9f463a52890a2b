//! The rules of the source tree: layers, file sizes, and a README that works as written.

mod imports;

use std::path::{Path, PathBuf};
use std::process::Command;

use imports::Imports;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|e| e == extension) {
            found.push(path);
        }
    }
    found
}

/// The source files below `src` that mention any of `words` outside of comments.
fn mentioning(words: &[&str]) -> Vec<String> {
    let src = root().join("src");
    let says = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).unwrap();
        text.lines().filter(|l| !l.trim_start().starts_with("//")).any(|l| words.iter().any(|w| l.contains(w)))
    };
    files(&src, "rs").iter().filter(|p| says(p)).map(|p| p.strip_prefix(&src).unwrap().display().to_string()).collect()
}

#[test]
fn axum_lives_in_http_only() {
    let outside: Vec<_> =
        mentioning(&["axum::", "tower_http::"]).into_iter().filter(|f| !f.starts_with("http/")).collect();
    assert!(outside.is_empty(), "{outside:?}");
    assert!(!mentioning(&["axum::"]).is_empty(), "the test looks for something that is there");
}

#[test]
fn opencl_and_unsafe_live_in_device_only() {
    let words = ["opencl3", "cl3::", "unsafe {", "unsafe fn", "unsafe impl"];
    let outside: Vec<_> = mentioning(&words).into_iter().filter(|f| !f.starts_with("device/")).collect();
    assert!(outside.is_empty(), "{outside:?}");
    assert!(!mentioning(&["opencl3"]).is_empty(), "the test looks for something that is there");
}

/// The layers, in the order of the data: a module uses only modules of later layers. Modules of one layer do not use each other.
const ORDER: [&[&str]; 19] = [
    &["command"],
    &["http"],
    &["study"],
    &["service"],
    &["plan", "run"],
    &["chart"],
    &["job"],
    &["render"],
    &["technique"],
    &["scene"],
    &["request"],
    &["config"],
    &["device"],
    &["film"],
    &["frame", "power_law"],
    &["asset"],
    &["tomography"],
    &["volume"],
    &["error", "split_mix"],
];

#[test]
fn layers_point_one_way() {
    let imports = Imports::of(&root().join("src"));
    let place = |module: &str| {
        let found = ORDER.iter().position(|layer| layer.contains(&module));
        found.unwrap_or_else(|| panic!("{module} has no place in the order"))
    };
    let mut wrong = Vec::new();
    for (from, all) in &imports.uses {
        for to in all.iter().filter(|to| to[0] != from[0]) {
            if place(&to[0]) <= place(&from[0]) {
                wrong.push(format!("{} uses {}", from.join("::"), to.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let count: usize = imports.uses.values().map(|all| all.len()).sum();
    assert!(count > 500, "only {count} uses are seen");
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    let circles = Imports::of(&root().join("src")).circles();
    assert!(circles.is_empty(), "{circles:#?}");
}

#[test]
fn every_form_of_a_use_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let write = |file: &str, text: &str| {
        let path = folder.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("whole.rs", "use crate::used;");
    write("braces.rs", "use crate::{error::E, used::{self, inner::Deep as Other}};");
    write("path.rs", "fn f() { let text = \"crate::error::E\"; println!(\"{}\", crate::used::f(text)); }");
    write("parents.rs", "use super::used::f;");
    write("handed_on.rs", "use crate::used::Handed;");
    write("by_name.rs", "use crate::used;\nfn f() { used::inner::g() }");
    write("tested.rs", "// use crate::used;\n#[cfg(test)]\nmod tests { use crate::used; }");
    write("error.rs", "pub struct E;");
    write("used/mod.rs", "mod inner;\npub use inner::Handed;\nfn f() { inner::g() }");
    write("used/inner.rs", "use super::f;");
    let imports = Imports::of(folder.path());
    let uses = |module: &str| -> Vec<String> {
        imports.uses[&vec![module.to_owned()]].iter().map(|to| to.join("::")).collect()
    };
    assert_eq!(uses("whole"), ["used"]);
    assert_eq!(uses("braces"), ["error", "used", "used::inner"]);
    assert_eq!(uses("path"), ["used"]);
    assert_eq!(uses("parents"), ["used"]);
    assert_eq!(uses("handed_on"), ["used::inner"]);
    assert_eq!(uses("by_name"), ["used", "used::inner"]);
    assert!(uses("tested").is_empty() && uses("error").is_empty());
    assert!(imports.circles().is_empty(), "a folder and its own are no circle");
    write("error.rs", "use crate::whole::F;");
    write("used/other.rs", "use crate::error::E;\nuse super::inner;");
    write("used/inner.rs", "use super::other;");
    let circles = Imports::of(folder.path()).circles();
    let all =
        [vec!["error".to_owned(), "used".into(), "whole".into()], vec!["used::inner".into(), "used::other".into()]];
    assert_eq!(circles, all);
}

#[test]
fn every_technique_has_its_three_files() {
    for t in cloudchamber::technique::ALL {
        for file in [
            format!("src/technique/{}.rs", t.name),
            format!("kernels/{}.cl", t.name),
            format!("tests/physics/{}.rs", t.name),
        ] {
            assert!(root().join(&file).is_file(), "{file} is missing");
        }
    }
}

#[test]
fn the_map_of_the_house_names_every_module() {
    let map = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for module in map.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')) {
        assert!(map.contains(&format!("[`{module}`]")), "src/lib.rs does not say what {module} is");
    }
}

#[test]
fn no_file_grows_past_its_job() {
    for (folder, extension) in [("src", "rs"), ("kernels", "cl"), ("kernels", "h"), ("static", "js"), ("tests", "rs")] {
        for path in files(&root().join(folder), extension) {
            let lines = std::fs::read_to_string(&path).unwrap().lines().count();
            assert!(lines <= 300, "{} has {lines} lines: split it", path.display());
        }
    }
}

/// The numbers and colours of a table `name = [ … ];` in a source text, in order.
fn table(text: &str, name: &str) -> Vec<String> {
    let start = text.find(&format!("const {name}")).unwrap_or_else(|| panic!("no table {name}"));
    let body = &text[start..];
    let body = &body[body.find('=').unwrap()..body.find("];").unwrap()];
    let words =
        body.split(|c: char| !(c.is_ascii_alphanumeric() || "#.-".contains(c))).filter(|w| !w.is_empty() && *w != "-");
    words
        .map(|w| match w.trim_start_matches("0x").trim_start_matches('#') {
            colour if colour.len() == 6 && w != colour => colour.to_owned(),
            number => number.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {w}")).to_string(),
        })
        .collect()
}

#[test]
fn the_viewers_presets_are_the_servers() {
    let read = |file: &str| std::fs::read_to_string(root().join(file)).unwrap();
    let (server, viewer) = (read("src/scene/presets.rs"), read("static/presets.js"));
    for name in
        ["RAMP", "MRI_HEAD", "CT_BONE", "CT_BONE_HOUNSFIELD", "BONE_FLESH", "BONE_FLESH_HOUNSFIELD", "BLUE_YELLOW"]
    {
        let (ours, theirs) = (table(&server, name), table(&viewer, name));
        assert!(ours.len() >= 9 && ours == theirs, "{name}: {ours:?} in the server, {theirs:?} in the viewer");
    }
}

/// The `sh` blocks of the README that call curl.
fn curl_examples() -> Vec<String> {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let blocks = readme.split("```sh\n").skip(1).filter_map(|b| b.split("```").next());
    blocks.filter(|b| b.contains("curl ")).map(str::to_owned).collect()
}

#[test]
fn the_readmes_curl_examples_work_as_written() {
    let examples = curl_examples();
    assert!(examples.len() >= 5, "the README has {} curl examples", examples.len());
    let server = crate::common::Server::start();
    let folder = tempfile::tempdir().unwrap();
    let mri =
        std::env::var("CLOUDCHAMBER_TEST_MRI").unwrap_or_else(|_| "/usr/share/mricron/templates/ch2.nii.gz".into());
    std::fs::copy(&mri, folder.path().join("ch2.nii.gz")).unwrap();
    // A newcomer has patience, but a test has two minutes per call.
    std::fs::write(folder.path().join(".curlrc"), "max-time = 120\n").unwrap();
    // All examples run in one shell, since an example may use variables of an earlier one. `CC` is the address that the README sets itself.
    let script = format!("set -eu\n{}", examples.join("\n"));
    let output = Command::new("bash")
        .args(["-c", &script])
        .env("CURL_HOME", folder.path())
        .current_dir(folder.path())
        .env("CC", server.url())
        .output()
        .unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{script}\n{out}\n{err}");
    assert!(!out.contains("\"status\":4") && !out.contains("\"status\":5"), "{out}");
    let mut pictures = 0;
    for entry in std::fs::read_dir(folder.path()).unwrap().map(Result::unwrap) {
        if entry.path().extension().is_some_and(|e| e == "png") {
            let picture = image::open(entry.path()).unwrap().to_rgb8();
            let first = picture.get_pixel(0, 0);
            assert!(picture.pixels().any(|p| p != first), "{} is of one colour", entry.path().display());
            pictures += 1;
        }
    }
    assert!(pictures >= 2, "the examples made {pictures} pictures");
}
