//! Every type in both byte orders through every format, and the headers' values and places.

use crate::common::writers::*;
use cloudchamber::error::Error;
use cloudchamber::volume::{Endian, RawQuery, RawType, Volume, VoxelType, read};
use glam::{DMat3, DVec3};

const DIMS: [usize; 3] = [5, 4, 3];
const NRRD_TYPES: [(RawType, &[&str]); 10] = [
    (RawType::U8, &["uchar", "unsigned char", "uint8", "uint8_t"]),
    (RawType::I8, &["signed char", "int8", "int8_t"]),
    (RawType::I16, &["short", "short int", "signed short", "signed short int", "int16", "int16_t"]),
    (RawType::U16, &["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"]),
    (RawType::I32, &["int", "signed int", "int32", "int32_t"]),
    (RawType::U32, &["uint", "unsigned int", "uint32", "uint32_t"]),
    (RawType::I64, &["longlong", "long long", "long long int", "signed long long", "int64", "int64_t"]),
    (RawType::U64, &["ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"]),
    (RawType::F32, &["float"]),
    (RawType::F64, &["double"]),
];

/// Values that need all bytes of every type. No 32-bit float holds some of them.
fn values() -> Vec<f64> {
    let mut values =
        vec![0.0, -1.0, 1.0, 255.0, -128.0, 258.0, -32768.0, 65535.0, 16_777_217.0, -123_456_789.0, 4e9, 9e18];
    values.extend((values.len()..60).map(|i| i as f64 * 3.7 - 70.0));
    values
}

fn data(raw: RawType, big: bool) -> Vec<u8> {
    values().into_iter().flat_map(|value| encode(raw, big, value)).collect()
}

fn assert_values(volume: &Volume, raw: RawType, case: &str) {
    assert_eq!(volume.dims(), DIMS, "{case}");
    let kept = match raw {
        RawType::U8 => VoxelType::U8,
        RawType::I8 | RawType::I16 => VoxelType::I16,
        RawType::U16 => VoxelType::U16,
        _ => VoxelType::F32,
    };
    assert_eq!(volume.voxel_type(), kept, "{case}");
    let expected: Vec<f32> = values().into_iter().map(|value| through(raw, value)).collect();
    let found: Vec<f32> = (0..60).map(|i| volume.values().unwrap().of(i) as f32).collect();
    assert_eq!(found, expected, "{case}");
    // The order is x fastest, then y, then z.
    assert_eq!(volume.values().unwrap().at(1, 2, 2), f64::from(expected[1 + 5 * (2 + 4 * 2)]), "{case}");
    assert!(volume.values().unwrap().at(5, 0, 0).is_nan(), "{case}");
}

#[test]
fn nifti_of_every_type_and_byte_order() {
    for (_, raw) in RawType::ALL {
        for big in [false, true] {
            let file = Nifti::new(big, [5, 4, 3], raw).with(&data(raw, big));
            assert_values(&read_file(&file).unwrap(), raw, &format!("{raw:?}, big: {big}"));
            let volume = read_file(&gzip(&file)).unwrap();
            assert_values(&volume, raw, &format!("{raw:?}, big: {big}, gzip"));
            assert_eq!(volume.format(), "nifti");
        }
    }
}

#[test]
fn nrrd_of_every_type_alias_and_byte_order() {
    for (raw, aliases) in NRRD_TYPES {
        for big in [false, true] {
            for alias in aliases {
                let endian = if big { "BIG" } else { "little" };
                let fields = format!("type: {alias}\nDimension: 3\nsizes: 5 4 3\nendian: {endian}\nowner:=me: you\n");
                let case = format!("{alias}, big: {big}");
                let plain = nrrd(&format!("{fields}encoding: raw"), &data(raw, big));
                assert_values(&read_file(&plain).unwrap(), raw, &case);
                let zipped = nrrd(&format!("{fields}encoding: gzip"), &gzip(&data(raw, big)));
                assert_values(&read_file(&zipped).unwrap(), raw, &case);
            }
        }
    }
}

#[test]
fn raw_of_every_type_and_byte_order() {
    for (name, raw) in RawType::ALL {
        for (big, endian) in [(false, None), (false, Some("little")), (true, Some("big"))] {
            let query = RawQuery {
                dims: Some("5x4x3".into()),
                r#type: Some(name.into()),
                spacing: Some("1,2.5,0.5".into()),
                endian: endian.map(str::to_owned),
            };
            let params = query.parse().unwrap().unwrap();
            assert_eq!(params.endian, if big { Endian::Big } else { Endian::Little });
            let volume = read(&data(raw, big), "test", Some(params), &LIMITS).unwrap();
            assert_values(&volume, raw, name);
            assert_eq!(volume.spacing(), [1.0, 2.5, 0.5]);
        }
    }
}

#[test]
fn raw_parameters_that_are_wrong_are_all_named() {
    assert_eq!(RawQuery::default().parse().unwrap(), None);
    let query = |dims: &str, kind: &str, spacing: &str, endian: &str| RawQuery {
        dims: Some(dims.into()),
        r#type: Some(kind.into()),
        spacing: Some(spacing.into()),
        endian: Some(endian.into()),
    };
    let pointers = |query: RawQuery| match query.parse() {
        Err(Error::Invalid(violations)) => violations.into_iter().map(|v| v.pointer).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    let all = ["query:dims", "query:type", "query:spacing", "query:endian"];
    assert_eq!(pointers(query("1,2", "u9", "1,1,0", "middle")), all);
    assert_eq!(pointers(query("0,1,1", "U8", "1,1,nan", "")), all);
    assert_eq!(pointers(query("1,-1,1", "", "1,1,-1", "LE")), all);
    assert_eq!(pointers(RawQuery { endian: Some("big".into()), ..Default::default() }), all[..2]);
    let params = query("2,2,2", "i16", "1,1,1", "big").parse().unwrap();
    for wrong in [15, 17] {
        assert_eq!(pointer(read(&vec![0; wrong], "test", params, &LIMITS)), "query:dims");
    }
}

#[test]
fn rounding_is_noted_and_only_where_it_happens() {
    let rounded = |raw, value| {
        let file = Nifti::new(false, [1, 1, 1], raw).with(&encode(raw, false, value));
        !read_file(&file).unwrap().notes().is_empty()
    };
    assert!(!rounded(RawType::I32, 16_777_216.0));
    assert!(rounded(RawType::I32, 16_777_217.0));
    assert!(rounded(RawType::U64, 16_777_217.0));
    assert!(!rounded(RawType::F64, 0.5));
    assert!(rounded(RawType::F64, 0.1));
    assert!(!rounded(RawType::F64, f64::NAN));
}

#[test]
fn slope_and_intercept_scale_values_and_nonsense_is_ignored() {
    for (slope, inter, expected) in [
        (0.5, -3.0, [-3.0, 8.5]),
        (-2.0, 10.0, [-36.0, 10.0]),
        (0.0, 7.0, [0.0, 23.0]),
        (f32::NAN, 7.0, [0.0, 23.0]),
        (f32::INFINITY, 7.0, [0.0, 23.0]),
        (2.0, f32::NAN, [0.0, 46.0]),
    ] {
        let (mut file, data) = small_nifti();
        file.put_f32(112, slope);
        file.put_f32(116, inter);
        let volume = read_file(&file.with(&data)).unwrap();
        assert_eq!(volume.range(), expected, "slope {slope}, inter {inter}");
        assert_eq!(volume.voxels().unwrap().get_f32(23), 23.0, "raw voxels stay as they are");
    }
    let (mut file, data) = small_nifti();
    file.put_f32(112, 3e38);
    assert_eq!(pointer(read_file(&file.with(&data))), "header:scl_slope");
}

fn linear_of(volume: &Volume) -> DMat3 {
    let map = volume.world_from_index();
    let dims = volume.dims().map(|n| n as f64 / 2.0);
    assert!(map.transform_point3(DVec3::from_array(dims)).length() < 1e-9, "the middle is the origin");
    map.matrix3
}

#[test]
fn the_affine_keeps_flips_and_rotations() {
    let (mut file, data) = small_nifti();
    // The rows are of radiological storage, in which x runs to the left, and of a rotation of the other two axes.
    let rows = [[-2.0, 0.0, 0.0, 90.0], [0.0, 0.0, -4.0, -126.0], [0.0, 3.0, 0.0, -72.0]];
    file.put_sform(rows);
    let volume = read_file(&file.with(&data)).unwrap();
    let expected = DMat3::from_cols(DVec3::X * -2.0, DVec3::Z * 3.0, DVec3::Y * -4.0);
    assert_eq!(linear_of(&volume), expected);
    assert_eq!(volume.spacing(), [2.0, 3.0, 4.0]);
    assert_eq!(volume.world_half_size(), DVec3::new(4.0, 4.0, 4.5));
    let kept = volume.file_affine().unwrap();
    assert_eq!([kept[0][3], kept[1][3], kept[2][3]], [90.0, -126.0, -72.0]);
}

#[test]
fn the_quaternion_gives_the_rotation_it_stands_for() {
    // A quarter turn about z: b = c = 0, d = sin 45°. Voxel x becomes world y, voxel y becomes world -x.
    for (qfac, z) in [(1.0, 1.0), (-1.0, -1.0), (0.0, 1.0)] {
        let (mut file, data) = small_nifti();
        file.put_f32(80, 2.0);
        file.put_qform([0.0, 0.0, 0.5f32.sqrt(), 5.0, 6.0, 7.0], qfac);
        let linear = linear_of(&read_file(&file.with(&data)).unwrap());
        let expected = DMat3::from_cols(DVec3::Y * 2.0, DVec3::NEG_X, DVec3::Z * z);
        assert!(linear.abs_diff_eq(expected, 1e-6), "qfac {qfac}: {linear}");
    }
    // Half a turn about x has a real part of 0, which rounding may make the root of a negative number.
    let (mut file, data) = small_nifti();
    file.put_qform([1.000_000_1, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0);
    let linear = linear_of(&read_file(&file.with(&data)).unwrap());
    assert!(linear.abs_diff_eq(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)), 1e-6), "{linear}");
}

#[test]
fn units_are_millimetres_in_the_end() {
    for (code, factor) in [(0, 1.0), (1, 1000.0), (2, 1.0), (3, 0.001), (2 + 8, 1.0)] {
        let (mut file, data) = small_nifti();
        file.bytes[123] = code;
        let volume = read_file(&file.with(&data)).unwrap();
        assert_eq!((volume.spacing(), volume.unit()), ([factor; 3], "mm"), "code {code}");
    }
    let volume = read_file(&small_nrrd("spacings: 2 3 4\nunits: \"um\" \"um\" \"um\"")).unwrap();
    assert_eq!(volume.spacing(), [0.002, 0.003, 0.004]);
    assert!(!read_file(&small_nrrd("units: \"mm\" \"mm\" \"s\"")).unwrap().notes().is_empty());
}

#[test]
fn nrrd_directions_end_in_ras_axes() {
    for (space, flip) in [
        ("space: right-anterior-superior", DVec3::ONE),
        ("space: RAS", DVec3::ONE),
        ("space: left-posterior-superior", DVec3::new(-1.0, -1.0, 1.0)),
        ("space: LPS", DVec3::new(-1.0, -1.0, 1.0)),
        ("space: las", DVec3::new(-1.0, 1.0, 1.0)),
        ("space dimension: 3", DVec3::ONE),
    ] {
        let fields = "space directions: (0.5, 0,0) (0,0,-2) (0,3,0)\nspace origin: (10,20,30)";
        let volume = read_file(&small_nrrd(&format!("{space}\n{fields}"))).unwrap();
        let expected = DMat3::from_cols(DVec3::X * 0.5, DVec3::Z * -2.0, DVec3::Y * 3.0);
        assert_eq!(linear_of(&volume), DMat3::from_diagonal(flip) * expected, "{space}");
        let kept = volume.file_affine().unwrap();
        assert_eq!([kept[0][3], kept[1][3], kept[2][3]], [10.0 * flip.x, 20.0 * flip.y, 30.0], "{space}");
    }
}

#[test]
fn nrrd_skips_and_an_axis_of_one() {
    let data: Vec<u8> = (0..24).collect();
    let base = "type: uint8\ndimension: 3\nsizes: 4 3 2\n";
    let raw = |fields: &str, before: &str| {
        nrrd(&format!("{base}encoding: raw\n{fields}"), &[before.as_bytes(), &data].concat())
    };
    let zip = |fields: &str, junk: &[u8], before: &str| {
        nrrd(&format!("{base}encoding: gz\n{fields}"), &[junk, &gzip(&[before.as_bytes(), &data].concat())].concat())
    };
    let four = |sizes: &str, fields: &str| {
        nrrd(&format!("type: uint8\ndimension: 4\nsizes: {sizes}\nencoding: raw\n{fields}"), &data)
    };
    for file in [
        raw("line skip: 2", "one\ntwo\n"),
        raw("byte skip: 3", "abc"),
        raw("byteskip: -1", "any number of bytes"),
        raw("lineskip: 1\nbyte skip: 1", "one\n?"),
        zip("line skip: 1", b"a line before the gzip data\n", ""),
        zip("byte skip: 3", b"", "abc"),
        four("4 3 2 1", "spacings: 1 1 1 nan"),
        four("1 4 3 2", "spacings: nan 1 1 1"),
        four("1 4 3 2", "space: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)"),
    ] {
        let text = String::from_utf8_lossy(&file).into_owned();
        let volume = read_file(&file).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(volume.dims(), [4, 3, 2], "{text}");
        assert_eq!(volume.voxels().unwrap().as_bytes(), data, "{text}");
    }
}

#[test]
fn doubles_that_floats_cannot_hold_are_named_by_what_becomes_of_them() {
    let values = [1e39f64, -2e300, 1e-50, 0.1, 0.5, f64::NAN, f64::INFINITY, -0.0];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let text = |query: &str| Some(query.to_owned());
    let query = RawQuery { dims: text("8,1,1"), r#type: text("f64"), spacing: None, endian: None };
    let volume = read(&bytes, "test", query.parse().unwrap(), &LIMITS).unwrap();
    let notes = volume.notes().join("; ");
    for said in ["2 of 8 values are beyond", "1 of 8 values are below", "1 of 8 values were rounded"] {
        assert!(notes.contains(said), "{said}: {notes}");
    }
    assert_eq!((volume.non_finite(), volume.range()), (4, [0.0, 0.5]));
}

#[test]
fn nrrd_lines_may_end_as_on_windows() {
    let mut file = b"NRRD0005\r\ntype: uint8\r\ndimension: 3\r\nsizes: 2 1 1\r\nencoding: raw\r\n\r\n".to_vec();
    file.extend([7, 9]);
    assert_eq!(read_file(&file).unwrap().voxels().unwrap().as_bytes(), [7, 9]);
}
