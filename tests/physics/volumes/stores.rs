//! The store: the uploads that it keeps, over restarts too, and those that it refuses.

use crate::common::writers::*;
use cloudchamber::asset::{AssetLimits, Assets};
use cloudchamber::error::{Error, Result};
use cloudchamber::volume::builtin::NAMES;
use cloudchamber::volume::{Endian, RawParams, RawType, VolumeInfo};
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

const LIMITS: AssetLimits =
    AssetLimits { volume: crate::common::writers::LIMITS, max_store_bytes: 1 << 20, max_resident_bytes: 1 << 20 };
const BYTES_2X2X2: RawParams =
    RawParams { dims: [2, 2, 2], voxel_type: RawType::U8, spacing: [1.0; 3], endian: Endian::Little };

fn open(dir: &Path) -> Assets {
    Assets::open(dir, LIMITS).unwrap()
}

fn files(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(dir.join("volumes"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn uploads(store: &Assets) -> Vec<VolumeInfo> {
    store.list_volumes().into_iter().filter(|info| info.id.is_some()).collect()
}

fn not_found<T>(result: Result<T>) -> bool {
    matches!(result, Err(Error::NotFound { what: "volume", .. }))
}

#[test]
fn the_same_upload_twice_is_one_volume() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path());
    let (file, data) = small_nifti();
    let bytes = gzip(&file.with(&data));
    let (first, id, new) = store.volumes().insert(bytes.clone(), "first", None).unwrap();
    assert!(new && id.len() == 32);
    let (second, same_id, new) = store.volumes().insert(bytes, "second", None).unwrap();
    assert!(!new && id == same_id && Arc::ptr_eq(&first, &second));
    assert_eq!(files(dir.path()), [format!("{id}.json"), format!("{id}.nii.gz")]);
    assert_eq!(uploads(&store).len(), 1);

    // The same bytes, read in another way, are another volume.
    let wide = RawParams { dims: [8, 1, 1], ..BYTES_2X2X2 };
    let (_, cube_id, _) = store.volumes().insert(vec![5; 8], "cube", Some(BYTES_2X2X2)).unwrap();
    let (row, row_id, new) = store.volumes().insert(vec![5; 8], "row", Some(wide)).unwrap();
    assert!(new && row_id != cube_id && row.dims() == [8, 1, 1]);
}

#[test]
fn uploads_outlive_a_restart() {
    let dir = tempfile::tempdir().unwrap();
    let slow = RawParams { spacing: [1.0, 2.0, 3.0], ..BYTES_2X2X2 };
    let (raw_id, nrrd_id, infos) = {
        let store = open(dir.path());
        let (_, raw_id, _) = store.volumes().insert((0..8).collect(), "raw one", Some(slow)).unwrap();
        let (_, nrrd_id, _) =
            store.volumes().insert(small_nrrd("spacings: 0.1 0.2 0.3"), "nrrd\u{7} one", None).unwrap();
        (raw_id, nrrd_id, uploads(&store))
    };
    let store = open(dir.path());
    assert_eq!(uploads(&store), infos);
    assert_eq!(store.sizes().1, 0, "nothing is decoded yet");
    let volume = store.volumes().get(&raw_id).unwrap();
    assert_eq!(
        (volume.voxels().unwrap().as_bytes(), volume.spacing()),
        ([0, 1, 2, 3, 4, 5, 6, 7].as_slice(), [1.0, 2.0, 3.0])
    );
    let info = store.volumes().info(&nrrd_id).unwrap();
    assert_eq!((info.name.as_str(), info.format.as_str(), info.dims), ("nrrd one", "nrrd", [4, 3, 2]));
    assert_eq!(info.histogram.unwrap().counts.iter().sum::<u64>(), 24);
    assert_eq!(info.reference, serde_json::json!({ "id": nrrd_id }));
    let listed = infos.iter().find(|listed| listed.id == info.id).unwrap();
    assert!(listed.histogram.is_none());
    assert_eq!(listed.world_from_index, info.world_from_index);
}

#[test]
fn what_a_crash_leaves_is_removed_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let id = open(dir.path()).volumes().insert(vec![1; 8], "kept", Some(BYTES_2X2X2)).unwrap().1;
    let orphan = "0123456789abcdef0123456789abcdef";
    for name in [format!("{orphan}.nii"), format!("tmp-{orphan}"), "notes.txt".into()] {
        std::fs::write(dir.path().join("volumes").join(name), b"half").unwrap();
    }
    std::fs::write(dir.path().join("volumes").join(format!("{}.json", orphan.replace('0', "f"))), b"{ half").unwrap();
    let store = open(dir.path());
    assert_eq!(uploads(&store).len(), 1);
    let left = files(dir.path());
    assert!(left.contains(&"notes.txt".into()) && left.contains(&format!("{id}.raw")));
    assert!(!left.iter().any(|name| name.contains(orphan)), "{left:?}");
    // A body that was changed behind the store's back is the server's fault, not the client's. Listing does not read it.
    std::fs::write(dir.path().join("volumes").join(format!("{id}.raw")), b"7 bytes").unwrap();
    assert!(matches!(store.volumes().get(&id), Err(Error::Internal(_))));
    assert!(uploads(&open(dir.path())).is_empty());
}

#[test]
fn deleted_volumes_are_gone_but_live_on_in_use() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path());
    let (volume, id, _) = store.volumes().insert(vec![9; 8], "short-lived", Some(BYTES_2X2X2)).unwrap();
    store.volumes().delete(&id).unwrap();
    assert!(
        not_found(store.volumes().get(&id))
            && not_found(store.volumes().delete(&id))
            && not_found(store.volumes().info(&id))
    );
    assert!(files(dir.path()).is_empty() && uploads(&store).is_empty());
    assert_eq!(store.sizes(), (0, 0));
    assert_eq!(volume.values().unwrap().at(1, 1, 1), 9.0);
    assert!(store.volumes().insert(vec![9; 8], "again", Some(BYTES_2X2X2)).unwrap().2);
}

#[test]
fn only_ids_are_looked_up() {
    let parent = tempfile::tempdir().unwrap();
    let dir = parent.path().join("store");
    let store = open(&dir);
    let id = store.volumes().insert(vec![2; 8], "cube", Some(BYTES_2X2X2)).unwrap().1;
    for trick in [
        "",
        "..",
        "../store",
        "/etc/passwd",
        &format!("../store/{id}"),
        &format!("{id}/"),
        &format!("{id}.json"),
        &id.to_uppercase(),
        &id[..31],
        "%2e%2e",
        "\0",
    ] {
        assert!(not_found(store.volumes().get(trick)) && not_found(store.volumes().delete(trick)), "{trick}");
    }
    assert!(not_found(store.volumes().get(&"é".repeat(100_000))));
    assert!(store.volumes().get(&id).is_ok());
}

#[test]
fn limits_hold() {
    let dir = tempfile::tempdir().unwrap();
    let limits = AssetLimits { max_store_bytes: 20, max_resident_bytes: 16, ..LIMITS };
    let store = Assets::open(dir.path(), limits).unwrap();
    let ids: Vec<_> =
        (0..2).map(|i| store.volumes().insert(vec![i; 8], "cube", Some(BYTES_2X2X2)).unwrap().1).collect();
    assert!(matches!(store.volumes().insert(vec![7; 8], "third", Some(BYTES_2X2X2)), Err(Error::TooLarge { .. })));
    assert!(!store.volumes().insert(vec![1; 8], "known", Some(BYTES_2X2X2)).unwrap().2, "what is there needs no room");
    store.volumes().delete(&ids[0]).unwrap();
    assert!(store.volumes().insert(vec![7; 8], "third", Some(BYTES_2X2X2)).unwrap().2);
    assert_eq!(files(dir.path()).len(), 4);
    assert!(store.volumes().insert(b"no volume".to_vec(), "x", None).is_err());
    assert_eq!(files(dir.path()).len(), 4, "what is refused leaves nothing");
    let small =
        AssetLimits { volume: cloudchamber::volume::VolumeLimits { max_volume_bytes: 10_000, max_side: 64 }, ..LIMITS };
    let store = Assets::open(dir.path(), small).unwrap();
    assert!(store.builtin("constant", 13, 0).is_ok());
    assert!(matches!(store.builtin("constant", 14, 0), Err(Error::TooLarge { .. })));
}

#[test]
fn the_least_recently_used_is_decoded_again() {
    let dir = tempfile::tempdir().unwrap();
    let store = Assets::open(dir.path(), AssetLimits { max_resident_bytes: 16, ..LIMITS }).unwrap();
    let insert = |i: u8| store.volumes().insert(vec![i; 8], "cube", Some(BYTES_2X2X2)).unwrap();
    let ((first, first_id, _), (second, second_id, _)) = (insert(1), insert(2));
    assert!(Arc::ptr_eq(&first, &store.volumes().get(&first_id).unwrap()));
    insert(3);
    assert_eq!(store.sizes(), (24, 16));
    assert!(Arc::ptr_eq(&first, &store.volumes().get(&first_id).unwrap()), "used last, so kept");
    let again = store.volumes().get(&second_id).unwrap();
    assert!(!Arc::ptr_eq(&second, &again), "forgotten, and read from disk");
    assert_eq!(second.voxels().unwrap(), again.voxels().unwrap());
}

#[test]
fn builtins_are_listed_unbuilt_and_built_once() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path());
    let listed: Vec<_> = store.list_volumes().into_iter().filter_map(|info| info.builtin).collect();
    assert_eq!((listed.as_slice(), store.sizes()), (NAMES.map(str::to_owned).as_slice(), (0, 0)));
    let sphere = store.builtin("sphere", 16, 1).unwrap();
    assert!(Arc::ptr_eq(&sphere, &store.builtin("sphere", 16, 2).unwrap()), "its seed does not matter");
    let smoke = store.builtin("smoke", 16, 1).unwrap();
    assert!(Arc::ptr_eq(&smoke, &store.builtin("smoke", 16, 1).unwrap()));
    assert!(!Arc::ptr_eq(&smoke, &store.builtin("smoke", 16, 2).unwrap()));
    assert_eq!(pointer(store.builtin("teapot", 16, 0).map(|_| unreachable!())), "/volume/builtin");
    let info = store.builtin_info("smoke", 16, 1).unwrap();
    assert_eq!(info.reference, serde_json::json!({ "builtin": "smoke", "resolution": 16, "seed": 1 }));
    // The listed description of a built-in that is not built is that of the built one.
    let roomy = Assets::open(dir.path(), AssetLimits { max_resident_bytes: 1 << 30, ..LIMITS }).unwrap();
    let unbuilt = roomy.list_volumes().into_iter().find(|info| info.name == "constant").unwrap();
    let built = VolumeInfo { histogram: None, contents: None, ..roomy.builtin_info("constant", 128, 0).unwrap() };
    assert_eq!(unbuilt, built);
}

#[test]
fn many_uploads_of_one_content_at_once_are_one_volume() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path());
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8)
            .map(|_| scope.spawn(|| store.volumes().insert(vec![3; 8], "cube", Some(BYTES_2X2X2)).unwrap()))
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(results.iter().filter(|(_, _, new)| *new).count(), 1);
    assert_eq!(results.iter().map(|(_, id, _)| id).collect::<HashSet<_>>().len(), 1);
    assert_eq!(files(dir.path()).len(), 2);
}

#[test]
fn the_info_has_a_schema() {
    let schema = serde_json::to_value(schemars::schema_for!(VolumeInfo)).unwrap();
    assert!(schema["properties"]["world_from_index"].is_object());
}
