//! A tenth of the list of requests against committed films: the pictures stay the same at every level of processors.
//!
//! Bytes differ between levels, so films are held to the bound for levels (`tests/common/picture.rs`). `./dev compare` compares two builds on one
//! machine to the byte. `CLOUDCHAMBER_BLESS=1` writes the films anew, and `CLOUDCHAMBER_KERNELS=FOLDER` takes the kernels from a folder, such as
//! those of an earlier commit.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::common::engine::{House, kernels_of};
use crate::common::picture::{Picture, check_comparison};
use crate::common::pictures::{self, Asked};
use cloudchamber::device::DeviceConfig;
use cloudchamber::render;
use cloudchamber::technique::{self, Technique};
use serde_json::{Value, json};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/pictures");
/// The size of a film, so that all films together take little room.
const SIZE: [usize; 2] = [16, 12];
/// The greatest number of bytes of all films together.
const ROOM: u64 = 300_000;

/// The techniques that make a picture, as views or as fields.
fn of_pictures() -> impl Iterator<Item = &'static Technique> {
    technique::views().chain(technique::fields())
}

/// The requests whose films are committed, each with a small picture.
fn references() -> Vec<Asked> {
    let [width, height] = SIZE;
    let mut list: Vec<Asked> = pictures::list().into_iter().filter(Asked::is_reference).collect();
    for asked in &mut list {
        let image = asked.request["image"].as_object_mut().unwrap();
        image.extend([("width".into(), json!(width)), ("height".into(), json!(height))]);
    }
    list
}

/// The files of the film and the picture of a request.
fn files(name: &str) -> [PathBuf; 2] {
    ["exr", "png"].map(|extension| Path::new(FOLDER).join(name).with_extension(extension))
}

/// The picture of a request, with the bytes of its two files.
fn made(asked: &Asked, house: &House) -> (Picture, [Vec<u8>; 2]) {
    let job = house.finish(&pictures::with_volumes(&asked.request, house));
    let exr = house.film_of(&job).exr().unwrap();
    let png = job.watch().borrow().frame.as_ref().unwrap().png.to_vec();
    let picture = Picture::read(&exr, &png);
    assert!(picture.shows_something(), "{}: nothing is seen", asked.name);
    (picture, [exr, png])
}

/// The committed picture of a request.
fn committed(name: &str) -> Result<Picture, String> {
    let [exr, png] = files(name).map(|file| std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display())));
    Ok(Picture::read(&exr?, &png?))
}

/// Work that takes many launches gives the same result as work in one launch.
#[test]
fn launches_of_a_few_steps_make_the_same_pictures() {
    let cut = House::on(DeviceConfig { first_steps: 64, ..DeviceConfig::pocl() });
    let list: Vec<Asked> = pictures::list().into_iter().filter(|asked| asked.about["few_steps"] == true).collect();
    let techniques: BTreeSet<&str> = list.iter().map(Asked::technique).collect();
    for asked in &list {
        let (name, request) = (&asked.name, &asked.request);
        let film = |house: &House| house.film(&pictures::with_volumes(request, house)).0;
        let (whole, cut) = (film(House::shared()), film(&cut));
        assert!(whole.main.mean == cut.main.mean && whole.main.m2 == cut.main.m2, "{name}: another picture");
    }
    // Every technique whose kernel leaves work to the next launch is in the list.
    let resumes = |t: &&Technique| ((t.source)().words)().contains("_STATE_WORDS");
    assert_eq!(techniques, of_pictures().filter(resumes).map(|t| t.name).collect());
}

#[test]
fn a_tenth_of_the_list_looks_like_the_films_that_were_committed() {
    let house = House::shared();
    let mut others = Vec::new();
    for asked in references() {
        let (picture, made) = made(&asked, house);
        if std::env::var_os("CLOUDCHAMBER_BLESS").is_some() {
            files(&asked.name).iter().zip(made).for_each(|(file, bytes)| std::fs::write(file, bytes).unwrap());
        }
        let other = committed(&asked.name).map_or_else(Some, |reference| picture.other_than(&reference));
        others.extend(other.map(|how| format!("{}: {how}", asked.name)));
    }
    assert!(others.is_empty(), "other pictures than were committed:\n{}", others.join("\n"));
}

#[test]
fn the_films_are_those_of_a_tenth_of_the_list_and_small() {
    let list = references();
    assert!(10 * list.len() >= pictures::everything().len(), "only {} are of a tenth", list.len());
    let techniques: BTreeSet<&str> = list.iter().map(Asked::technique).collect();
    assert_eq!(techniques, of_pictures().map(|t| t.name).collect());
    let wanted: BTreeSet<PathBuf> = list.iter().flat_map(|asked| files(&asked.name)).collect();
    let kept: BTreeSet<PathBuf> = std::fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path()).collect();
    let others: Vec<_> = kept.symmetric_difference(&wanted).collect();
    assert!(others.is_empty(), "missing, or of no request: {others:?}");
    let bytes: u64 = kept.iter().map(|file| file.metadata().unwrap().len()).sum();
    assert!(bytes < ROOM, "{bytes} bytes");
}

#[test]
fn another_picture_is_seen_to_be_another() {
    check_comparison();
    assert!(committed("none_of_this_name").is_err(), "there is none");
}

#[test]
fn all_techniques_voxel_types_and_features_are_in_the_list() {
    let house = House::shared();
    let list = pictures::list();
    let everything = pictures::everything();
    let names: BTreeSet<&String> = everything.iter().map(|(_, asked)| &asked.name).collect();
    assert!(everything.len() >= 200 && names.len() == everything.len(), "names are their own");
    let techniques: BTreeSet<&str> = list.iter().map(Asked::technique).collect();
    assert_eq!(techniques, of_pictures().map(|t| t.name).collect());
    let mut met = BTreeSet::new();
    for asked in &list {
        let request = pictures::with_volumes(&asked.request, house);
        let scene = house.scene(&request).unwrap_or_else(|e| panic!("{}: {e}", asked.name));
        let variant = kernels_of(&scene)[0];
        met.extend(variant.voxel.map(|v| (variant.kernel, "voxel", format!("{v:?}"))));
        met.extend(variant.features.iter().map(|(name, value)| (variant.kernel, *name, value.to_string())));
    }
    for technique in of_pictures() {
        for variant in ((technique.source)().variants)() {
            let voxel = variant.voxel.map(|v| (variant.kernel, "voxel", format!("{v:?}")));
            let features = variant.features.iter().map(|(name, value)| (variant.kernel, *name, value.to_string()));
            for needed in voxel.into_iter().chain(features) {
                assert!(met.contains(&needed), "no request of the list has {needed:?}");
            }
        }
    }
}

/// The place of a part of a request. Parts that may stand in several places have one place, which starts with the name that they share.
fn place(at: &str) -> String {
    // A technique's own section that it shares with others is theirs.
    let mut at = at.to_owned();
    for technique in technique::all() {
        for section in technique.shares {
            at = at.replace(&format!("/{}/{section}", technique.name), &format!("/{section}"));
        }
    }
    // The parts of labels and of densities are a volume's.
    at = at.replace("/labels/", "/density/");
    let shared = technique::all().flat_map(|t| t.shares).map(|section| format!("/{section}/"));
    let parts = ["/phase", "/attenuation", "/sinogram"].map(str::to_owned).into_iter().chain(shared);
    let found = parts.filter_map(|part| at.rfind(&part)).max();
    found.filter(|_| !at.contains("/light/")).map_or(at.clone(), |start| at[start..].to_owned())
}

/// Every field that a schema permits, and every word that a field may be.
fn permitted(schema: &Value, at: &str, found: &mut BTreeSet<(String, String)>) {
    for (name, field) in schema["properties"].as_object().into_iter().flatten() {
        let at = place(&format!("{at}/{name}"));
        found.insert((at.clone(), String::new()));
        permitted(field, &at, found);
    }
    let several = ["oneOf", "anyOf"].into_iter().filter_map(|of| schema[of].as_array()).flatten();
    several.chain(schema.get("items")).for_each(|one| permitted(one, at, found));
    let words = schema["enum"].as_array().into_iter().flatten().chain(schema.get("const"));
    found.extend(words.filter_map(Value::as_str).map(|word| (at.to_owned(), word.to_owned())));
}

/// Every field of a request, and every word that a field is.
fn used(request: &Value, at: &str, found: &mut BTreeSet<(String, String)>) {
    match request {
        Value::Object(fields) => {
            for (name, field) in fields {
                let at = place(&format!("{at}/{}", if name == "test" { "id" } else { name }));
                found.insert((at.clone(), String::new()));
                used(field, &at, found);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| used(item, at, found)),
        Value::String(word) => drop(found.insert((at.to_owned(), word.clone()))),
        _ => {}
    }
}

#[test]
fn all_that_a_request_may_say_is_said_in_the_list() {
    let (mut may, mut says) = (BTreeSet::new(), BTreeSet::new());
    permitted(render::schema(House::shared().service.limits()), "", &mut may);
    let everything = pictures::everything();
    everything.iter().for_each(|(_, asked)| used(&asked.request, "", &mut says));
    assert!(may.len() > 200, "the schema was read: {may:?}");
    let missing: Vec<_> = may.difference(&says).collect();
    assert!(missing.is_empty(), "no request of the list says: {missing:?}");
}
