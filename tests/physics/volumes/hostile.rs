//! Files that lie, end early or explode. None may cause a panic, take memory that the data do not justify, or take long.

use crate::common::writers::*;
use cloudchamber::error::{Error, Result};
use cloudchamber::volume::{RawType, Volume, VolumeLimits, read};
use flate2::{Compression, write::GzEncoder};
use std::io::Write;
use std::time::{Duration, Instant};

fn too_large(result: Result<Volume>) -> bool {
    matches!(result, Err(Error::TooLarge { .. }))
}

fn quick<T>(work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    assert!(start.elapsed() < Duration::from_secs(1), "took {:?}", start.elapsed());
    result
}

/// A gibibyte of zeros in about a megabyte: 64 gzip members of 16 MiB each, which together are one gzip stream.
fn gibibyte_of_zeros() -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&vec![0; 16 << 20]).unwrap();
    encoder.finish().unwrap().repeat(64)
}

#[test]
fn a_gzip_cut_anywhere_is_truncated() {
    let mut random = Random(3);
    let data: Vec<u8> = (0..4096).map(|_| random.next() as u8).collect();
    let file = gzip(&Nifti::new(false, [16, 16, 16], RawType::U8).with(&data));
    assert!(read_file(&file).is_ok());
    for end in (3..file.len()).step_by(7).chain(file.len() - 9..file.len()) {
        let error = read_file(&file[..end]).unwrap_err();
        assert!(matches!(error, Error::Invalid(_)), "{end}: {error:?}");
        assert!(error.to_string().contains("too early"), "{end}: {error}");
    }
    for at in [file.len() / 2, file.len() - 6] {
        let mut damaged = file.clone();
        damaged[at] ^= 0x10;
        assert!(matches!(read_file(&damaged), Err(Error::Invalid(_))), "the checksum is checked");
    }
}

#[test]
fn a_gzip_bomb_is_not_inflated() {
    let zeros = gibibyte_of_zeros();
    assert!(zeros.len() < 2 << 20);
    let with_header = |dims, raw| [gzip(&Nifti::new(false, dims, raw).bytes), zeros.clone()].concat();
    assert!(matches!(quick(|| read_file(&zeros)), Err(Error::UnsupportedMediaType(_))));
    assert!(too_large(quick(|| read_file(&with_header([1024, 1024, 1024], RawType::U8)))));
    assert_eq!(quick(|| pointer(read_file(&with_header([8, 8, 8], RawType::U8)))), "header:dim");
    let nrrd_of = |sizes: &str| nrrd(&format!("type: uint8\ndimension: 3\nencoding: gzip\nsizes: {sizes}"), &zeros);
    assert!(too_large(quick(|| read_file(&nrrd_of("1024 1024 1024")))));
    assert_eq!(quick(|| pointer(read_file(&nrrd_of("8 8 8")))), "header:sizes");
    let skipping = nrrd("type: uint8\ndimension: 3\nencoding: gzip\nsizes: 8 8 8\nbyte skip: 1000000000", &zeros);
    assert_eq!(quick(|| pointer(read_file(&skipping))), "header:byte skip");
}

#[test]
fn announced_sizes_are_believed_only_with_data() {
    let generous = VolumeLimits { max_volume_bytes: 1 << 50, max_side: usize::MAX };
    let nifti_of = |dims, raw| Nifti::new(false, dims, raw).with(&[0; 100]);
    // The headers announce 5 GB and 34 TB, and a hundred bytes are sent.
    for dims in [[2048, 2048, 1280], [32767, 32767, 32767]] {
        let file = nifti_of(dims, RawType::U8);
        for sent in [file.clone(), gzip(&file)] {
            assert_eq!(quick(|| pointer(read(&sent, "test", None, &generous))), "header:dim");
        }
    }
    assert!(too_large(read_file(&nifti_of([2048, 2048, 1280], RawType::U8))));
    // 64 MiB of f64 in the file are 32 MiB in memory. The limit is on the memory that is kept.
    assert_eq!(pointer(read_file(&nifti_of([256, 256, 128], RawType::F64))), "header:dim");
    for sizes in ["4294967296 4294967296 4294967296", "18446744073709551615 2 1", "2097152 2097152 4194304"] {
        let file = nrrd(&format!("type: double\nendian: big\ndimension: 3\nencoding: raw\nsizes: {sizes}"), &[0; 64]);
        assert!(too_large(read(&file, "test", None, &generous)), "{sizes}");
        assert_eq!(pointer(read_file(&file)), "header:sizes", "{sizes}");
    }
}

#[test]
fn short_and_surplus_data_are_refused() {
    for (count, words) in [(23, "23"), (25, "25"), (0, "0"), (1000, "1000")] {
        let data = vec![1; count];
        let plain = small_nifti().0.with(&data);
        let error = read_file(&plain).unwrap_err().to_string();
        assert!(error.contains("24 bytes") && error.contains(words), "{error}");
        assert_eq!(pointer(read_file(&plain)), "header:dim");
        assert_eq!(pointer(read_file(&gzip(&plain))), "header:dim");
        let fields = "type: uchar\ndimension: 3\nsizes: 4 3 2\nencoding:";
        assert_eq!(pointer(read_file(&nrrd(&format!("{fields} raw"), &data))), "header:sizes");
        assert_eq!(pointer(read_file(&nrrd(&format!("{fields} gzip"), &gzip(&data)))), "header:sizes");
    }
}

#[test]
fn nifti_headers_that_make_no_sense_name_their_field() {
    let change = |expected: &str, change: &dyn Fn(&mut Nifti)| {
        let (mut file, data) = small_nifti();
        change(&mut file);
        assert_eq!(pointer(read_file(&file.with(&data))), expected);
    };
    for spacing in [-1.0, 0.0, f32::NAN, f32::INFINITY] {
        change("header:pixdim", &|file| file.put_f32(84, spacing));
    }
    change("header:dim", &|file| file.put_i16(42, 0));
    change("header:dim", &|file| file.put_i16(42, -4));
    change("header:datatype", &|file| file.put_i16(70, 128));
    change("header:magic", &|file| file.bytes[345] = b'i');
    change("header:sizeof_hdr", &|file| file.put_i32(0, 540));
    for offset in [1.0, 352.5, -352.0, f32::NAN, 1e30] {
        change("header:vox_offset", &|file| file.put_f32(108, offset));
    }
    change("header:vox_offset", &|file| file.put_f32(108, 4096.0));
    let time_points = |file: &mut Nifti| {
        file.put_i16(40, 4);
        file.put_i16(48, 2);
    };
    change("header:dim", &time_points);
    let (mut file, data) = small_nifti();
    time_points(&mut file);
    file.put_i16(48, 1);
    assert!(read_file(&file.with(&data)).is_ok(), "one time point is a volume");
    let flat = [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0]];
    change("header:srow", &|file| file.put_sform(flat));
    change("header:srow", &|file| file.put_sform([[f32::NAN; 4]; 3]));
    change("header:srow", &|file| file.put_sform([[0.0; 4]; 3]));
    change("header:quatern", &|file| file.put_qform([f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0));
    // With code 0 the same fields mean nothing.
    let (mut file, data) = small_nifti();
    file.put_sform([[f32::NAN; 4]; 3]);
    file.put_i16(254, 0);
    assert_eq!(read_file(&file.with(&data)).unwrap().file_affine(), None);
}

#[test]
fn nrrd_headers_that_make_no_sense_name_their_field() {
    for (fields, expected) in [
        ("spacings: 1 -1 1", "header:spacings"),
        ("spacings: 1 nan 1", "header:spacings"),
        ("spacings: 1 1", "header:spacings"),
        ("spacings: 1 inf 1", "header:spacings"),
        ("space: RAS\nspace directions: (1,0,0) (0,1,0) (1,1,0)", "header:space directions"),
        ("space: RAS\nspace directions: (1,0,0) (0,1,0) (0,nan,1)", "header:space directions"),
        ("space: RAS\nspace directions: (1,0,0) (0,1,0) none", "header:space directions"),
        ("space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0", "header:space directions"),
        ("space: RASTIME\nspace directions: (1,0,0) (0,1,0) (0,0,1)", "header:space"),
        ("space: RAS\nspace origin: (0,0)\nspace directions: (1,0,0) (0,1,0) (0,0,1)", "header:space origin"),
        ("data file: /etc/passwd", "header:data file"),
        ("datafile: LIST", "header:data file"),
        ("Data File: ../volume.raw", "header:data file"),
        ("type: float", "header:type"),
        ("byte skip: -2", "header:byte skip"),
        ("byte skip: 1", "header:sizes"),
        ("byte skip: 99", "header:byte skip"),
        ("line skip: 9", "header:line skip"),
        ("line skip: many", "header:line skip"),
        ("no colon", "header:"),
    ] {
        assert_eq!(pointer(read_file(&small_nrrd(fields))), expected, "{fields}");
    }
    for (fields, expected) in [
        ("dimension: 3\nsizes: 1 1 1\nencoding: raw", "header:type"),
        ("type: block\ndimension: 3\nsizes: 1 1 1\nencoding: raw", "header:type"),
        ("type: uchar\nsizes: 1 1 1\nencoding: raw", "header:dimension"),
        ("type: uchar\ndimension: 2\nsizes: 1 1\nencoding: raw", "header:dimension"),
        ("type: uchar\ndimension: 3\nencoding: raw", "header:sizes"),
        ("type: uchar\ndimension: 3\nsizes: 1 0 1\nencoding: raw", "header:sizes"),
        ("type: uchar\ndimension: 3\nsizes: 1 -1 1\nencoding: raw", "header:sizes"),
        ("type: uchar\ndimension: 4\nsizes: 2 1 1 2\nencoding: raw", "header:sizes"),
        ("type: uchar\ndimension: 3\nsizes: 1 1 1", "header:encoding"),
        ("type: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: bzip2", "header:encoding"),
        ("type: short\ndimension: 3\nsizes: 1 1 1\nencoding: raw", "header:endian"),
    ] {
        assert_eq!(pointer(read_file(&nrrd(fields, &[0]))), expected, "{fields}");
    }
    assert_eq!(pointer(read_file(b"NRRD0004\ntype: uchar\n")), "header:");
    assert_eq!(pointer(read_file(b"NRRD0009\n\n")), "header:magic");
}

#[test]
fn what_is_no_volume_is_refused_with_the_formats_read() {
    assert_eq!(pointer(read_file(b"")), "");
    let mut nifti_2 = vec![0; 540];
    nifti_2[4..8].copy_from_slice(b"n+2\0");
    for body in [b"GIF89a".to_vec(), vec![0; 5000], b"n+1".to_vec(), nifti_2, gzip(b"text"), gzip(b"")] {
        match read_file(&body) {
            Err(Error::UnsupportedMediaType(words)) => assert!(words.contains("NRRD") && words.contains("NIfTI")),
            other => panic!("{other:?}"),
        }
    }
}

/// Thousands of damaged files. Any answer is right but a panic, a large volume, or a long wait.
#[test]
fn damaged_files_do_no_harm() {
    let (file, data) = small_nifti();
    let nifti = file.with(&data);
    let nrrd_fields =
        "byte skip: 0\nline skip: 0\nspacings: 1 1 1\nspace: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)";
    let seeds = [
        nifti.clone(),
        gzip(&nifti),
        small_nrrd(nrrd_fields),
        nrrd("type: short\nendian: big\ndimension: 3\nsizes: 4 3 2\nencoding: gzip", &gzip(&[7; 48])),
        Nifti::new(true, [4, 3, 2], RawType::F64).with(&[63; 192]),
    ];
    let limits = VolumeLimits { max_volume_bytes: 1 << 20, max_side: 1000 };
    let mut random = Random(4);
    let start = Instant::now();
    let mut read_anyway = 0;
    for round in 0..12_000 {
        let mut file = seeds[round % seeds.len()].clone();
        for _ in 0..=random.below(4) {
            let at = random.below(file.len());
            match random.below(6) {
                0 => file.truncate(at.max(1)),
                1 => file[at] ^= 1 << random.below(8),
                2 => file[at] = [0, 0x7f, 0x80, 0xff][random.below(4)],
                3 => file[at] = b"0123456789-(),:\n"[random.below(16)],
                4 => drop(file.splice(at..at, random.next().to_le_bytes())),
                _ => file[at] = random.next() as u8,
            }
        }
        if let Ok(volume) = read(&file, "fuzz", None, &limits) {
            assert!(volume.bytes() <= 1 << 20);
            assert!(volume.world_from_index().is_finite() && volume.range().iter().all(|end| end.is_finite()));
            read_anyway += 1;
        }
    }
    assert!(read_anyway > 100, "damage in the data alone leaves a volume: {read_anyway}");
    assert!(start.elapsed() < Duration::from_secs(10), "took {:?}", start.elapsed());
}
