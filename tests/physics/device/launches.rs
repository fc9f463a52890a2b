//! Launches of any kernel of a file over any range, with arguments by name.

use cloudchamber::device::Range;
use cloudchamber::device::program::{Source, Variant};

use super::open;

/// A file of two kernel functions, as a source.
fn two_functions() -> (tempfile::TempDir, Source) {
    let folder = tempfile::tempdir().unwrap();
    let text = "kernel void fill(global int *out, constant int *size) {\n\
        int x = (int)get_global_id(0), y = (int)get_global_id(1), z = (int)get_global_id(2);\n\
        if (x >= size[0] || y >= size[1] || z >= size[2]) return;\n\
        out[(z * size[1] + y) * size[0] + x] = x + 10 * y + 100 * z;\n}\n\
        kernel void twice(global const int *from, global int *to) {\n    to[get_global_id(0)] = 2 * from[get_global_id(0)];\n}\n";
    std::fs::write(folder.path().join("two.cl"), text).unwrap();
    (folder, Source { kernel: "two", words: String::new, structs: Vec::new, variants: Vec::new, common: 0 })
}

#[test]
fn functions_of_a_file_run_over_ranges_of_one_to_three_dimensions() {
    let (folder, source) = two_functions();
    let mut device = open(None, Some(folder.path()));
    let [fill, twice] = ["fill", "twice"].map(|name| Variant::new("two", None, &[]).of_function(name));
    device.build(&source, &fill).unwrap();
    device.build(&source, &twice).unwrap();
    for size in [[5i32, 1, 1], [5, 3, 1], [5, 3, 2]] {
        let count = size.iter().product::<i32>() as usize;
        let dims = size.map(|n| n as usize);
        let range = match dims {
            [x, 1, 1] => Range::from(x),
            [x, y, 1] => Range::from([x, y]),
            all => Range::from(all),
        };
        // Whole work-groups write past their count.
        let (out, to) = (device.allocate(4 * (count + 64)).unwrap(), device.allocate(4 * (count + 64)).unwrap());
        let size_buffer = device.upload(bytemuck::cast_slice(&size), 0).unwrap();
        // The arguments may come in any order.
        device.run(&fill, &[("size", &size_buffer), ("out", &out)], range).unwrap();
        device.run(&twice, &[("to", &to), ("from", &out)], count).unwrap();
        let mut found = vec![0i32; count];
        device.read(&to, 0, &mut found).unwrap();
        let place = |i: usize| (i % dims[0] + 10 * (i / dims[0] % dims[1]) + 100 * (i / dims[0] / dims[1])) as i32;
        assert_eq!(found, (0..count).map(|i| 2 * place(i)).collect::<Vec<_>>(), "{size:?}");
    }
}

#[test]
fn a_wrong_argument_is_named_with_its_kernel() {
    let (folder, source) = two_functions();
    let mut device = open(None, Some(folder.path()));
    let twice = Variant::new("two", None, &[]).of_function("twice");
    device.build(&source, &twice).unwrap();
    let buffer = device.allocate(64).unwrap();
    for (names, said) in [
        (&["from"][..], "two.twice: the argument to is missing"),
        (&["from", "film"], "two.twice: there is no parameter film"),
        (&["from", "to", "from"], "two.twice: the argument from is given twice"),
    ] {
        let arguments: Vec<_> = names.iter().map(|name| (*name, &buffer)).collect();
        let error = device.run(&twice, &arguments, 1).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let unknown = Variant::new("two", None, &[]).of_function("thrice");
    assert!(device.build(&source, &unknown).is_err());
}
