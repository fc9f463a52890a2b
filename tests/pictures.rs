//! Pictures of a list of 60 requests of all techniques, voxel types and interpolations: their bytes are those that were committed, so
//! that a change of kernels that is to change nothing is seen to change nothing.
//!
//! The hashes are of AVX-512 on PoCL 3.1: `CLOUDCHAMBER_BLESS=1` writes them anew, and `CLOUDCHAMBER_KERNELS=FOLDER` takes the kernels
//! from a folder, such as those of an earlier commit.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test says what is wrong by panicking")]

mod common;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use cloudchamber::film::Film;
use cloudchamber::scene::{Scene, Subject};
use cloudchamber::technique;
use common::engine::House;
use common::pictures::{self, Asked};

const COMMITTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/pictures/avx512-pocl3.1.txt");

/// Hashes of the film, its means and what its error is told from, and of the picture's bytes.
fn hashes(film: &Film, picture: &[u8]) -> [String; 2] {
    let hash = |bytes: &[u8]| blake3::hash(bytes).to_hex()[..32].to_owned();
    let mut sums: Vec<u8> = bytemuck::cast_slice(&film.main.mean).to_vec();
    // Of one sample they are not read: all are 0.
    let m2 = if film.main.m2.is_empty() { &vec![0.0; film.main.pixels()] } else { &film.main.m2 };
    sums.extend_from_slice(bytemuck::cast_slice(m2));
    sums.extend_from_slice(bytemuck::cast_slice(film.control.as_ref().map_or(&[][..], |control| &control.mean)));
    [hash(&sums), hash(picture)]
}

/// Whether this is what the committed hashes are of.
fn is_committed_kind(house: &House) -> bool {
    let info = house.info();
    info.lanes == 16 && info.version.ends_with("-skylake-avx512") && info.platform_version.contains("PoCL 3.1")
}

/// Whether there is something to see, and it is made of numbers.
fn check_shown(asked: &Asked, film: &Film, picture: &[u8]) {
    assert!(film.main.mean.iter().all(|v| v.is_finite()), "{}: values that are no numbers", asked.name);
    assert!(picture.iter().any(|v| *v != picture[0]), "{}: nothing is seen", asked.name);
}

#[test]
fn the_pictures_of_the_list_are_the_bytes_that_were_committed() {
    let house = House::shared();
    let mut made = String::new();
    for asked in pictures::list() {
        let request = pictures::with_volumes(&asked.request, house);
        let ((film, _), picture) = (house.film(&request), house.picture(&request));
        check_shown(&asked, &film, &picture);
        let [film, picture] = hashes(&film, &picture);
        writeln!(made, "{} {film} {picture}", asked.name).unwrap();
    }
    if !is_committed_kind(house) {
        let here = &house.info().version;
        return common::say(&format!("not compared: the hashes are of AVX-512 on PoCL 3.1, and this is {here}"));
    }
    if std::env::var_os("CLOUDCHAMBER_BLESS").is_some() {
        return std::fs::write(COMMITTED, made).unwrap();
    }
    let committed = std::fs::read_to_string(Path::new(COMMITTED)).unwrap();
    let others: Vec<_> = made.lines().filter(|line| !committed.lines().any(|known| known == *line)).collect();
    assert!(others.is_empty(), "other bytes than were committed:\n{}", others.join("\n"));
    assert_eq!(made.lines().count(), committed.lines().count(), "the list and the hashes are of different pictures");
}

#[test]
fn all_techniques_voxel_types_and_features_are_in_the_list() {
    let house = House::shared();
    let list = pictures::list();
    assert_eq!(list.len(), 60);
    assert_eq!(list.iter().map(|a| &a.name).collect::<BTreeSet<_>>().len(), 60, "names are their own");
    let techniques: BTreeSet<&str> = list.iter().map(Asked::technique).collect();
    assert_eq!(techniques, technique::ALL.iter().map(|t| t.name).collect());
    let mut met = BTreeSet::new();
    for asked in &list {
        let request = pictures::with_volumes(&asked.request, house);
        let scene =
            Scene::from_json(&request, &house.store, &house.limits).unwrap_or_else(|e| panic!("{}: {e}", asked.name));
        let variant = match scene.subject() {
            Subject::Volume(volume) => scene.view().plan(volume).unwrap().variant,
            Subject::Field(field) => field.plan().unwrap().variant,
        };
        met.extend(variant.voxel.map(|v| (variant.kernel, "voxel", format!("{v:?}"))));
        met.extend(variant.features.iter().map(|(name, value)| (variant.kernel, *name, value.to_string())));
    }
    for technique in technique::ALL {
        for variant in ((technique.source)().variants)() {
            let voxel = variant.voxel.map(|v| (variant.kernel, "voxel", format!("{v:?}")));
            let features = variant.features.iter().map(|(name, value)| (variant.kernel, *name, value.to_string()));
            for needed in voxel.into_iter().chain(features) {
                assert!(met.contains(&needed), "no request of the list has {needed:?}");
            }
        }
    }
}
