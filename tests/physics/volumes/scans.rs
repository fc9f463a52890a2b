//! Real scans.

use crate::common::writers::{LIMITS, read_file};
use cloudchamber::volume::{Volume, VoxelType, read};
use flate2::read::MultiGzDecoder;
use glam::{DMat3, DVec3};
use std::io::Read;
use std::path::{Path, PathBuf};

fn mri() -> Vec<u8> {
    let path = std::env::var("CLOUDCHAMBER_TEST_MRI").unwrap_or("/usr/share/mricron/templates/ch2.nii.gz".to_owned());
    std::fs::read(&path).unwrap_or_else(|cause| {
        panic!("{path}: {cause}; install mricron-data, or set CLOUDCHAMBER_TEST_MRI to the template ch2.nii.gz")
    })
}

/// A scan of the shared data; `None` if it is not there.
fn shared(name: &str) -> Option<Vec<u8>> {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    let bytes = std::fs::read(&path).ok();
    if bytes.is_none() {
        eprintln!("skipped: no {}", path.display());
    }
    bytes
}

fn total(volume: &Volume) -> u64 {
    volume.histogram().unwrap().counts.iter().sum()
}

#[test]
fn the_brain_template_is_read_as_it_is() {
    let start = std::time::Instant::now();
    let volume = read(&mri(), "ch2.nii.gz", None, &LIMITS).unwrap();
    println!("read in {:?}", start.elapsed());
    assert_eq!((volume.dims(), volume.voxel_type()), ([181, 217, 181], VoxelType::U8));
    assert_eq!((volume.range(), volume.spacing(), volume.unit()), ([0.0, 254.0], [1.0; 3], "mm"));
    assert_eq!((total(&volume), volume.bytes(), volume.non_finite()), (7_109_137, 7_109_137, 0));
    assert_eq!((volume.name(), volume.format()), ("ch2.nii.gz", "nifti"));
    let map = volume.world_from_index();
    assert_eq!(map.matrix3, DMat3::IDENTITY);
    assert_eq!(map.translation, DVec3::new(-90.5, -108.5, -90.5));
    let kept = volume.file_affine().unwrap();
    assert_eq!([kept[0][3], kept[1][3], kept[2][3]], [-90.0, -125.0, -71.0]);
    // White matter is the brightest part of the brain, and outside the head there is nothing.
    assert!(volume.values().unwrap().at(90 + 25, 125 - 20, 71 + 25) > 100.0);
    assert_eq!(volume.values().unwrap().at(1, 1, 179), 0.0);
}

#[test]
fn the_angiogram_is_scaled() {
    let Some(bytes) = shared("CT_AVM.nii.gz") else { return };
    let volume = read_file(&bytes).unwrap();
    assert_eq!((volume.dims(), volume.voxel_type()), ([256, 242, 154], VoxelType::U8));
    let slope = f64::from(2.208_627_5_f32);
    assert_eq!((volume.slope(), volume.inter()), (slope, 0.0));
    let brightest = (0..volume.voxel_count()).map(|i| volume.voxels().unwrap().get_f32(i)).fold(0.0, f32::max);
    assert_eq!(volume.range()[1], f64::from(brightest) * slope);
    assert!((volume.spacing()[0] - 0.719_942_57).abs() < 1e-7 && (volume.spacing()[2] - 1.0).abs() < 1e-7);
}

/// A scan that was taken at an angle. Its header gives its place twice: as rows and as a quaternion.
#[test]
fn rows_and_quaternion_agree_on_a_rotated_scan() {
    let Some(bytes) = shared("MR_Gd.nii.gz") else { return };
    let by_rows = read_file(&bytes).unwrap();
    let mut plain = Vec::new();
    MultiGzDecoder::new(bytes.as_slice()).read_to_end(&mut plain).unwrap();
    plain[254..256].fill(0);
    let by_quaternion = read_file(&plain).unwrap();
    let (rows, quaternion) = (by_rows.world_from_index(), by_quaternion.world_from_index());
    assert!(rows.abs_diff_eq(quaternion, 1e-3), "{rows} {quaternion}");
    assert!(rows.matrix3.y_axis.z.abs() > 0.1, "it is at an angle");
    assert_eq!(by_rows.voxels().unwrap(), by_quaternion.voxels().unwrap());
}
